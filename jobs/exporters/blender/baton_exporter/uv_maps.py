"""The UV maps that materials read as glTF's sets; runs inside Blender.

A material reads maps by name, and any mesh may have them in another order. Baton reads two sets. So the faces of each material
get its first map as set 0 and its second one as set 1."""

import numpy

from . import nodes

SETS = 2
ACTIVE = ""  # the name of the map that a mesh has chosen for renders


def lay_out(shapes, report):
    """shapes: with a name and a mesh. Writes the meshes' UV maps anew, and names them in the materials."""
    named = {shape.mesh: shape.name for shape in reversed(list(shapes))}
    used = dict.fromkeys(material for mesh in named for material in mesh.materials)
    maps = {material: maps_of(material, report) for material in used}
    for mesh, name in named.items():
        lay_out_mesh(mesh, maps, f'object "{name}"', report)


def maps_of(material, report):
    """Names in the order of the sets, none where no image is read."""
    output = nodes.active_output(material.node_tree, "OUTPUT_MATERIAL")
    textures = [n for n in nodes.feeding(output.inputs["Surface"]) if n.type == "TEX_IMAGE"] if output else []
    readers = [map_node(texture) for texture in textures]
    names = list(dict.fromkeys(reader.uv_map if reader else ACTIVE for reader in readers))
    # Blender's exporter takes what has no name from the set that is active: the first one.
    names.sort(key=lambda name: name != ACTIVE)
    for name in names[SETS:]:
        report.add(f'material "{material.name}"', f'UV map "{name}": two are read, and the first is shown in its place',
                   "let all its images use two UV maps")
    for reader in {reader for reader in readers if reader}:
        number = names.index(reader.uv_map)
        reader.uv_map = set_name(number if number < SETS else 0)
    return names[:SETS]


def map_node(texture):
    """The UV Map node behind an Image Texture and its Mapping, or None."""
    given = nodes.source(texture.inputs["Vector"])
    if given is not None and given.node.type == "MAPPING":
        given = nodes.source(given.node.inputs["Vector"])
    return given.node if given is not None and given.node.type == "UVMAP" else None


def lay_out_mesh(mesh, maps, where, report):
    slots = numpy.empty(len(mesh.polygons), numpy.int32)
    corners = slots.copy()
    mesh.polygons.foreach_get("material_index", slots)
    mesh.polygons.foreach_get("loop_total", corners)
    slot_of = numpy.repeat(numpy.minimum(slots, len(mesh.materials) - 1), corners)
    sets = {}
    for slot, material in enumerate(mesh.materials):
        # Where no image is read, the active one stays, for materials that a job puts in place of the file's.
        for number, name in enumerate(maps[material] or [ACTIVE]):
            places = places_of(mesh, name)
            if places is None and not maps[material]:
                continue
            if places is None:
                said = f' "{name}"' if name else ""
                report.add(where, f'it has no UV map{said}, which material "{material.name}" reads',
                           "unwrap it, or choose a UV map that it has")
                places = numpy.zeros((len(mesh.loops), 2), numpy.float32)  # as Cycles
            rows = slot_of == slot
            sets.setdefault(number, numpy.zeros((len(mesh.loops), 2), numpy.float32))[rows] = places[rows]
    while mesh.uv_layers:
        mesh.uv_layers.remove(mesh.uv_layers[0])
    for number in range(max(sets, default=-1) + 1):
        layer = mesh.uv_layers.new(name=set_name(number), do_init=False)
        layer.active_render = number == 0
        layer.data.foreach_set("uv", sets.get(number, numpy.zeros((len(mesh.loops), 2), numpy.float32)).ravel())


def set_name(number):
    return f"set {number}"


def places_of(mesh, name):
    """(corners, 2), or None."""
    layer = next((layer for layer in mesh.uv_layers if (layer.active_render if name == ACTIVE else layer.name == name)), None)
    if layer is None:
        return None
    places = numpy.empty(2 * len(mesh.loops), numpy.float32)
    layer.data.foreach_get("uv", places)
    return places.reshape(-1, 2)

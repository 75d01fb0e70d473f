"""The shapes of a scene as they are rendered, and where each is in every frame; runs inside Blender."""

import bmesh
import bpy
import numpy

from .faces import cut_bent, drop_without_area

DEFORMATION = 1e-5  # of the size of a mesh
# What geometry nodes make beside meshes, and Cycles shows. Curves without a surface it does not.
PARTS = {"POINTCLOUD": "points", "CURVES": "hair", "VOLUME": "a volume"}


class Shape:
    """A mesh in one place of each frame."""

    def __init__(self, name, mesh, catcher):
        self.name, self.mesh, self.catcher = name, mesh, catcher
        self.matrices = []


class Geometry:
    """Collects the shapes, frame by frame. One that is seen in some frames is there in all, and reported."""

    def __init__(self, report):
        self.report = report
        self.objects = set()   # of the file, that any frame shows
        self.shapes = {}
        self.meshes = {}       # by what they were made of, and by the object of the file
        self.witnesses = {}    # vertices of what may deform, in the first frame that has it
        self.poses = {}        # of the mesh of a witness that does: frame by frame, None where it is as in its first one
        self.without = {}      # why nothing of a key is seen
        self.frames = 0

    def take(self, depsgraph):
        """The evaluated scene in the next frame."""
        seen = set()
        for instance in depsgraph.object_instances:
            shown = instance.object
            parent = instance.parent.name if instance.parent else ""
            key = (shown.name, parent, tuple(instance.persistent_id) if instance.is_instance else ())
            self.objects.add(shown.original)
            if shown.type in PARTS and shown.type != shown.original.type:
                self.report.add(where(key), f"{PARTS[shown.type]} that its geometry nodes make",
                                "make meshes of them within the nodes")
            # Curves, texts and metaballs are listed twice: as they are, and as the mesh they have become.
            if not instance.show_self or shown.type != "MESH":
                continue
            if key not in self.shapes:
                self.begin(key, instance, depsgraph)
            elif key in self.witnesses:
                self.compare(key, shown, depsgraph)
            if key in self.shapes and has_faces(shown):
                self.shapes[key].matrices.append(instance.matrix_world.copy())
                seen.add(key)
        for poses in self.poses.values():
            poses += [None] * (self.frames + 1 - len(poses))
        for key, shape in self.shapes.items():
            if key not in seen:
                shape.matrices.append(shape.matrices[-1])
                self.report_partly(key)
        self.frames += 1

    def begin(self, key, instance, depsgraph):
        """A shape, once it has a surface; in the frames before it stands where it is now."""
        shown = instance.object
        mesh = self.mesh_of(key, shown, depsgraph)
        if mesh is None:
            return
        self.shapes[key] = Shape(shown.name, mesh, shown.original.is_shadow_catcher)
        self.shapes[key].matrices = [instance.matrix_world.copy() for _ in range(self.frames)]
        if self.frames:
            self.report_partly(key)

    def report_partly(self, key):
        self.report.add(where(key), "it is not there, or has no faces, in some frames, but is shown in all",
                        "hide nothing within a shot: export frames before and after as two jobs")

    def finish(self):
        """Reports what no frame has shown."""
        for key, why in self.without.items():
            if key not in self.shapes:
                self.report.add(where(key), f"{why}, so nothing of it is seen",
                                "give it a surface, such as a curve's bevel, or hide it")

    def mesh_of(self, key, shown, depsgraph):
        """The evaluated mesh, one for all that share it; None where there is no surface."""
        slots = tuple(material.name if material else "" for material in materials_of(shown))
        made_by_nodes = is_made_by_nodes(key)
        # A place in memory means something within its frame alone.
        made_of = (self.frames, shown.data.as_pointer(), slots)
        source = made_of if made_by_nodes else (shown.original, slots)
        if source in self.meshes or made_of in self.meshes:
            mesh = self.meshes.get(source) or self.meshes.get(made_of)
        else:
            mesh = self.new_mesh(key, shown, depsgraph)
            if mesh is not None and may_deform(shown):
                self.witnesses[key] = vertices_of(shown, depsgraph, made_by_nodes)
        self.meshes[made_of] = mesh
        if mesh is not None:
            self.meshes[source] = mesh
        return mesh

    def new_mesh(self, key, shown, depsgraph):
        """The evaluated mesh; None where there is no surface."""
        if not has_faces(shown):
            if len(shown.data.vertices):
                self.without[key] = "it has no faces"
            return None
        mesh = evaluated_mesh(shown, depsgraph, is_made_by_nodes(key))
        set_materials(mesh, shown)
        dropped = drop_without_area(mesh)
        if not len(mesh.polygons):
            self.without[key] = "its faces have no area"
            return None
        if dropped and may_deform(shown):
            self.report.add(where(key), "the faces of a material of which none has an area when it is first seen",
                            "give one of them an area there")
        cut_bent(mesh)
        return mesh

    def compare(self, key, shown, depsgraph):
        before, now = self.witnesses[key], vertices_of(shown, depsgraph, is_made_by_nodes(key))
        if before.shape != now.shape:
            self.report.add(where(key), "its vertices are others in some frames, but it is shown as when it is first seen",
                            "render each shape as a job of its own")
            self.poses.pop(self.shapes[key].mesh, None)
            del self.witnesses[key]
            return
        largest = float(numpy.abs(before).max(initial=1e-9))
        if float(numpy.abs(now - before).max(initial=0)) > DEFORMATION * largest:
            poses = self.poses.setdefault(self.shapes[key].mesh, [None] * self.frames)
            poses.append(now)


def where(key):
    return f'object "{key[0]}"'


def has_faces(shown):
    return len(shown.data.polygons) > 0


def is_made_by_nodes(key):
    """What is no object of the file: a curve's mesh, or instances that geometry nodes have made."""
    name, parent, path = key
    return bool(path) and name == parent


def evaluated(shown, depsgraph):
    """The object of the file, which lives longer than what Blender lists."""
    return shown.original.evaluated_get(depsgraph)


def evaluated_mesh(shown, depsgraph, made_by_nodes):
    if not made_by_nodes:
        return bpy.data.meshes.new_from_object(evaluated(shown, depsgraph), preserve_all_data_layers=True,
                                               depsgraph=depsgraph)
    mesh, copied = bpy.data.meshes.new(shown.name), bmesh.new()
    copied.from_mesh(shown.data)
    copied.to_mesh(mesh)
    copied.free()
    return mesh


def set_materials(mesh, shown):
    """Those of the object's slots, which may differ from the mesh's; empty ones get what Cycles shows there."""
    # Clearing the list would give all faces the first one.
    for slot, material in enumerate(materials_of(shown)):
        if slot == len(mesh.materials):
            mesh.materials.append(None)
        mesh.materials[slot] = material.original if material else no_material()


def materials_of(shown):
    """By slot; what geometry nodes have made has its own."""
    own = list(shown.data.materials)
    source = shown.original
    slots = [slot.material for slot in shown.material_slots]
    return (own if source.data and source.data.name != shown.data.name else slots) or own or [None]


def no_material():
    """Cycles shows what has no material as 80 % grey, diffuse."""
    name = "no material"
    if name not in bpy.data.materials:
        made = bpy.data.materials.new(name)
        made.use_nodes = True
        made.node_tree.nodes.clear()
        surface = made.node_tree.nodes.new("ShaderNodeBsdfDiffuse")
        output = made.node_tree.nodes.new("ShaderNodeOutputMaterial")
        made.node_tree.links.new(surface.outputs[0], output.inputs["Surface"])
    return bpy.data.materials[name]


def may_deform(shown):
    data = shown.data
    source = shown.original
    return (bool(shown.modifiers or data.shape_keys or data.animation_data) or source.type != "MESH"
            or source.data.name != data.name)


def vertices_of(shown, depsgraph, made_by_nodes):
    """Places of the evaluated mesh's vertices: (vertices, 3)."""
    source = None if made_by_nodes else evaluated(shown, depsgraph)
    mesh = source.to_mesh() if source else shown.data
    places = numpy.empty(3 * len(mesh.vertices), numpy.float32)
    mesh.vertices.foreach_get("co", places)
    if source:
        source.to_mesh_clear()
    return places.reshape(-1, 3)

"""The shapes of a scene as they are rendered, and where each is in every frame; runs inside Blender."""

import bmesh
import bpy
import numpy

from .flat_faces import cut_bent

DEFORMATION = 1e-5  # of the size of a mesh


def as_rendered(scene, view_layer):
    """Makes what the evaluated scene shows that what renders show: Blender evaluates it as its viewport does."""
    scene.render.use_simplify, simplify = False, scene.render.use_simplify
    for item in scene.objects:
        item.hide_viewport = item.hide_render
        if item.name in view_layer.objects:
            item.hide_set(False, view_layer=view_layer)
        item.show_instancer_for_viewport = item.show_instancer_for_render
        for modifier in item.modifiers:
            modifier.show_viewport = modifier.show_render
            show_as_rendered(modifier)
            if simplify and modifier.type == "SUBSURF":
                modifier.levels = min(modifier.levels, scene.render.simplify_subdivision_render)
        for system in item.particle_systems:
            system.settings.display_percentage = 100
    for collection in (scene.collection, *scene.collection.children_recursive):
        collection.hide_viewport = collection.hide_render
    for layer in layer_collections(view_layer.layer_collection):
        layer.hide_viewport = False
    for curve in bpy.data.curves:
        curve.resolution_u = curve.render_resolution_u or curve.resolution_u
        curve.resolution_v = curve.render_resolution_v or curve.resolution_v
    for ball in bpy.data.metaballs:
        ball.resolution = ball.render_resolution


def show_as_rendered(modifier):
    for viewport, render in (("levels", "render_levels"), ("viewport_resolution", "resolution")):
        if modifier.type in ("SUBSURF", "MULTIRES", "OCEAN") and hasattr(modifier, render):
            setattr(modifier, viewport, getattr(modifier, render))


def layer_collections(layer):
    yield layer
    for child in layer.children:
        yield from layer_collections(child)


class Shape:
    """A mesh in one place of each frame."""

    def __init__(self, name, mesh, catcher):
        self.name, self.mesh, self.catcher = name, mesh, catcher
        self.matrices = []


class Geometry:
    """Collects the shapes, frame by frame."""

    def __init__(self, report):
        self.report = report
        self.shapes = {}
        self.meshes = {}     # by what they were made of, in the first frame
        self.witnesses = {}  # vertices in the first frame of what may deform
        self.poses = {}      # of the mesh of a witness that does: frame by frame, None where it is as in the first one
        self.first = set()   # keys of the first frame
        self.frames = 0

    def take(self, depsgraph):
        """The evaluated scene in the next frame."""
        seen = set()
        for instance in depsgraph.object_instances:
            shown = instance.object
            # Curves, texts and metaballs are listed twice: as they are, and as the mesh they have become.
            if not instance.show_self or shown.type != "MESH":
                continue
            parent = instance.parent.name if instance.parent else ""
            key = (shown.name, parent, tuple(instance.persistent_id) if instance.is_instance else ())
            seen.add(key)
            if self.frames == 0:
                self.first.add(key)
                mesh = self.mesh_of(key, shown, depsgraph)
                if mesh is not None:
                    self.shapes[key] = Shape(shown.name, mesh, shown.original.is_shadow_catcher)
            elif key in self.witnesses and key in self.shapes:
                self.compare(key, shown, depsgraph)
            if key in self.shapes:
                self.shapes[key].matrices.append(instance.matrix_world.copy())
            elif key not in self.first:
                self.report.add(where(key), "it is not there in the first frame, and never shown",
                                "hide nothing within a shot: export frames before and after as two jobs")
        for poses in self.poses.values():
            poses += [None] * (self.frames + 1 - len(poses))
        for key, shape in self.shapes.items():
            if key not in seen:
                shape.matrices.append(shape.matrices[-1])
                self.report.add(where(key), "it is not there in some frames, but always shown",
                                "hide nothing within a shot: export frames before and after as two jobs")
        self.frames += 1

    def mesh_of(self, key, shown, depsgraph):
        """The evaluated mesh, one for all that share it; None where there is no surface."""
        slots = tuple(material.name if material else "" for material in materials_of(shown))
        made_of = (shown.data.as_pointer(), slots)
        if made_of not in self.meshes:
            mesh = new_mesh(shown, depsgraph, is_made_by_nodes(key))
            if mesh is not None and len(mesh.polygons) == 0:
                if mesh.vertices:
                    self.report.add(where(key), "it has no faces, so nothing of it is seen",
                                    "give edges and points a surface, such as a curve's bevel")
                mesh = None
            if mesh is not None:
                set_materials(mesh, shown)
                cut_bent(mesh)
                if may_deform(shown):
                    self.witnesses[key] = vertices_of(shown, depsgraph, is_made_by_nodes(key))
            self.meshes[made_of] = mesh
        return self.meshes[made_of]

    def compare(self, key, shown, depsgraph):
        before, now = self.witnesses[key], vertices_of(shown, depsgraph, is_made_by_nodes(key))
        if before.shape != now.shape:
            self.report.add(where(key), "its vertices are others in each frame, but it is shown as in the first one",
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


def is_made_by_nodes(key):
    """What is no object of the file: a curve's mesh, or instances that geometry nodes have made."""
    name, parent, path = key
    return bool(path) and name == parent


def evaluated(shown, depsgraph):
    """The object of the file, which lives longer than what Blender lists."""
    return shown.original.evaluated_get(depsgraph)


def new_mesh(shown, depsgraph, made_by_nodes):
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

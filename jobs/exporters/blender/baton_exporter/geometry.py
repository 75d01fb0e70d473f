"""The shapes of a scene as they are rendered, and where each is in every frame; runs inside Blender."""

import bpy
import numpy

from .flat_faces import cut_bent

SHAPES = {"MESH", "CURVE", "SURFACE", "FONT", "META"}
DEFORMATION = 1e-5  # of the size of a mesh


def as_rendered(scene, view_layer):
    """Makes what the evaluated scene shows that what renders show: Blender evaluates it as its viewport does."""
    scene.render.use_simplify, simplify = False, scene.render.use_simplify
    for item in scene.objects:
        item.hide_viewport = item.hide_render
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

    def __init__(self, name, mesh):
        self.name, self.mesh = name, mesh
        self.matrices = []


class Geometry:
    """Collects the shapes, frame by frame."""

    def __init__(self, report):
        self.report = report
        self.shapes = {}
        self.meshes = {}     # by what they were made of, in the first frame
        self.witnesses = {}  # vertices in the first frame of what may deform
        self.frames = 0
        self.owners = set()

    def take(self, depsgraph):
        """The evaluated scene in the next frame."""
        seen = set()
        for instance in depsgraph.object_instances:
            shown = instance.object
            if not instance.show_self or shown.type not in SHAPES:
                continue
            parent = instance.parent.name if instance.parent else ""
            key = (shown.name, parent, tuple(instance.persistent_id) if instance.is_instance else ())
            seen.add(key)
            if self.frames == 0:
                mesh = self.mesh_of(key, shown, depsgraph)
                if mesh is not None:
                    self.shapes[key] = Shape(shown.name, mesh)
            elif key in self.witnesses:
                self.compare(key, shown)
            if key in self.shapes:
                self.shapes[key].matrices.append(instance.matrix_world.copy())
            elif self.frames > 0:
                self.report.add(shown.name, "it is not there in the first frame, and never shown",
                                "hide nothing within a shot: export frames before and after as two jobs")
        for key, shape in self.shapes.items():
            if key not in seen:
                shape.matrices.append(shape.matrices[-1])
                self.report.add(shape.name, "it is not there in some frames, but always shown",
                                "hide nothing within a shot: export frames before and after as two jobs")
        self.frames += 1

    def mesh_of(self, key, shown, depsgraph):
        """The evaluated mesh, one for all that share it; None where there is no surface."""
        slots = tuple(slot.material.name if slot.material else "" for slot in shown.material_slots)
        made_of = (shown.data.as_pointer(), slots, "" if shown.type == "MESH" else shown.name)
        if made_of not in self.meshes:
            mesh = bpy.data.meshes.new_from_object(shown, preserve_all_data_layers=True, depsgraph=depsgraph)
            if mesh is not None and len(mesh.polygons) == 0:
                if mesh.vertices:
                    self.report.add(shown.name, "it has no faces, so nothing of it is seen",
                                    "give edges and points a surface, such as a curve's bevel")
                mesh = None
            if mesh is not None:
                set_materials(mesh, shown)
                cut_bent(mesh)
                if may_deform(shown):
                    self.witnesses[key] = vertices_of(shown)
            self.meshes[made_of] = mesh
            self.owners.add(shown.name)
        return self.meshes[made_of]

    def compare(self, key, shown):
        before, now = self.witnesses[key], vertices_of(shown)
        largest = float(numpy.abs(before).max(initial=1e-9))
        if before.shape != now.shape or float(numpy.abs(now - before).max()) > DEFORMATION * largest:
            self.report.add(shown.name, "it deforms, but is shown as in the first frame",
                            "move it as a whole, or render each shape as a job of its own")
            del self.witnesses[key]


def set_materials(mesh, shown):
    """Those of the object's slots, which may differ from the mesh's; empty ones get what Cycles shows there."""
    materials = [slot.material for slot in shown.material_slots] or [None]
    mesh.materials.clear()
    for material in materials:
        given = bpy.data.materials.get(material.name) if material else None
        mesh.materials.append(given or no_material())


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
    plain = shown.type == "MESH" and not shown.modifiers and not data.shape_keys and not data.animation_data
    original = shown.original
    return not plain or original is None or original.type != shown.type


def vertices_of(shown):
    """Places of the evaluated mesh's vertices: (vertices, 3)."""
    mesh = shown.to_mesh()
    places = numpy.empty(3 * len(mesh.vertices), numpy.float32)
    mesh.vertices.foreach_get("co", places)
    shown.to_mesh_clear()
    return places.reshape(-1, 3)

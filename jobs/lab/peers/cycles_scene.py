"""Renders what placed_scene wrote with Cycles, direct light only; runs inside Blender 3.4:

blender -b --factory-startup -P cycles_scene.py -- PLACED OUT --spp 64 --seed 1 --threads 2 [--every 4]
    [--fault turn|mirror|shift]

OUT gets an uncompressed float EXR for every frame, or every 4th from the first, with Baton's file names. After each the
CPU seconds so far are printed. --fault plants an error of convention, for
the test that such errors are seen: a map turned by a quarter of a degree, a mirrored one, a picture moved by a tenth of
a pixel.
"""

import argparse
import array
import json
import math
import os
import sys
from pathlib import Path

import bpy
from mathutils import Matrix

sys.path.insert(0, str(Path(__file__).parent))
import conventions  # noqa: E402
import cycles_settings  # noqa: E402

FAULTS = ("turn", "mirror", "shift")


def parse_arguments():
    parser = argparse.ArgumentParser()
    parser.add_argument("placed", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--spp", type=int, required=True)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--threads", type=int, required=True)
    parser.add_argument("--every", type=int, default=1)
    parser.add_argument("--fault", choices=FAULTS)
    return parser.parse_args(sys.argv[sys.argv.index("--") + 1:])


def set_picture(scene, placed):
    scene.cycles.pixel_filter_type = "BOX"
    scene.cycles.filter_width = 1
    render = scene.render
    render.resolution_x, render.resolution_y, render.resolution_percentage = placed["width"], placed["height"], 100
    render.film_transparent = False
    render.use_persistent_data = True  # of a sequence: meshes and their hierarchy are built once


def make_material(entry, number):
    material = bpy.data.materials.new(f"material-{number}")
    material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()
    if entry["type"] == "diffuse":
        surface = nodes.new("ShaderNodeBsdfDiffuse")
        surface.inputs["Color"].default_value = (*entry["color"], 1)
        surface.inputs["Roughness"].default_value = 0
    else:
        surface = nodes.new("ShaderNodeBsdfGlossy")
        surface.distribution = "GGX"
        surface.inputs["Color"].default_value = (1, 1, 1, 1)
        surface.inputs["Roughness"].default_value = entry["roughness"]
    shown = surface.outputs["BSDF"]
    if "coat" in entry:
        shown = coat_over(shown, entry["coat"], nodes, links)
    links.new(shown, nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    return material


def coat_over(below, coat, nodes, links):
    """A white GGX lobe mixed over `below` by weight (0.04 + 0.96 (1 - n.v)^5), as KHR_materials_clearcoat has it."""
    def math_node(operation, first, second):
        node = nodes.new("ShaderNodeMath")
        node.operation = operation
        for socket, given in zip(node.inputs, (first, second)):
            if isinstance(given, (int, float)):
                socket.default_value = given
            else:
                links.new(given, socket)
        return node.outputs[0]

    seen, cosine, mix = nodes.new("ShaderNodeNewGeometry"), nodes.new("ShaderNodeVectorMath"), nodes.new("ShaderNodeMixShader")
    cosine.operation = "DOT_PRODUCT"
    links.new(seen.outputs["Normal"], cosine.inputs[0])
    links.new(seen.outputs["Incoming"], cosine.inputs[1])
    grazing = math_node("POWER", math_node("SUBTRACT", 1, cosine.outputs["Value"]), 5)
    share = math_node("ADD", math_node("MULTIPLY", grazing, 0.96 * coat["weight"]), 0.04 * coat["weight"])
    lobe = nodes.new("ShaderNodeBsdfGlossy")
    lobe.distribution = "GGX"
    lobe.inputs["Color"].default_value = (1, 1, 1, 1)
    lobe.inputs["Roughness"].default_value = coat["roughness"]
    links.new(share, mix.inputs["Fac"])
    links.new(below, mix.inputs[1])
    links.new(lobe.outputs["BSDF"], mix.inputs[2])
    return mix.outputs[0]


def read_mesh(folder, entry):
    """Vertices, own normals (or none) and indices of triangles."""
    def floats(file, count):
        values = array.array("f")
        values.fromfile(file, count)
        return conventions.flat_to_blender(values)

    with (folder / entry["file"]).open("rb") as file:
        vertices = floats(file, 3 * entry["vertices"])
        normals = floats(file, 3 * entry["vertices"]) if entry["normals"] == "own" else None
        triangles = array.array("i")
        triangles.fromfile(file, 3 * entry["triangles"])
    return vertices, normals, triangles


def make_mesh(folder, entry):
    vertices, normals, triangles = read_mesh(folder, entry)
    count = entry["triangles"]
    mesh = bpy.data.meshes.new(entry["file"])
    mesh.vertices.add(entry["vertices"])
    mesh.vertices.foreach_set("co", vertices)
    mesh.loops.add(3 * count)
    mesh.loops.foreach_set("vertex_index", triangles)
    mesh.polygons.add(count)
    mesh.polygons.foreach_set("loop_start", array.array("i", range(0, 3 * count, 3)))
    mesh.polygons.foreach_set("loop_total", array.array("i", [3]) * count)
    mesh.polygons.foreach_set("use_smooth", array.array("b", [entry["normals"] != "flat"]) * count)
    mesh.update(calc_edges=True)
    if normals is not None:
        mesh.use_auto_smooth, mesh.auto_smooth_angle = True, math.pi
        mesh.normals_split_custom_set_from_vertices(list(zip(normals[0::3], normals[1::3], normals[2::3])))
    return mesh


def make_objects(scene, folder, placed):
    materials = [make_material(entry, number) for number, entry in enumerate(placed["materials"])]
    meshes = [make_mesh(folder, entry) for entry in placed["meshes"]]
    objects = []
    for number, instance in enumerate(placed["instances"]):
        mesh = meshes[instance["mesh"]]
        if not mesh.materials:
            mesh.materials.append(None)
        shown = bpy.data.objects.new(f"object-{number}", mesh)
        shown.material_slots[0].link = "OBJECT"
        shown.material_slots[0].material = materials[instance["material"]]
        # Shadow rays start at the surface that is seen, not at a smoothed one.
        shown.cycles.shadow_terminator_geometry_offset = 0
        shown.cycles.shadow_terminator_offset = 0
        scene.collection.objects.link(shown)
        objects.append(shown)
    return objects


class Sky:
    """The world: a lat-long map behind a rotation."""

    def __init__(self, scene, folder, placed, fault):
        self.folder, self.placed, self.fault = folder, placed, fault
        world = scene.world = bpy.data.worlds.new("sky")
        world.use_nodes = True
        nodes, links = world.node_tree.nodes, world.node_tree.links
        nodes.clear()
        coordinates, self.turn = nodes.new("ShaderNodeTexCoord"), nodes.new("ShaderNodeMapping")
        self.texture, background = nodes.new("ShaderNodeTexEnvironment"), nodes.new("ShaderNodeBackground")
        self.turn.vector_type = "POINT"
        self.texture.projection = "EQUIRECTANGULAR"
        self.texture.interpolation = "Linear" if placed["bilinear"] else "Closest"
        links.new(coordinates.outputs["Generated"], self.turn.inputs["Vector"])
        links.new(self.turn.outputs["Vector"], self.texture.inputs["Vector"])
        links.new(self.texture.outputs["Color"], background.inputs["Color"])
        links.new(background.outputs["Background"], nodes.new("ShaderNodeOutputWorld").inputs["Surface"])
        self.world = world

    def show(self, frame):
        before = self.texture.image
        name = self.placed["maps"][frame["map"]]
        if before is None or before.name != name:
            image = bpy.data.images.load(str(self.folder / name))
            image.name = name
            image.colorspace_settings.name = "Linear"
            self.texture.image = image
            # 4096 columns at least: with those of the map, the bilinear edge of a sun lies in texels of low density.
            self.world.cycles.sampling_method = "AUTOMATIC"
            if before is not None:
                bpy.data.images.remove(before)
        x, y, z = conventions.map_euler(frame["rotation"])
        self.turn.inputs["Rotation"].default_value = (x, y, z + (math.radians(0.25) if self.fault == "turn" else 0))
        self.turn.inputs["Scale"].default_value = (1, -1 if self.fault == "mirror" else 1, 1)


def make_camera(scene):
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    scene.collection.objects.link(camera)
    scene.camera = camera
    data = camera.data
    data.sensor_fit, data.sensor_height = "VERTICAL", conventions.SENSOR_MM
    data.clip_start, data.clip_end = 1e-3, 1e6
    return camera


def place(shown, matrix, name):
    """Sets where an object is; Blender keeps a turn and three scales, which not every matrix is."""
    wanted = Matrix(matrix)
    shown.matrix_world = wanted
    bpy.context.view_layer.update()
    largest = max(abs(value) for row in wanted for value in row)
    if any(abs(a - b) > 1e-5 * largest for got, want in zip(shown.matrix_world, wanted) for a, b in zip(got, want)):
        raise SystemExit(f"{name}: a sheared object, which is not compared")


def main():
    options = parse_arguments()
    placed = json.loads((options.placed / "scene.json").read_text(encoding="utf-8"))
    for collection in (bpy.data.objects, bpy.data.meshes, bpy.data.cameras, bpy.data.lights):
        for item in list(collection):
            collection.remove(item)
    scene = bpy.context.scene
    set_picture(scene, placed)
    cycles_settings.set_light(scene, options, placed["bounces"])
    objects = make_objects(scene, options.placed, placed)
    sky, camera = Sky(scene, options.placed, placed, options.fault), make_camera(scene)

    for frame in placed["frames"][::options.every]:
        scene.frame_set(frame["number"])
        for number, matrix in enumerate(frame["instances"]):
            place(objects[number], conventions.object_matrix(matrix), f"frame {frame['number']}, object {number}")
        place(camera, conventions.camera_matrix(frame["camera"]), "camera")
        camera.data.lens = conventions.lens_mm(frame["camera"]["verticalFovDeg"])
        # Blender's shift is a share of the longer side.
        camera.data.shift_x = 0.1 / max(placed["width"], placed["height"]) if options.fault == "shift" else 0
        sky.show(frame)
        scene.render.filepath = str(options.out / frame["file"])
        bpy.ops.render.render(write_still=True)
        print(f"CPU seconds: {sum(os.times()[:2]):.2f}", flush=True)


if __name__ == "__main__":
    main()

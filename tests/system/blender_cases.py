"""Run by Blender: makes small files and exports each, all in one process.

blender -b --factory-startup -P blender_cases.py -- EXPORTER OUT

EXPORTER: folder of the package baton_exporter. OUT gets a folder a case with its job, and cases.json: for each case the
report, and what it must say (nothing where all is carried over)."""

import json
import math
import struct
import sys
from pathlib import Path

import bpy

sys.dont_write_bytecode = True
EXPORTER, OUT = (Path(text) for text in sys.argv[sys.argv.index("--") + 1:])
sys.path.insert(0, str(EXPORTER))
from baton_exporter import exr, job  # noqa: E402

CASES = []


class Stage:
    """A file with a camera, a plane "floor", a ball with an own material, and an image as world."""

    def __init__(self, folder):
        self.folder = folder
        bpy.ops.wm.read_factory_settings(use_empty=True)
        scene = self.scene = bpy.context.scene
        scene.render.engine, scene.frame_start, scene.frame_end = "CYCLES", 1, 4
        scene.render.resolution_x, scene.render.resolution_y = 96, 54
        scene.render.image_settings.file_format = "OPEN_EXR"
        self.camera = self.add("camera", bpy.data.cameras.new("camera"))
        self.camera.location, self.camera.rotation_euler.x, scene.camera = (0, -6, 2), math.radians(75), self.camera
        bpy.ops.mesh.primitive_plane_add(size=10)
        bpy.context.object.name = "floor"
        bpy.ops.mesh.primitive_uv_sphere_add(segments=8, ring_count=6, location=(0, 0, 1))
        self.ball = bpy.context.object
        self.ball.name = "ball"
        self.material = bpy.data.materials.new("paint")
        self.material.use_nodes = True
        self.ball.data.materials.append(self.material)
        self.surface = self.material.node_tree.nodes["Principled BSDF"].inputs
        self.world = scene.world = bpy.data.worlds.new("sky")
        self.world.use_nodes = True
        self.background = self.world.node_tree.nodes["Background"]
        self.sky = self.environment(self.background, "sky.0001.exr")

    def add(self, name, data):
        item = bpy.data.objects.new(name, data)
        self.scene.collection.objects.link(item)
        return item

    def mesh(self, name, places, faces):
        data = bpy.data.meshes.new(name)
        data.from_pydata(places, [], faces)
        return self.add(name, data)

    def exr(self, name, value=2.0):
        exr.write(self.folder / name, 8, 4, [struct.pack("<24f", *[value] * 24)] * 4)
        return bpy.data.images.load(str(self.folder / name))

    def environment(self, background, name):
        texture = self.world.node_tree.nodes.new("ShaderNodeTexEnvironment")
        texture.image = self.exr(name)
        self.world.node_tree.links.new(texture.outputs[0], background.inputs["Color"])
        return texture

    def seen_by_camera(self):
        """Another Background, by Is Camera Ray."""
        tree = self.world.node_tree
        seen, mix, path = (tree.nodes.new(f"ShaderNode{kind}") for kind in ("Background", "MixShader", "LightPath"))
        for given, socket in ((path.outputs["Is Camera Ray"], mix.inputs[0]), (self.background.outputs[0], mix.inputs[1]),
                              (seen.outputs[0], mix.inputs[2]), (mix.outputs[0], tree.nodes["World Output"].inputs[0])):
            tree.links.new(given, socket)
        return seen

    def texture(self, image=None, name="Base Color", uv_map=None, material=None):
        tree = (material or self.material).node_tree
        node = tree.nodes.new("ShaderNodeTexImage")
        node.image = image or bpy.data.images.new("chart", 8, 8)
        tree.links.new(node.outputs["Color"], tree.nodes["Principled BSDF"].inputs[name])
        if uv_map:
            chosen = tree.nodes.new("ShaderNodeUVMap")
            chosen.uv_map = uv_map
            tree.links.new(chosen.outputs[0], node.inputs["Vector"])
        return node

    def modify_by_nodes(self, *kinds):
        """Geometry nodes that join what each kind makes of the mesh; None: the mesh itself."""
        tree = self.ball.modifiers.new("nodes", "NODES").node_group = bpy.data.node_groups.new("nodes", "GeometryNodeTree")
        start, end, join = (tree.nodes.new(kind) for kind in ("NodeGroupInput", "NodeGroupOutput", "GeometryNodeJoinGeometry"))
        tree.inputs.new("NodeSocketGeometry", "Geometry")
        tree.outputs.new("NodeSocketGeometry", "Geometry")
        tree.links.new(join.outputs[0], end.inputs[0])
        for kind in kinds:
            made = start
            if kind:
                made = tree.nodes.new(kind)
                tree.links.new(start.outputs[0], made.inputs[0])
            tree.links.new(made.outputs[0], join.inputs[0])


def keyed(owner, name, values, index=-1):
    """values: by frame."""
    for frame, value in values.items():
        if index < 0:
            setattr(owner, name, value)
        else:
            getattr(owner, name)[index] = value
        owner.keyframe_insert(name, frame=frame, index=index)


def case(*expected):
    """Registers a function that changes a stage. expected: what the lines of the report must say."""
    def register(build):
        CASES.append((build, expected))
        return build
    return register


@case()
def strength_from_zero(stage):
    keyed(stage.background.inputs["Strength"], "default_value", {1: 0, 3: 1})


@case()
def scale_from_zero(stage):
    keyed(stage.ball, "scale", {1: (0, 0, 0), 3: (1, 1, 1)})


@case()
def third_uv_map(stage):
    for name in ("second", "third"):
        stage.ball.data.uv_layers.new(name=name)
    stage.texture(uv_map="third")


@case()
def uv_maps_in_another_order(stage):
    other = bpy.data.materials.new("other")
    other.use_nodes = True
    stage.texture(uv_map="a")
    stage.texture(uv_map="b", name="Roughness").image.colorspace_settings.name = "Non-Color"
    stage.texture(uv_map="c", material=other)
    for x, order in ((-2, "cab"), (2, "bca")):
        item = stage.mesh(f"sheet {order}", [(x, -1, 0), (x + 1, -1, 0), (x + 1, -1, 2), (x, -1, 2)], [(0, 1, 2), (0, 2, 3)])
        for slot, material in enumerate((stage.material, other)):
            item.data.materials.append(material)
            item.data.polygons[slot].material_index = slot
        for name in order:
            for corner in item.data.uv_layers.new(name=name).data:
                corner.uv = ("abc".index(name) / 4, 0.5)
    stage.ball.hide_render = True


@case(": two are read, and ")
def three_uv_maps(stage):
    for name, socket in (("a", "Base Color"), ("b", "Roughness"), ("c", "Clearcoat")):
        stage.ball.data.uv_layers.new(name=name)
        image = stage.texture(uv_map=name, name=socket).image
        image.colorspace_settings.name = "sRGB" if name == "a" else "Non-Color"


@case('material "paint": Roughness has other coordinates than Metallic')
def metal_and_roughness_apart(stage):
    for name, socket in (("a", "Metallic"), ("b", "Roughness")):
        stage.ball.data.uv_layers.new(name=name)
        stage.texture(uv_map=name, name=socket).image.colorspace_settings.name = "Non-Color"


@case('object "ball": it has no UV map, which material "paint" reads')
def no_uv_map(stage):
    stage.ball.data.uv_layers.remove(stage.ball.data.uv_layers[0])
    stage.texture()


@case('object "ball": it has no UV map "none", which material "paint" reads')
def unknown_uv_map(stage):
    stage.texture(uv_map="none")


@case('object "line": its faces have no area')
def faces_without_area(stage):
    stage.mesh("line", [(0, 0, 0), (1, 0, 0), (2, 0, 0)], [(0, 1, 2)])


@case()
def a_material_without_area(stage):
    item = stage.mesh("sheet", [(0, -1, 0), (1, -1, 0), (2, -1, 0), (2, -1, 1)], [(0, 1, 2), (0, 2, 3)])
    item.data.materials.append(stage.material)
    item.data.materials.append(bpy.data.materials.new("nothing"))
    item.data.materials[1].use_nodes = True
    item.data.polygons[0].material_index = 1


def shown_later(stage, playhead):
    keyed(stage.ball, "hide_render", {1: True, 3: False})
    stage.scene.frame_set(playhead)


@case('object "ball": it is not there, or has no faces, in some frames')
def hidden_with_the_playhead_before(stage):
    shown_later(stage, 1)


@case('object "ball": it is not there, or has no faces, in some frames')
def hidden_with_the_playhead_behind(stage):
    shown_later(stage, 4)


@case()
def hidden_in_the_viewport(stage):
    keyed(stage.ball, "hide_viewport", {1: True, 3: False})


@case('light "lamp": a point lamp')
def lamp_that_goes_on(stage):
    keyed(stage.add("lamp", bpy.data.lights.new("lamp", "POINT")), "hide_render", {1: True, 3: False})
    stage.scene.frame_set(1)


@case('object "ball": it is not there, or has no faces, in some frames', 'object "ball": its vertices are others')
def faces_that_come_later(stage):
    build = stage.ball.modifiers.new("build", "BUILD")
    build.frame_start, build.frame_duration = 1, 4


@case('object "ball": points that its geometry nodes make')
def points_for_a_mesh(stage):
    stage.modify_by_nodes("GeometryNodeMeshToPoints")


@case('object "ball": points that its geometry nodes make', 'object "ball": a volume that its geometry nodes make')
def points_and_a_volume_beside_a_mesh(stage):
    stage.modify_by_nodes(None, "GeometryNodeMeshToPoints", "GeometryNodeMeshToVolume")


@case('world "sky": it is hidden from glossy rays')
def world_hidden_from_rays(stage):
    stage.world.cycles_visibility.camera = stage.world.cycles_visibility.glossy = False


@case('material "paint": image "gone" cannot be read')
def missing_image(stage):
    image = stage.exr("gone.exr")
    image.name, image.filepath = "gone", "/nowhere/gone.png"
    image.reload()
    stage.texture(image)


@case('world "sky": its image sky.0005.exr is not there')
def sequence_with_a_keyed_offset(stage):
    for number in (2, 3, 4):
        stage.exr(f"sky.{number:04}.exr", number)
    stage.sky.image.source, user = "SEQUENCE", stage.sky.image_user
    user.frame_duration, user.use_cyclic = 4, True
    keyed(user, "frame_offset", {1: 0, 2: 1, 4: 1})


@case('material "paint": image "skin.0001.exr" changes', 'material "paint": image "skin.0001.exr" becomes a PNG')
def sequence_on_a_material(stage):
    image = stage.exr("skin.0001.exr")
    image.source = "SEQUENCE"
    stage.texture(image)


@case('"chart" of colour space Non-Color (Base Color of Principled BSDF): it is read as sRGB')
def color_that_is_not_color(stage):
    stage.texture().image.colorspace_settings.name = "Non-Color"


@case('"chart" of colour space sRGB (Roughness of Principled BSDF): it is read as Non-Color',
      '"chart.001" of colour space sRGB (Metallic of Principled BSDF): it is read as Non-Color')
def numbers_that_are_colors(stage):
    stage.texture(name="Roughness")
    stage.texture(name="Metallic")


@case()
def camera_sees_an_image(stage):
    seen = stage.seen_by_camera()
    stage.environment(seen, "seen.exr")
    seen.inputs["Strength"].default_value = 0.5


@case('world "sky": node "Background.001", which the camera alone sees: it sees the light of "Background"')
def camera_sees_what_changes(stage):
    keyed(stage.seen_by_camera().inputs["Strength"], "default_value", {1: 0, 3: 1})


@case()
def camera_sees_no_world(stage):
    keyed(stage.seen_by_camera().inputs["Strength"], "default_value", {1: 0, 3: 1})
    stage.scene.render.film_transparent = True


@case('material "paint": image "skin" of tiles (UDIM)')
def tiles(stage):
    stage.texture(bpy.data.images.new("skin", 8, 8, tiled=True))


@case("Blender's glTF exporter failed: ValueError: planted")
def failing_gltf_exporter(_stage):
    from io_scene_gltf2.blender.exp import gltf2_blender_export

    def fail(*_):
        raise ValueError("planted")
    gltf2_blender_export.save = fail


@case()
def submits_of_one_file(stage):
    """By the add-on, whose `baton` here only notes what it is given."""
    program = stage.folder / "baton"
    program.write_text(f'#!/bin/sh\necho "$3" >> "{stage.folder}/submitted"\n', encoding="ascii")
    program.chmod(0o755)
    bpy.ops.preferences.addon_enable(module="baton_exporter")
    chosen = bpy.context.preferences.addons["baton_exporter"].preferences
    chosen.program, chosen.folder = str(program), str(stage.folder / "jobs")
    for _ in range(2):
        bpy.ops.render.submit_to_baton()


def main():
    told = {}
    # What breaks the exporter for good comes last.
    for build, expected in sorted(CASES, key=lambda entry: entry[0] is failing_gltf_exporter):
        folder = OUT / build.__name__
        folder.mkdir(parents=True)
        stage = Stage(folder)
        build(stage)
        try:
            report = job.export(folder / "job").text()
        except Exception as fault:  # told, so that the other cases run
            report = f"{fault}\n"
        told[build.__name__] = {"report": report, "expected": expected}
    (OUT / "cases.json").write_text(json.dumps(told, indent=1), encoding="utf-8")


main()

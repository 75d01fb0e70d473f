"""Run by Blender: makes small files and exports each, all in one process.

blender -b --factory-startup -P blender_cases.py -- EXPORTER OUT

EXPORTER: folder of the package baton_exporter. OUT gets a folder a case with its job, and cases.json: for each case the
report, and what it must say (nothing where all is carried over)."""

import json
import sys
from pathlib import Path

import bpy

sys.dont_write_bytecode = True
EXPORTER, OUT = (Path(text) for text in sys.argv[sys.argv.index("--") + 1:])
sys.path[:0] = [str(EXPORTER), str(Path(__file__).resolve().parent)]
from baton_exporter import job  # noqa: E402
from blender_stage import Stage, keyed  # noqa: E402

CASES = []


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


@case("2 bounces of one kind of light: 4 of all are taken")
def bounces_that_differ(stage):
    stage.scene.cycles.diffuse_bounces = 2


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

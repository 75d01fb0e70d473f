"""A Blender file as a Baton job: one folder, a report; runs inside Blender, in a process of its own, whose scene it changes.

export() is all that the command line and the add-on use."""

import json
import re
import shutil
from pathlib import Path

import bpy

from . import checks, conventions, evaluation, geometry, gltf_file, keys, uv_maps
from .camera import Camera, number, picture_size
from .materials import Materials, used_materials
from .report import Report
from .world import World

FILTERS = {"BOX": "box", "GAUSSIAN": "gaussian", "BLACKMAN_HARRIS": "blackman-harris"}
SITES, MOST_BOUNCES = 4, 64


class CannotExport(Exception):
    """What a file must have to become a job."""


def export(folder, strict=False, frames=None):
    """Writes the job of the open file into the folder; the report. Strict: nothing where something would be lost.

    frames: a text as in a job; those of the scene without it."""
    scene, report = bpy.context.scene, Report()
    text, numbers = frames_of(scene, frames)
    if scene.camera is None:
        raise CannotExport("the scene has no camera: expected one (Scene Properties > Camera)")
    view_layer = next((layer for layer in scene.view_layers if layer.use), scene.view_layers[0])
    bpy.context.window.view_layer = view_layer
    fps = scene.render.fps / scene.render.fps_base
    checks.check_scene(scene, view_layer, report)
    image, output, light = image_of(scene), output_of(scene, fps), light_of(scene)

    # Evaluate each frame once.
    shapes, camera, world = geometry.Geometry(report), Camera(scene, report), World(scene, report)

    def take(depsgraph):
        for part in (shapes, camera, world):
            part.take(depsgraph)

    evaluation.take_frames(scene, view_layer, numbers, take)
    shapes.finish()
    checks.check_objects(shapes.objects, scene, report)
    if not shapes.shapes:
        raise CannotExport("the scene shows no surface: expected a mesh that is rendered")
    materials = Materials(report)
    materials.check(used_materials(shapes))
    uv_maps.lay_out(shapes.shapes.values(), report)

    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    clear(folder)
    job = {"specificationVersion": 1, "name": job_name(), "frames": text, "image": image}
    job["camera"] = camera.job(numbers)
    job["scene"] = {"gltf": {"file": "scene.glb", "fps": number(fps)}}
    job["environment"] = world.job(folder, numbers)
    if "keys" in job["camera"]:
        job["motion"] = {"curve": "linear"}
    if light:
        job["light"] = light
    job["output"] = output
    if not (strict and report.entries):
        try:
            own, nodes = gltf_file.write(folder / "scene.glb", shapes, numbers, fps, materials.diffuse, report)
        except gltf_file.ExporterFailed:
            clear(folder)
            raise
        if own:
            job["scene"]["materials"] = own
        if nodes:
            job["scene"]["gltf"]["nodes"] = nodes
    if not (strict and report.entries):
        (folder / "job.json").write_text(json.dumps(job, indent=2) + "\n", encoding="utf-8")
    else:
        clear(folder)
    (folder / "report.txt").write_text(report.text(), encoding="utf-8")
    return report


def clear(folder):
    """Removes what an export has written."""
    for old in [folder / "job.json", folder / "scene.glb", folder / "report.txt", *folder.glob("sky.*"),
                *folder.glob("backdrop.*")]:
        old.unlink(missing_ok=True)
    shutil.rmtree(folder / "sky", ignore_errors=True)


def frames_of(scene, wanted):
    """Text and numbers."""
    text = wanted or keys.frame_text(scene.frame_start, scene.frame_end, scene.frame_step)
    try:
        return text, keys.parse_frames(text)
    except ValueError as fault:
        raise CannotExport(str(fault)) from None


def job_name():
    """The file's name as far as a job may have it."""
    name = Path(bpy.data.filepath).stem or "untitled"
    return re.sub(r"[/\s]", "-", name).lstrip(".")[:100] or "untitled"


def image_of(scene):
    width, height = picture_size(scene)
    image = {"width": width, "height": height, "sites": SITES}
    render = scene.render
    if render.use_border:
        image["region"] = conventions.region(width, height, render.border_min_x, render.border_max_x,
                                             render.border_min_y, render.border_max_y)
    kind = FILTERS[scene.cycles.pixel_filter_type] if render.engine == "CYCLES" else "blackman-harris"
    if kind != "box":
        image["filter"] = kind
    return image


def light_of(scene):
    """Of a file for Cycles as many surfaces as the kind of light that meets most; check_cycles reports what has fewer."""
    if scene.render.engine != "CYCLES":
        return None
    cycles = scene.cycles
    most = min(cycles.max_bounces, max(cycles.diffuse_bounces, cycles.glossy_bounces), MOST_BOUNCES)
    return {"bounces": most, "filterGlossy": cycles.blur_glossy > 0}


def output_of(scene, fps):
    output = {"framesPerSecond": number(fps)}
    if scene.render.film_transparent:
        output["background"] = "transparent"
    image = scene.render.image_settings
    if image.file_format in ("OPEN_EXR", "OPEN_EXR_MULTILAYER") and image.color_depth == "32":
        output["pixelType"] = "float"
    return output

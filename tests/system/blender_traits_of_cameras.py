"""Traits of cameras and of the picture."""

import math

from blender_stage import keyed
from blender_trait import trait


@trait("camera")
def lens(stage, draw):
    data = stage.camera.data
    data.lens, data.sensor_fit = draw.uniform(28, 60), draw.choice(("AUTO", "HORIZONTAL", "VERTICAL"))
    data.shift_x, data.shift_y = draw.uniform(-0.1, 0.1), draw.uniform(-0.1, 0.1)
    if draw.random() < 0.4:
        data.sensor_width, data.sensor_height = 24, 32


@trait("camera")
def orthographic(stage, draw):
    stage.camera.data.type, stage.camera.data.ortho_scale = "ORTHO", draw.uniform(4, 7)
    stage.camera.data.shift_x = draw.choice((0, 0.1))


@trait("camera")
def panorama(stage, _draw):
    stage.camera.data.type = "PANO"


@trait("camera")
def axes(stage, draw):
    """By parents that scale: mirrored, sheared, or only smaller."""
    rig = stage.add("rig", None)
    rig.scale = draw.choice(((0.5, 0.5, 0.5), (-1, 1, 1), (1, 1, -1), (1, 2, 1), (1, 1, 1.6)))
    stage.camera.rotation_euler.y = draw.choice((0, 0.2))
    stage.camera.parent = rig
    stage.camera.location = [a / b for a, b in zip(stage.camera.location, rig.scale)]


@trait("camera")
def own_scale(stage, draw):
    stage.camera.scale = draw.choice(((3, 3, 3), (-1, 1, 1), (1, -1, 1), (1, 1, -1), (-1, -1, 1), (2, 1, 1)))


@trait("camera")
def depth_of_field(stage, draw):
    dof = stage.camera.data.dof
    dof.use_dof, dof.focus_distance, dof.aperture_fstop = True, draw.uniform(3, 8), draw.choice((0.1, 0.3))
    dof.aperture_blades = draw.choice((0, 0, 5))


@trait("camera")
def zoom(stage, draw):
    """With a fixed f-stop or without depth of field."""
    stage.scene.frame_end = 3
    keyed(stage.camera.data, "lens", {1: 30, 3: 60})
    dof = stage.camera.data.dof
    dof.use_dof, dof.focus_distance, dof.aperture_fstop = draw.random() < 0.7, 4, 0.1


@trait("camera")
def travels(stage, draw):
    stage.scene.frame_end = 3
    keyed(stage.camera, "location", {1: (0, -6, 2), 3: (1, -5, 2.5)})
    if draw.random() < 0.4:
        keyed(stage.camera.data, draw.choice(("shift_x", "clip_start")), {1: 0.1, 3: 0.2})


@trait("camera")
def clipping(stage, draw):
    data = stage.camera.data
    if draw.random() < 0.5:
        data.clip_end = 6.5
    else:
        data.clip_start = 5.5


@trait("picture")
def size(stage, draw):
    render = stage.scene.render
    render.resolution_x, render.resolution_y, render.resolution_percentage = draw.choice(((97, 61, 66), (40, 70, 100), (128, 80, 50)))
    render.pixel_aspect_x = draw.choice((1, 1, 1.5))


@trait("picture")
def border(stage, draw):
    render = stage.scene.render
    render.use_border, render.use_crop_to_border = True, draw.random() < 0.5
    render.border_min_x, render.border_max_x, render.border_min_y, render.border_max_y = 0.21, 0.8, 0.15, 0.95


@trait("picture")
def pixel_filter(stage, draw):
    stage.scene.cycles.pixel_filter_type = draw.choice(("BLACKMAN_HARRIS", "GAUSSIAN"))
    stage.scene.cycles.filter_width = draw.choice((1.5, 1.5, 4))


@trait("picture")
def rendered_otherwise(stage, draw):
    kind = draw.choice(("blur", "override", "layers", "markers", "remap"))
    render, layer = stage.scene.render, stage.scene.view_layers[0]
    if kind == "override":
        layer.material_override = stage.diffuse("override", (0.1, 0.6, 0.1))
    elif kind == "blur":
        render.use_motion_blur, stage.scene.frame_end = True, 2
        keyed(stage.post, "location", {0: (0, 0, 1), 3: (3, 0, 1)})
    elif kind == "layers":
        stage.scene.view_layers.new("second").use = draw.random() < 0.5
    elif kind == "markers":
        other = stage.add("other", stage.camera.data)
        other.location, other.rotation_euler = (3, -5, 3), (math.radians(60), 0, 0.5)
        stage.scene.timeline_markers.new("cut", frame=1).camera = other
    else:
        render.frame_map_old, render.frame_map_new, stage.scene.frame_end = 100, 200, 2
        keyed(stage.post, "location", {1: (0, 0, 1), 3: (2, 0, 1)})

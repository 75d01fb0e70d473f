"""Writes five Blender files that use what the exporter carries over:

blender -b --factory-startup -P make_blend_files.py -- FOLDER

turntable.blend: a turning parent with a figure, a textured box and instances; shift, depth of field, a packed map.
keyed_camera.blend: a camera on a turning arm, with a Track To constraint, keyed focal length, a border; a tilted
map, a pane that blends.
lacquer.blend: coats over metal, smooth and rough, of constants and of images; the two model coats differently.
bending.blend: a stalk on the bones of an armature, a ball with a shape key, a sheet with waves, and a turning parent of all.
hdr_sequence.blend: an image sequence with an offset, a turning and brightening world; an orthographic camera.
The maps come with Blender. All other surfaces are diffuse or metal, where Cycles and Baton model the same.
"""

import math
import sys
from pathlib import Path

import bpy
import numpy

sys.dont_write_bytecode = True
sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "exporters/blender"))
from baton_exporter import exr  # noqa: E402

MAPS = Path(bpy.utils.resource_path("SYSTEM")) / "datafiles/studiolights/world"


def new_file(name, width, height, first, last, fps):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.name = name
    scene.render.engine = "CYCLES"
    scene.render.resolution_x, scene.render.resolution_y = width, height
    scene.frame_start, scene.frame_end, scene.render.fps = first, last, fps
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.cycles.pixel_filter_type = "BOX"
    return scene


def link(item):
    bpy.context.scene.collection.objects.link(item)
    return item


def empty(name, location=(0, 0, 0), parent=None):
    item = link(bpy.data.objects.new(name, None))
    item.location, item.parent = location, parent
    return item


def shape(name, material, location=(0, 0, 0), parent=None):
    """What an operator has just made."""
    item = bpy.context.object
    item.name, item.location, item.parent = name, location, parent
    item.data.materials.append(material)
    # Shadow rays start at the surface that is seen, as in Baton.
    item.cycles.shadow_terminator_geometry_offset = 0
    item.cycles.shadow_terminator_offset = 0
    return item


def linear_keys(owner):
    for curve in owner.animation_data.action.fcurves:
        for point in curve.keyframe_points:
            point.interpolation = "LINEAR"


def diffuse(name, color, image=None):
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    surface = tree.nodes.new("ShaderNodeBsdfDiffuse")
    surface.inputs["Color"].default_value = (*color, 1)
    if image:
        texture = tree.nodes.new("ShaderNodeTexImage")
        # Between texels Cycles mixes sRGB values, Baton light.
        texture.image, texture.interpolation = image, "Closest"
        tree.links.new(texture.outputs["Color"], surface.inputs["Color"])
    tree.links.new(surface.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    return material


def metal(name, color, roughness):
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    inputs = material.node_tree.nodes["Principled BSDF"].inputs
    inputs["Base Color"].default_value = (*color, 1)
    inputs["Metallic"].default_value, inputs["Roughness"].default_value = 1, roughness
    return material


def lacquered(name, color, clearcoat, roughness, image=None):
    """A coat on metal; image: red is its strength, green its roughness."""
    material = metal(name, color, 0.4)
    tree = material.node_tree
    inputs = tree.nodes["Principled BSDF"].inputs
    inputs["Clearcoat"].default_value, inputs["Clearcoat Roughness"].default_value = clearcoat, roughness
    if image:
        texture, parts = tree.nodes.new("ShaderNodeTexImage"), tree.nodes.new("ShaderNodeSeparateColor")
        texture.image, texture.interpolation = image, "Closest"
        tree.links.new(texture.outputs["Color"], parts.inputs["Color"])
        tree.links.new(parts.outputs["Red"], inputs["Clearcoat"])
        tree.links.new(parts.outputs["Green"], inputs["Clearcoat Roughness"])
    return material


def chart():
    """A packed image in which every direction looks different."""
    size = 64
    v, u = numpy.mgrid[0:size, 0:size] / (size - 1)
    pixels = numpy.ones((size, size, 4))
    pixels[..., 0], pixels[..., 1], pixels[..., 2] = u, v, 0.3
    pixels[(u * 8 % 2 < 1) ^ (v * 4 % 2 < 1)] *= (0.4, 0.4, 0.4, 1)
    image = bpy.data.images.new("chart", size, size)
    image.pixels.foreach_set(pixels.astype(numpy.float32).ravel())
    image.pack()
    return image


def world(image, vector_type="POINT"):
    """Environment Texture behind a Mapping node; texture, mapping and background."""
    made = bpy.context.scene.world = bpy.data.worlds.new("sky")
    made.use_nodes = True
    tree = made.node_tree
    background = tree.nodes["Background"]
    texture, mapping = tree.nodes.new("ShaderNodeTexEnvironment"), tree.nodes.new("ShaderNodeMapping")
    coordinates = tree.nodes.new("ShaderNodeTexCoord")
    texture.image, mapping.vector_type = image, vector_type
    tree.links.new(coordinates.outputs["Generated"], mapping.inputs["Vector"])
    tree.links.new(mapping.outputs["Vector"], texture.inputs["Vector"])
    tree.links.new(texture.outputs["Color"], background.inputs["Color"])
    return texture, mapping, background


def load_map(name):
    image = bpy.data.images.load(str(MAPS / name))
    image.colorspace_settings.name = "Linear"
    return image


def camera(location, **values):
    data = bpy.data.cameras.new("camera")
    for name, value in values.items():
        setattr(data, name, value)
    item = link(bpy.data.objects.new("camera", data))
    item.location = location
    bpy.context.scene.camera = item
    return item


def track(item, target):
    constraint = item.constraints.new("TRACK_TO")
    constraint.target, constraint.track_axis, constraint.up_axis = target, "TRACK_NEGATIVE_Z", "UP_Y"


def add_floor(material):
    bpy.ops.mesh.primitive_plane_add(size=12)
    return shape("floor", material)


def save(folder, name):
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / name), compress=True)


def make_turntable(folder):
    scene = new_file("turntable", 640, 360, 1, 24, 24)
    scene.render.resolution_percentage = 50
    table = empty("table")
    for frame, turned in ((1, 0), (25, 360)):
        table.rotation_euler.z = math.radians(turned)
        table.keyframe_insert("rotation_euler", frame=frame)
    linear_keys(table)

    add_floor(diffuse("floor", (0.5, 0.48, 0.45)))
    bpy.ops.mesh.primitive_monkey_add(size=1.4)
    figure = shape("figure", diffuse("clay", (0.6, 0.3, 0.2)), (0, 0.4, 0.9), table)
    figure.modifiers.new("smooth", "SUBSURF").render_levels = 2
    bpy.ops.object.shade_smooth()
    bpy.ops.mesh.primitive_cube_add(size=0.8)
    box = shape("box", diffuse("chart", (1, 1, 1), chart()), (1.2, -0.3, 0.4), table)
    box.data.materials.append(diffuse("lid", (0.1, 0.2, 0.6)))
    max(box.data.polygons, key=lambda face: face.center.z).material_index = 1

    # A collection that is shown by instances alone.
    cones = bpy.data.collections.new("cones")
    bpy.ops.mesh.primitive_cone_add(radius1=0.2, depth=0.5)
    cone = shape("cone", diffuse("green", (0.2, 0.5, 0.2)), (0, 0, 0.25))
    scene.collection.objects.unlink(cone)
    cones.objects.link(cone)
    for i in range(5):
        angle = math.radians(72 * i)
        item = empty(f"cone {i}", (2 * math.cos(angle), 2 * math.sin(angle), 0), table)
        item.instance_type, item.instance_collection, item.scale.z = "COLLECTION", cones, 1 + 0.2 * i

    shown = camera((0, -7, 3), lens=50, shift_x=0.08, shift_y=-0.05)
    track(shown, empty("aim", (0, 0, 0.7)))
    shown.data.dof.use_dof, shown.data.dof.focus_object, shown.data.dof.aperture_fstop = True, figure, 0.2
    image = load_map("courtyard.exr")
    image.pack()
    _, mapping, background = world(image)
    mapping.inputs["Rotation"].default_value[2] = math.radians(40)
    background.inputs["Strength"].default_value = 1.5
    save(folder, "turntable.blend")


def make_keyed_camera(folder):
    scene = new_file("keyed camera", 300, 360, 11, 34, 25)
    add_floor(diffuse("floor", (0.5, 0.48, 0.45)))
    bpy.ops.mesh.primitive_torus_add(major_radius=0.8, minor_radius=0.3, major_segments=64, minor_segments=24)
    ring = shape("ring", metal("steel", (0.8, 0.8, 0.85), 0.4), (0, 0, 0.9))
    bpy.ops.object.shade_smooth()
    # A driver turns the ring; its parent is scaled.
    ring.parent = empty("stand")
    ring.parent.scale = (1.2, 1.2, 1.2)
    driver = ring.driver_add("rotation_euler", 0).driver
    driver.expression = "frame * 0.05"
    bpy.ops.mesh.primitive_cube_add(size=0.9)
    shape("box", diffuse("chart", (1, 1, 1), chart()), (-1.3, 0.5, 0.45))
    # A pane that lets more than half of the light pass.
    bpy.ops.mesh.primitive_plane_add(size=1.2, rotation=(math.radians(80), 0, math.radians(30)))
    pane = shape("pane", metal("gauze", (0.9, 0.8, 0.6), 0.5), (1.1, -0.4, 0.7))
    pane.active_material.blend_method = "BLEND"
    pane.active_material.node_tree.nodes["Principled BSDF"].inputs["Alpha"].default_value = 0.4

    arm = empty("arm")
    for frame, turned in ((11, -30), (34, 50)):
        arm.rotation_euler.z = math.radians(turned)
        arm.keyframe_insert("rotation_euler", frame=frame)
    shown = camera((0, -6, 2.2), sensor_fit="VERTICAL", sensor_height=24)
    shown.parent = arm
    target = empty("aim", (0, 0, 0.6))
    for frame, height in ((11, 0.6), (34, 1.0)):
        target.location.z = height
        target.keyframe_insert("location", frame=frame)
    track(shown, target)
    for frame, lens in ((14, 35), (30, 60)):
        shown.data.lens = lens
        shown.data.keyframe_insert("lens", frame=frame)
    scene.render.use_border, scene.render.use_crop_to_border = True, True
    scene.render.border_min_x, scene.render.border_max_x = 0.1, 0.95
    scene.render.border_min_y, scene.render.border_max_y = 0.2, 0.9

    _, mapping, _ = world(load_map("forest.exr"), "TEXTURE")
    mapping.inputs["Rotation"].default_value = [math.radians(angle) for angle in (20, -10, 75)]
    save(folder, "keyed_camera.blend")


def make_lacquer(folder):
    new_file("lacquer", 360, 200, 1, 1, 24)
    add_floor(diffuse("floor", (0.5, 0.48, 0.45)))
    image = chart()
    image.colorspace_settings.name = "Non-Color"
    red = (0.5, 0.05, 0.04)
    for i, material in enumerate((metal("bare", red, 0.4), lacquered("smooth", red, 1, 0.03), lacquered("rough", red, 1, 0.3),
                                  lacquered("chart", red, 0, 0, image))):
        bpy.ops.mesh.primitive_uv_sphere_add(radius=0.5, segments=64, ring_count=32)
        shape(material.name, material, (1.15 * (i - 1.5), 0, 0.5))
        bpy.ops.object.shade_smooth()
    track(camera((0, -6.5, 2), lens=50), empty("aim", (0, 0, 0.4)))
    world(load_map("sunset.exr"))
    save(folder, "lacquer.blend")


def make_bending(folder):
    scene = new_file("bending", 320, 180, 1, 24, 24)
    add_floor(diffuse("floor", (0.5, 0.48, 0.45)))
    table = empty("table")
    for frame, turned in ((1, -20), (24, 20)):
        table.rotation_euler.z = math.radians(turned)
        table.keyframe_insert("rotation_euler", frame=frame)
    linear_keys(table)

    bpy.ops.object.armature_add()
    rig = bpy.context.object
    rig.name, rig.parent = "rig", table
    bpy.ops.object.mode_set(mode="EDIT")
    first = rig.data.edit_bones[0]
    first.name, first.head, first.tail = "lower", (-1, 0, 0), (-1, 0, 0.9)
    second = rig.data.edit_bones.new("upper")
    second.head, second.tail, second.parent = first.tail, (-1, 0, 1.8), first
    bpy.ops.object.mode_set(mode="POSE")
    for frame, bent in ((1, -40), (12, 50), (24, -30)):
        for bone, share in (("lower", 0.3), ("upper", 1)):
            posed = rig.pose.bones[bone]
            posed.rotation_mode = "XYZ"
            posed.rotation_euler = (math.radians(20 * share), 0, math.radians(bent * share))
            posed.keyframe_insert("rotation_euler", frame=frame)
    bpy.ops.object.mode_set(mode="OBJECT")
    bpy.ops.mesh.primitive_cylinder_add(radius=0.2, depth=1.8, vertices=24)
    stalk = shape("stalk", diffuse("leaf", (0.2, 0.5, 0.2)), (-1, 0, 0.9), rig)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.mesh.subdivide(number_cuts=7)
    bpy.ops.object.mode_set(mode="OBJECT")
    groups = [stalk.vertex_groups.new(name=name) for name in ("lower", "upper")]
    for vertex in stalk.data.vertices:
        share = min(max(vertex.co.z / 0.8 + 0.5, 0), 1)
        groups[0].add([vertex.index], 1 - share, "REPLACE")
        groups[1].add([vertex.index], share, "REPLACE")
    stalk.modifiers.new("rig", "ARMATURE").object = rig
    bpy.ops.object.shade_smooth()
    stalk.data.use_auto_smooth, stalk.data.auto_smooth_angle = True, math.radians(60)

    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.5, segments=48, ring_count=24)
    ball = shape("ball", metal("steel", (0.8, 0.8, 0.85), 0.4), (1.3, -0.4, 0.5), table)
    bpy.ops.object.shade_smooth()
    ball.shape_key_add(name="round")
    flat = ball.shape_key_add(name="flat")
    for point in flat.data:
        point.co = (1.4 * point.co.x, 1.4 * point.co.y, 0.4 * point.co.z)
    for frame, value in ((1, 0), (12, 1), (24, 0.3)):
        flat.value = value
        flat.keyframe_insert("value", frame=frame)

    bpy.ops.mesh.primitive_grid_add(x_subdivisions=40, y_subdivisions=40, size=1.6)
    sheet = shape("sheet", diffuse("clay", (0.6, 0.3, 0.2)), (0.2, 1.2, 0.6), table)
    bpy.ops.object.shade_smooth()
    wave = sheet.modifiers.new("wave", "WAVE")
    wave.height, wave.width, wave.narrowness, wave.time_offset = 0.25, 0.6, 3, -40
    track(camera((0, -6.5, 2.6), lens=50), empty("aim", (0, 0, 0.7)))
    world(load_map("courtyard.exr"))
    save(folder, "bending.blend")


def write_sequence(folder):
    """Eight maps, numbered from 101, in which a sun climbs."""
    folder.mkdir(exist_ok=True)
    height, width = 64, 128
    v, u = numpy.mgrid[0:height, 0:width]
    for i in range(8):
        pixels = numpy.where((v > height / 2)[..., None], (0.1, 0.09, 0.08), (0.25, 0.35, 0.6))
        distance = numpy.hypot(u - (20 + 9 * i), v - (28 - 2.5 * i))
        pixels = pixels + numpy.exp(-(distance / 1.2) ** 2)[..., None] * numpy.array((200, 170 - 10 * i, 100))
        lines = numpy.ascontiguousarray(pixels[..., ::-1].transpose(0, 2, 1), "<f4")
        exr.write(folder / f"sun_{101 + i:04}.exr", width, height, (line.tobytes() for line in lines))


def make_hdr_sequence(folder):
    scene = new_file("hdr sequence", 320, 180, 1, 12, 24)
    scene.render.film_transparent = True
    write_sequence(folder / "sequence")
    add_floor(diffuse("floor", (0.5, 0.48, 0.45)))
    bpy.ops.mesh.primitive_monkey_add(size=1.6)
    shape("figure", diffuse("clay", (0.6, 0.3, 0.2)), (0, 0, 0.8))
    shown = camera((4, -6, 4), type="ORTHO", ortho_scale=6, shift_y=0.05)
    track(shown, empty("aim", (0, 0, 0.6)))

    image = bpy.data.images.load(str(folder / "sequence/sun_0101.exr"))
    image.source = "SEQUENCE"
    image.colorspace_settings.name = "Linear"
    texture, mapping, background = world(image)
    user = texture.image_user
    user.frame_start, user.frame_duration, user.frame_offset = 1, 7, 101
    user.use_auto_refresh = True
    turned, strength = mapping.inputs["Rotation"], background.inputs["Strength"]
    for frame, degrees, factor in ((1, 0, 1.0), (6, 30, 1.6), (12, 140, 0.7)):
        turned.default_value[2] = math.radians(degrees)
        turned.keyframe_insert("default_value", frame=frame)
        strength.default_value = factor
        strength.keyframe_insert("default_value", frame=frame)
    save(folder, "hdr_sequence.blend")


if __name__ == "__main__":
    target = Path(sys.argv[sys.argv.index("--") + 1]).resolve()
    target.mkdir(parents=True, exist_ok=True)
    make_turntable(target)
    make_keyed_camera(target)
    make_lacquer(target)
    make_bending(target)
    make_hdr_sequence(target)

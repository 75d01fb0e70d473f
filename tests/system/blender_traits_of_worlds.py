"""Traits of the world: images with the headers that files have, colour spaces, nodes."""

import math
import struct
import zlib

import bpy
from baton_exporter import exr
from blender_stage import keyed, sky_row
from blender_trait import trait

WIDTH, HEIGHT = 32, 16
AP1 = (0.713, 0.293, 0.165, 0.83, 0.128, 0.044, 0.32168, 0.33767)


def sky_pixels():
    """Rows from above of (r, g, b)."""
    rows = []
    for y in range(HEIGHT):
        row = sky_row(y, 1.0)
        rows.append(list(zip(row[2 * WIDTH:], row[WIDTH:2 * WIDTH], row[:WIDTH])))
    return rows


def show(stage, name, data=None):
    """Loads a file as the sky's image."""
    if data is not None:
        (stage.folder / name).write_bytes(data)
    stage.sky.image = bpy.data.images.load(str(stage.folder / name))
    return stage.sky.image


def rgbe(r, g, b):
    exponent = math.frexp(max(r, g, b))[1]
    return bytes([*(min(int(v * 2.0 ** (8 - exponent)), 255) for v in (r, g, b)), exponent + 128])


def write_radiance(lines, sides="-Y 16 +X 32", rows=None, end="\n"):
    text = end.join(["#?RADIANCE", *lines, "", sides, ""]).encode()
    return text + b"".join(rgbe(*color) for row in rows or sky_pixels() for color in row)


def write_exr(channels, window, display, extra=b""):
    """32-bit scan lines. channels(x, y): values by name; windows: x0, y0, x1, y1, all inside."""
    names = sorted(channels(0, 0))
    listed = b"".join(name.encode() + b"\0" + struct.pack("<iBxxxii", 2, 0, 1, 1) for name in names) + b"\0"
    head = (struct.pack("<2i", 20000630, 2) + exr.attribute("channels", "chlist", listed)
            + exr.attribute("compression", "compression", b"\0") + exr.attribute("dataWindow", "box2i", struct.pack("<4i", *window))
            + exr.attribute("displayWindow", "box2i", struct.pack("<4i", *display)) + extra
            + exr.attribute("lineOrder", "lineOrder", b"\0") + exr.attribute("pixelAspectRatio", "float", struct.pack("<f", 1))
            + exr.attribute("screenWindowCenter", "v2f", bytes(8))
            + exr.attribute("screenWindowWidth", "float", struct.pack("<f", 1)) + b"\0")
    x0, y0, x1, y1 = window
    lines, size = [], 4 * len(names) * (x1 - x0 + 1)
    for y in range(y0, y1 + 1):
        values = [channels(x, y) for x in range(x0, x1 + 1)]
        lines.append(struct.pack("<2i", y, size) + struct.pack(f"<{size // 4}f", *(v[name] for name in names for v in values)))
    first = len(head) + 8 * len(lines)
    return head + struct.pack(f"<{len(lines)}Q", *(first + i * (size + 8) for i in range(len(lines)))) + b"".join(lines)


def color_at(x, y):
    r, g, b = sky_pixels()[y % HEIGHT][x % WIDTH]
    return {"R": r, "G": g, "B": b}


@trait("world")
def hdr_that_says_colors(stage, draw):
    line = draw.choice(("EXPOSURE=2", "COLORCORR=0.5 1 2", "EXPOSURE= 4.0", "PRIMARIES=0.64 0.33 0.21 0.71 0.15 0.06 0.3127 0.329"))
    show(stage, "said.hdr", write_radiance(["FORMAT=32-bit_rle_rgbe", line]))


@trait("world")
def hdr_in_other_order(stage, draw):
    rows = sky_pixels()
    sides, rows = draw.choice((("+Y 16 +X 32", rows[::-1]), ("-Y 16 -X 32", [row[::-1] for row in rows])))
    show(stage, "order.hdr", write_radiance(["FORMAT=32-bit_rle_rgbe"], sides, rows))


@trait("world")
def hdr_of_another_form(stage, draw):
    lines, end = draw.choice(((["FORMAT=32-bit_rle_xyze"], "\n"), (["SOFTWARE=old"], "\n"), (["FORMAT=32-bit_rle_rgbe"], "\r\n"),
                              (["# by hand", "VIEW= -vtl", "GAMMA=1.0", "FORMAT=32-bit_rle_rgbe"], "\n")))
    show(stage, "form.hdr", write_radiance(lines, end=end))


@trait("world")
def exr_that_says_colors(stage, draw):
    said = exr.attribute("chromaticities", "chromaticities", struct.pack("<8f", *draw.choice((AP1, (0,) * 8))))
    box = (0, 0, WIDTH - 1, HEIGHT - 1)
    image = show(stage, "ap1.exr", write_exr(color_at, box, box, said))
    image.colorspace_settings.name = draw.choice(("Linear", "Linear", "Non-Color", "Linear ACEScg"))


@trait("world")
def exr_with_windows(stage, draw):
    window, display = draw.choice((((0, 4, 31, 11), (0, 0, 31, 15)), ((-4, -2, 35, 17), (0, 0, 31, 15)),
                                   ((8, 8, 39, 23), (8, 8, 39, 23)), ((0, 0, 31, 15), (4, 2, 27, 13))))
    show(stage, "window.exr", write_exr(color_at, window, display))


@trait("world")
def exr_with_other_channels(stage, draw):
    kind = draw.choice(("alpha", "depth", "luminance", "layer"))

    def channels(x, y):
        color = color_at(x, y)
        if kind == "luminance":
            return {"Y": color["G"]}
        if kind == "layer":
            return {f"Beauty.{name}": value for name, value in color.items()}
        return {**color, "A" if kind == "alpha" else "Z": 0.5 if kind == "alpha" else 100.0}
    box = (0, 0, WIDTH - 1, HEIGHT - 1)
    show(stage, "channels.exr", write_exr(channels, box, box))


def write_png(rows, depth=8):
    """rows of (r, g, b) or (r, g, b, a) from 0 to 1."""
    most, code = 2 ** depth - 1, ">B" if depth == 8 else ">H"
    lines = b"".join(b"\0" + b"".join(struct.pack(code, round(most * min(v, 1))) for color in row for v in color) for row in rows)

    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
    header = struct.pack(">IIBBBBB", len(rows[0]), len(rows), depth, 6 if len(rows[0][0]) == 4 else 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(lines)) + chunk(b"IEND", b"")


@trait("world")
def png(stage, draw):
    rows = [[tuple(v / 2 for v in color) for color in row] for row in sky_pixels()]
    image = show(stage, "sky.png", write_png(rows, draw.choice((8, 16))))
    image.colorspace_settings.name = draw.choice(("sRGB", "sRGB", "Non-Color", "Linear", "Filmic sRGB"))
    stage.sky.interpolation = "Closest"  # between texels Cycles mixes sRGB, Baton light


@trait("world")
def png_with_alpha(stage, draw):
    rows = [[(*(v / 2 for v in color), 0.25 + x / 40) for x, color in enumerate(row)] for row in sky_pixels()]
    image = show(stage, "alpha.png", write_png(rows))
    image.alpha_mode = draw.choice(("STRAIGHT", "PREMUL", "CHANNEL_PACKED", "NONE"))
    stage.sky.interpolation = "Closest"


@trait("world")
def image_within_the_file(stage, draw):
    if draw.random() < 0.5:
        stage.sky.image.pack()
        return
    image = bpy.data.images.new("made", WIDTH, HEIGHT, float_buffer=draw.random() < 0.5)
    image.pixels.foreach_set([value for row in sky_pixels()[::-1] for color in row for value in (*(v / 2 for v in color), 1)])
    stage.sky.image, stage.sky.interpolation = image, "Closest"


@trait("world")
def exr_of_another_space(stage, draw):
    stage.sky.image.colorspace_settings.name = draw.choice(("sRGB", "Linear ACEScg", "Linear ACES", "XYZ", "Raw", "Filmic Log"))


@trait("world")
def interpolated_otherwise(stage, draw):
    stage.sky.interpolation = draw.choice(("Closest", "Cubic", "Smart"))


def mapping_of(stage, kind):
    tree = stage.world.node_tree
    mapping = tree.nodes.new("ShaderNodeMapping")
    mapping.vector_type = kind
    tree.links.new(tree.nodes.new("ShaderNodeTexCoord").outputs["Generated"], mapping.inputs["Vector"])
    tree.links.new(mapping.outputs["Vector"], stage.sky.inputs["Vector"])
    return mapping.inputs


@trait("world")
def turned(stage, draw):
    inputs = mapping_of(stage, draw.choice(("POINT", "TEXTURE", "VECTOR", "NORMAL")))
    inputs["Rotation"].default_value = [draw.choice((0, 0, draw.uniform(-3, 3))), draw.choice((0, 0.4)), draw.uniform(-3, 3)]
    if draw.random() < 0.3 and "Location" in inputs:
        inputs["Location"].default_value[draw.randrange(3)] = 0.3
    if draw.random() < 0.3:
        inputs["Scale"].default_value = draw.choice(((2, 2, 2), (1, 1, 2), (-1, 1, 1)))


@trait("world")
def turns(stage, draw):
    stage.scene.frame_end = 3
    inputs = mapping_of(stage, "POINT")
    keyed(inputs["Rotation"], "default_value", {1: 0.3, 3: 1.5}, draw.choice((2, 2, 0)))
    keyed(stage.background.inputs["Strength"], "default_value", {1: 1, 3: 0.5})


@trait("world")
def plain_color(stage, draw):
    stage.world.node_tree.links.remove(stage.background.inputs["Color"].links[0])
    stage.background.inputs["Color"].default_value = (0.6, 0.8, 1, 1)
    stage.background.inputs["Strength"].default_value = draw.choice((1, 3, 0))


@trait("world")
def no_nodes(stage, draw):
    stage.world.use_nodes = False
    stage.world.color = (0.3, 0.5, 0.9)
    if draw.random() < 0.3:
        stage.scene.world = None


@trait("world")
def other_nodes(stage, draw):
    tree = stage.world.node_tree
    kind = draw.choice(("ShaderNodeTexSky", "ShaderNodeHueSaturation", "ShaderNodeTexGradient", "ShaderNodeGamma"))
    node = tree.nodes.new(kind)
    if kind == "ShaderNodeGamma":
        node.inputs["Gamma"].default_value = 2
    if kind == "ShaderNodeHueSaturation":
        node.inputs["Saturation"].default_value = 0.2
    if "Color" in node.inputs:
        tree.links.new(stage.sky.outputs[0], node.inputs["Color"])
    tree.links.new(node.outputs[0], stage.background.inputs["Color"])
    if draw.random() < 0.3:
        node.mute = True


@trait("world")
def seen_otherwise(stage, draw):
    kind = draw.choice(("color", "image", "nothing", "transparent"))
    if kind == "nothing":
        stage.world.cycles_visibility.camera = False
    elif kind == "transparent":
        stage.scene.render.film_transparent = True
    else:
        seen = stage.seen_by_camera()
        seen.inputs["Color"].default_value = (0.1, 0.7, 0.3, 1)
        if kind == "image":
            stage.environment(seen, "seen.exr")


@trait("world")
def film_exposure(stage, draw):
    stage.scene.cycles.film_exposure = draw.choice((0.5, 3))


@trait("world")
def two_outputs(stage, _draw):
    """Cycles' own output, which is meant, and one of Eevee."""
    tree = stage.world.node_tree
    other, plain = tree.nodes.new("ShaderNodeOutputWorld"), tree.nodes.new("ShaderNodeBackground")
    plain.inputs["Color"].default_value = (1, 0, 0, 1)
    tree.links.new(plain.outputs[0], other.inputs["Surface"])
    tree.nodes["World Output"].target, other.target = "CYCLES", "EEVEE"


@trait("world")
def sequence(stage, draw):
    stage.scene.frame_end = 3
    for number in (1, 2, 3):
        stage.sky_image(f"day.{number:04}.exr", number / 2)
    image = show(stage, "day.0001.exr")
    image.source, user = "SEQUENCE", stage.sky.image_user
    user.frame_duration, user.frame_offset, user.use_auto_refresh = 3, draw.choice((0, 1)), True
    user.use_cyclic = draw.random() < 0.5

"""The files of random jobs: written from recipes that are plain data, so that one JSON file repeats a job. Standard
library only."""

import base64
import json
import math
import os
import random
import struct
from array import array
from pathlib import Path

from assets import make_set, png, rgbe, sphere, write_exr, write_hdr, write_mesh

# ---- recipes ------------------------------------------------------------------------------------------------
# A recipe is {"kind": ..., its numbers}; the file's ending says the format.


def write_file(path, recipe, shared):
    """Writes the file of a recipe. shared: folder of the large files that several jobs use."""
    kind = recipe["kind"]
    path.parent.mkdir(parents=True, exist_ok=True)
    if kind == "json":
        path.write_text(json.dumps(recipe["value"], indent=1), encoding="utf-8")
    elif kind in MESHES:
        MESHES[kind](path, recipe)
    elif kind in SKIES:
        write_sky(path, recipe)
    elif kind == "image":
        write_image(path, recipe["width"], recipe["height"])
    elif kind == "merl":
        link_table(path, recipe, shared)
    elif kind == "set":
        path.write_bytes(make_set(recipe["pillars"], recipe.get("textured", False), recipe.get("alive", False)))
    elif kind == "walk":
        path.write_text(json.dumps(walk_gltf(recipe)), encoding="ascii")
    else:
        raise ValueError(f"{path}: no recipe of kind {kind!r}")


def write_image(path, width, height):
    """Colours with holes, as PNG or TGA."""
    texels = [[(37 * x + 90 * y) % 256, (11 * x + 5 * y + 120) % 256, 200 - (x * y) % 90, 255 if (x + y) % 3 else 60]
              for y in range(height) for x in range(width)]
    if path.suffix == ".tga":
        head = struct.pack("<BBBHHBHHHHBB", 0, 0, 2, 0, 0, 0, 0, 0, width, height, 32, 0x28)
        path.write_bytes(head + b"".join(bytes([b, g, r, a]) for r, g, b, a in texels))
        return
    path.write_bytes(png(width, height, lambda x, y: texels[y * width + x]))


def closed_sphere(path, recipe):
    """A camera can be inside."""
    write_mesh(path, *sphere(recipe["rings"], recipe["segments"]))


def card(path, _):
    """A square that has a back."""
    write_mesh(path, [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], [(0, 1, 2), (0, 2, 3)])


def shards(path, recipe):
    """Triangles anywhere, some of them without area."""
    rng = random.Random(recipe["seed"])
    vertices = [tuple(rng.uniform(-1, 1) for _ in range(3)) for _ in range(3 * recipe["count"])]
    triangles = [(3 * i, 3 * i + 1, 3 * i + (2 if i % 4 or i == 0 else 1)) for i in range(recipe["count"])]
    write_mesh(path, vertices, triangles)


MESHES = {"sphere": closed_sphere, "card": card, "shards": shards}


def gradient(v):
    return (0.2 + v, 0.5, 1.2 - v)


# Kind of map -> (colour of a row at height v in [0, 1], colour of its special texels).
SKIES = {
    "sky": (gradient, None),
    "flat": (lambda v: (0.7, 0.6, 0.5), None),
    "black": (lambda v: (0.0, 0.0, 0.0), None),
    "lamp": (gradient, (20.0, 18.0, 15.0)),
    "sun": (lambda v: (0.3, 0.3, 0.4), (3e4, 2e4, 1e4)),
    "dots": (lambda v: (0.0, 0.0, 0.0), (50.0, 4.0, 2.0)),
    "halves": (lambda v: (1.0, 0.9, 0.8) if v < 0.5 else (0.0, 0.0, 0.0), None),
    "wild": (gradient, (float("nan"), float("inf"), -1.0)),  # what a reader must repair; EXR only
}


def write_sky(path, recipe):
    """A lat-long map: rows of one colour each, and `count` special texels at places that `seed` draws."""
    width, height = recipe["width"], recipe["height"]
    row_colour, special = SKIES[recipe["kind"]]
    level = recipe.get("level", 1.0)
    encode = exr_texel if path.suffix == ".exr" else rgbe

    def texel(rgb):
        return encode(tuple(level * c for c in rgb))

    rows = [bytearray(texel(row_colour((y + 0.5) / height)) * width) for y in range(height)]
    size = len(rows[0]) // width
    rng = random.Random(recipe.get("seed", 0))
    for _ in range(recipe.get("count", 0) if special else 0):
        x, y = rng.randrange(width), rng.randrange(height)
        rows[y][x * size:(x + 1) * size] = texel(special)
    if path.suffix == ".exr":
        write_exr(path, width, rows)
    else:
        write_hdr(path, width, rows)


def exr_texel(rgb):
    return struct.pack("<3f", *rgb)


def link_table(path, recipe, shared):
    """A table in the MERL format, 35 MB: a lobe that depends on the half vector alone, over a diffuse base."""
    table = Path(shared) / f"merl-{recipe['lobe']}-{recipe['base']}.binary"
    if not table.exists():
        temporary = table.with_suffix(f".{os.getpid()}.{id(recipe)}")
        with temporary.open("wb") as file:
            array("i", (90, 90, 180)).tofile(file)
            for scale in (1 / 1500, 1.15 / 1500, 1.66 / 1500):
                for h in range(90):
                    theta = ((h + 0.5) / 90) ** 2 * math.pi / 2
                    value = (recipe["base"] + 0.3 * math.cos(theta) ** recipe["lobe"]) / math.pi / scale
                    array("d", [value]).__mul__(90 * 180).tofile(file)
        temporary.rename(table)
    path.symlink_to(table.resolve())


def walk_gltf(recipe):
    """An animation of node "hip" and of the camera "eye", which goes round at some distance."""
    times = [i / 4 for i in range(5)]
    hip = [(0.3 * i, 0.1 * (i % 2), -0.2 * i) for i in range(5)]
    eye = [(0.2 * i, 1.0, recipe["distance"]) for i in range(5)]
    turn = [(0.0, math.sin(0.2 * i), 0.0, math.cos(0.2 * i)) for i in range(5)]
    views, data = [], b""
    for rows in ([(t,) for t in times], hip, eye, turn):
        part = b"".join(struct.pack(f"<{len(row)}f", *row) for row in rows)
        views.append({"buffer": 0, "byteOffset": len(data), "byteLength": len(part)})
        data += part
    kinds = ["SCALAR", "VEC3", "VEC3", "VEC4"]
    accessors = [{"bufferView": i, "componentType": 5126, "count": 5, "type": kind} for i, kind in enumerate(kinds)]
    accessors[0].update(min=[0.0], max=[1.0])
    uri = "data:application/octet-stream;base64," + base64.b64encode(data).decode("ascii")
    targets = [(0, "translation", 1), (1, "translation", 2), (0, "rotation", 3)]
    return {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1]}],
        "nodes": [{"name": "hip"}, {"name": "eye", "camera": 0}],
        "cameras": [{"type": "perspective", "name": "eye", "perspective": {"yfov": 0.7, "znear": 0.1}}],
        "buffers": [{"byteLength": len(data), "uri": uri}], "bufferViews": views, "accessors": accessors,
        "animations": [{"samplers": [{"input": 0, "output": output} for _, _, output in targets],
                        "channels": [{"sampler": i, "target": {"node": node, "path": path}}
                                     for i, (node, path, _) in enumerate(targets)]}],
    }


# ---- states -------------------------------------------------------------------------------------------------


def raw_state_bytes(path):
    """Bytes that a sample state holds when unpacked, its description apart; None for any other blob."""
    with Path(path).open("rb") as file:
        head = file.read(16)
        if head[:4] != b"BST1":
            return None
        table = file.read(28 * struct.unpack_from("<H", head, 6)[0])
    entries = [table[i:i + 28] for i in range(0, len(table), 28)]
    return sum(struct.unpack_from("<Q", entry, 16)[0] for entry in entries if entry[:4] != b"META")

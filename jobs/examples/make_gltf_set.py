#!/usr/bin/env python3
"""Writes a small scene as Blender would: a floor, a ring of glazed pillars that share one mesh, a turning vane, a lift, a ball
that bounces, and a camera on a dolly, each with an animation of its own. Standard library only.

usage: make_gltf_set.py FILE.glb [--textured] [--alive]

Frames 1 to 24 at 24 frames per second, frame n at n / 24 seconds. --textured: tiles with joints on the floor, scratches on
the vane, holes in the ball, pillars that glow in stripes and whose glaze has run. --alive: a reed that sways on three bones
while it swells, and a drop that flattens.
"""

import json
import math
import struct
import sys
import zlib
from pathlib import Path

FLOAT, UINT8, UINT16, INT16 = 5126, 5121, 5123, 5122
LAST_FRAME, FPS = 24, 24


class Builder:
    """A glTF file in the making: buffer, views, accessors."""

    def __init__(self):
        self.data = bytearray()
        self.views, self.accessors, self.meshes, self.nodes, self.animations, self.skins = [], [], [], [], [], []
        self.images, self.textures = [], []

    def accessor(self, rows, kind, component=FLOAT, **more):
        """Appends rows of numbers; the index of their accessor."""
        width = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}[kind]
        letter, size = {FLOAT: ("f", 4), UINT8: ("B", 1), UINT16: ("H", 2), INT16: ("h", 2)}[component]
        self.data += bytes(-len(self.data) % 4)
        stride = (width * size + 3) // 4 * 4 if kind != "SCALAR" else size
        view = {"buffer": 0, "byteOffset": len(self.data), "byteLength": stride * len(rows)}
        if kind != "SCALAR" and stride != width * size:
            view["byteStride"] = stride
        for row in rows:
            packed = struct.pack(f"<{width}{letter}", *(row if kind != "SCALAR" else (row,)))
            self.data += packed + bytes(stride - len(packed))
        self.views.append(view)
        accessor = {"bufferView": len(self.views) - 1, "componentType": component, "count": len(rows), "type": kind, **more}
        if component == FLOAT and rows and "normalized" not in more:
            columns = [[row] for row in rows] if kind == "SCALAR" else rows
            accessor["min"] = [min(float(struct.unpack("<f", struct.pack("<f", c[i]))[0]) for c in columns) for i in range(width)]
            accessor["max"] = [max(float(struct.unpack("<f", struct.pack("<f", c[i]))[0]) for c in columns) for i in range(width)]
        self.accessors.append(accessor)
        return len(self.accessors) - 1

    def texture(self, width, height, texel):
        """An image in the file, by texel(x, y) -> 3 or 4 bytes; the index of its texture."""
        self.data += bytes(-len(self.data) % 4)
        image = png(width, height, texel)
        self.views.append({"buffer": 0, "byteOffset": len(self.data), "byteLength": len(image)})
        self.data += image
        self.images.append({"bufferView": len(self.views) - 1, "mimeType": "image/png"})
        self.textures.append({"source": len(self.images) - 1, "sampler": len(self.images) - 1})
        return len(self.textures) - 1

    def mesh(self, name, material, positions, normals, uvs, triangles, quantised=False, skin=None, target=None):
        """A mesh of one primitive; quantised: positions as 16-bit integers of the cube [-1, 1]. skin: (joints, weights) of
        each vertex; target: (steps of positions, of normals) of a morph target."""
        if quantised:
            places = self.accessor([[round(c * 32767) for c in p] for p in positions], "VEC3", INT16, normalized=True)
        else:
            places = self.accessor(positions, "VEC3")
        attributes = {"POSITION": places, "NORMAL": self.accessor(normals, "VEC3"), "TEXCOORD_0": self.accessor(uvs, "VEC2")}
        if skin:
            attributes["JOINTS_0"] = self.accessor(skin[0], "VEC4", UINT8)
            attributes["WEIGHTS_0"] = self.accessor([[round(255 * w) for w in row] for row in skin[1]], "VEC4", UINT8,
                                                    normalized=True)
        indices = self.accessor([i for triangle in triangles for i in triangle], "SCALAR", UINT16)
        primitive = {"attributes": attributes, "indices": indices, "material": material}
        if target:
            primitive["targets"] = [{"POSITION": self.accessor(target[0], "VEC3"), "NORMAL": self.accessor(target[1], "VEC3")}]
        self.meshes.append({"name": name, "primitives": [primitive]})
        return len(self.meshes) - 1

    def node(self, name, parent=None, **what):
        self.nodes.append({"name": name, **what})
        if parent is not None:
            self.nodes[parent].setdefault("children", []).append(len(self.nodes) - 1)
        return len(self.nodes) - 1

    def animate(self, node, path, times, rows, curve="LINEAR"):
        """An animation of its own, as Blender writes one for each object."""
        kind = {"rotation": "VEC4", "weights": "SCALAR"}.get(path, "VEC3")
        sampler = {"input": self.accessor(times, "SCALAR"), "output": self.accessor(rows, kind), "interpolation": curve}
        self.animations.append({"name": f"{self.nodes[node]['name']}.{path}", "samplers": [sampler],
                                "channels": [{"sampler": 0, "target": {"node": node, "path": path}}]})

    def glb(self, roots, materials, cameras, **more):
        if self.skins:
            more = {"skins": self.skins, **more}
        children = {child for node in self.nodes for child in node.get("children", [])}
        document = {"asset": {"version": "2.0", "generator": "make_gltf_set"}, "scene": 0,
                    "scenes": [{"nodes": [n for n in roots if n not in children]}], "nodes": self.nodes, "meshes": self.meshes,
                    "materials": materials, "cameras": cameras, "animations": self.animations, "accessors": self.accessors,
                    "bufferViews": self.views, "buffers": [{"byteLength": len(self.data)}], **more}
        text = json.dumps(document, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        binary = bytes(self.data) + bytes(-len(self.data) % 4)
        size = 12 + 8 + len(text) + 8 + len(binary)
        return (struct.pack("<4sII", b"glTF", 2, size) + struct.pack("<I4s", len(text), b"JSON") + text
                + struct.pack("<I4s", len(binary), b"BIN\0") + binary)


def png(width, height, texel):
    """The bytes of a PNG of texel(x, y) -> 3 or 4 bytes."""
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    rows = b"".join(b"\0" + b"".join(bytes(texel(x, y)) for x in range(width)) for y in range(height))
    color = {3: 2, 4: 6}[len(texel(0, 0))]
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, color, 0, 0, 0))
            + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))


def box():
    """A cube of edge 2: four vertices a side."""
    positions, normals, uvs, triangles = [], [], [], []
    for axis in range(3):
        for sign in (-1, 1):
            u, v = (axis + 1) % 3, (axis + 2) % 3
            first = len(positions)
            for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
                p = [0, 0, 0]
                p[axis], p[u], p[v] = sign, a, b
                n = [0, 0, 0]
                n[axis] = sign
                positions.append(p)
                normals.append(n)
                uvs.append([(a + 1) / 2, (b + 1) / 2])
            corners = [(0, 1, 2), (0, 2, 3)] if sign > 0 else [(0, 2, 1), (0, 3, 2)]
            triangles += [[first + i for i in corner] for corner in corners]
    return positions, normals, uvs, triangles


def ball(rings=16, segments=24):
    """A unit sphere."""
    positions, uvs, triangles = [], [], []
    for i in range(rings + 1):
        for j in range(segments + 1):
            theta, phi = math.pi * i / rings, 2 * math.pi * j / segments
            positions.append([math.sin(theta) * math.cos(phi), math.cos(theta), -math.sin(theta) * math.sin(phi)])
            uvs.append([j / segments, i / rings])
    for i in range(rings):
        for j in range(segments):
            a, b = i * (segments + 1) + j, (i + 1) * (segments + 1) + j
            triangles += [[a, b, b + 1]] * (i < rings - 1) + [[a, b + 1, a + 1]] * (i > 0)
    return positions, positions, uvs, triangles


def reed(rings=12, sides=8):
    """A stalk of height 1.5 along y, rounded at the top; each vertex hangs on the two of three bones between which it is."""
    positions, normals, uvs, triangles, joints, weights, steps = [], [], [], [], [], [], []
    for i in range(rings + 1):
        height = i / rings
        radius = 0.09 * math.sqrt(max(0.0, 1 - height ** 8)) + 0.005
        bone = min(int(2 * height), 1)
        share = 2 * height - bone
        share = share * share * (3 - 2 * share)
        for j in range(sides + 1):
            phi = 2 * math.pi * j / sides
            out = [math.cos(phi), 0, -math.sin(phi)]
            positions.append([radius * out[0], 1.5 * height, radius * out[2]])
            normals.append(out)
            uvs.append([j / sides, 4 * (1 - height)])
            joints.append([bone, bone + 1, 0, 0])
            weights.append([1 - round(255 * share) / 255, round(255 * share) / 255, 0, 0])
            swell = 0.12 * math.exp(-((height - 0.35) / 0.12) ** 2)
            steps.append([swell * out[0], 0, swell * out[2]])
    for i in range(rings):
        for j in range(sides):
            a, b = i * (sides + 1) + j, (i + 1) * (sides + 1) + j
            triangles += [[a, a + 1, b + 1], [a, b + 1, b]]
    return (positions, normals, uvs, triangles), (joints, weights), (steps, [[0, 0, 0]] * len(steps))


def add_creatures(b, reed_material, drop_material, seconds):
    """The reed and the drop, animated; their nodes."""
    shape, skin, swell = reed()
    mesh = b.mesh("reed", reed_material, *shape, skin=skin, target=swell)
    # The node of a mesh with a skin says nothing of where that is.
    stalk = b.node("reed", mesh=mesh, skin=0, translation=[9, 9, 9])
    bones = [b.node("reed.0", translation=[-1.3, 0, 1], scale=[1.2, 1, 1.2])]
    bones += [b.node("reed.1", bones[0], translation=[0, 0.75, 0])]
    bones += [b.node("reed.2", bones[1], translation=[0, 0.75, 0])]
    binds = [[1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, -0.75 * i, 0, 1] for i in range(3)]
    b.skins.append({"joints": bones, "inverseBindMatrices": b.accessor(binds, "MAT4")})
    times = [seconds[0], seconds[7], seconds[15], seconds[-1]]
    for bone, size in zip(bones, (12, 40, 55)):
        turns = [math.radians(size * sign) / 2 for sign in (-0.5, 1, -1, 0.5)]
        b.animate(bone, "rotation", times, [[0.3 * math.sin(t), 0, math.sin(t), math.cos(t)] for t in turns])
    b.animate(stalk, "weights", times, [0, 0.3, 1, 0])

    positions, _, uvs, triangles = ball(10, 16)
    flat = [[0.6 * x, -0.55 * y, 0.6 * z] for x, y, z in positions]

    def bent(x, y, z):  # what the normal of the flattened ball is more than that of the ball
        n = [x / 1.6, y / 0.45, z / 1.6]
        length = math.sqrt(sum(c * c for c in n))
        return [c / length - p for c, p in zip(n, (x, y, z))]
    mesh = b.mesh("drop", drop_material, positions, positions, uvs, triangles, target=(flat, [bent(*p) for p in positions]))
    b.meshes[mesh]["weights"] = [0.2]
    drop = b.node("drop", mesh=mesh, scale=[0.25, 0.25, 0.25], translation=[0.2, 0.3, 1.3])
    b.animate(drop, "weights", [seconds[0], seconds[9], seconds[-1]], [0, 0, 4, 0, 1, 0, 0, 0, 0], "CUBICSPLINE")
    b.animate(drop, "translation", [seconds[0], seconds[-1]], [[0.2, 0.3, 1.3], [0.5, 0.25, 1.3]])
    return [stalk, bones[0], drop]


def about_y(degrees):
    return [0, math.sin(math.radians(degrees) / 2), 0, math.cos(math.radians(degrees) / 2)]


def pbr(name, color, metallic, roughness):
    return {"name": name, "pbrMetallicRoughness": {"baseColorFactor": [*color, 1], "metallicFactor": metallic,
                                                   "roughnessFactor": roughness}}


def add_textures(b, materials):
    """Every kind of texture that is read, on the materials of the set."""
    def joint(x):  # how far into a joint between tiles of 32 texels
        return max(0, 2 - min(x % 32, 31 - x % 32))

    def tile(x, y):
        shade = 255 - 40 * ((x // 32 + y // 32) % 2) - 70 * max(joint(x), joint(y)) - (x * 7 + y * 13) % 16
        return shade, shade - 5, shade - 15

    def slope(x, y):
        across = 60 * joint(x) * (1 if x % 32 > 16 else -1)
        up = 60 * joint(y) * (1 if y % 32 < 16 else -1)
        length = math.sqrt(across ** 2 + up ** 2 + 127 ** 2)
        return tuple(round(127.5 + 127 * c / length) for c in (across, up, 127))

    def scratch(x, y):
        return 0, 60 + (x * 37 + y // 8 * 11) % 128, 255 if y % 16 < 12 else 0

    def lace(x, y):
        return 255, 255 - 2 * y, 200, 0 if (x - 16) ** 2 + (y - 16) ** 2 < 90 else 255

    def stripe(_x, y):
        return (255, 160, 40) if y % 16 < 4 else (0, 0, 0)

    def glaze(x, y):  # red: how much of it; green: how rough it is
        return 255 if y < 20 + (x * 5) % 11 else 40, 60 + 6 * y, 0

    floor, clay, steel, rubber = materials
    floor["pbrMetallicRoughness"]["baseColorTexture"] = {"index": b.texture(64, 64, tile)}
    floor["normalTexture"] = {"index": b.texture(64, 64, slope), "scale": 0.8}
    steel["pbrMetallicRoughness"]["metallicRoughnessTexture"] = {"index": b.texture(64, 32, scratch)}
    turned = {"KHR_texture_transform": {"scale": [8, 4], "rotation": 0.1, "offset": [0.2, 0]}}
    rubber["pbrMetallicRoughness"]["baseColorTexture"] = {"index": b.texture(32, 32, lace), "extensions": turned}
    rubber.update(alphaMode="MASK", alphaCutoff=0.4, doubleSided=True)
    clay["emissiveTexture"] = {"index": b.texture(32, 32, stripe)}
    clay["emissiveFactor"] = [1, 1, 1]
    clay["extensions"]["KHR_materials_emissive_strength"] = {"emissiveStrength": 1.5}
    run = {"index": b.texture(32, 32, glaze)}
    clay["extensions"]["KHR_materials_clearcoat"] = {"clearcoatFactor": 1, "clearcoatTexture": run,
                                                     "clearcoatRoughnessFactor": 1, "clearcoatRoughnessTexture": run,
                                                     "clearcoatNormalTexture": {"index": b.texture(64, 64, slope), "scale": 0.3}}
    samplers = [{"wrapS": 10497, "wrapT": 10497}] * len(b.images)
    return {"images": b.images, "textures": b.textures, "samplers": samplers}


def make_set(pillars=7, textured=False, alive=False, builder=None):
    """The bytes of the .glb. builder: another that puts it together."""
    b = builder or Builder()
    materials = [pbr("floor", (0.5, 0.45, 0.4), 0, 0.7), pbr("clay", (0.6, 0.25, 0.15), 0, 0.6),
                 pbr("steel", (0.75, 0.77, 0.8), 1, 0.3), pbr("rubber", (0.1, 0.3, 0.6), 0, 0.4)]
    materials[1]["extensions"] = {"KHR_materials_clearcoat": {"clearcoatFactor": 1, "clearcoatRoughnessFactor": 0.1}}
    side = [[-4, 0, -4], [-4, 0, 4], [4, 0, 4], [4, 0, -4]]
    floor = b.mesh("floor", 0, side, [[0, 1, 0]] * 4, [[0, 0], [0, 4], [4, 4], [4, 0]], [(0, 1, 2), (0, 2, 3)])
    pillar = b.mesh("pillar", 1, *box(), quantised=True)
    vane_mesh = b.mesh("vane", 2, *box())
    ball_mesh = b.mesh("ball", 3, *ball())

    roots = [b.node("floor", mesh=floor)]
    ring = b.node("ring")
    roots.append(ring)
    for i in range(pillars):
        angle = 2 * math.pi * i / pillars
        scale = [0.15, 0.5 + 0.05 * i, -0.15 if i % 2 else 0.15]  # every other one is mirrored
        b.node(f"pillar.{i:03}", ring, mesh=pillar, scale=scale, rotation=about_y(20 * i),
               translation=[2 * math.sin(angle), scale[1], 2 * math.cos(angle) - 0.5])

    seconds = [frame / FPS for frame in range(1, LAST_FRAME + 1)]
    lift = b.node("lift", translation=[-0.7, 0.4, 0])
    vane = b.node("vane", lift, mesh=vane_mesh, scale=[0.5, 0.06, 0.12])
    bounce = b.node("ball", mesh=ball_mesh, scale=[0.3, 0.3, 0.3], translation=[0.7, 0.3, 0.2])
    dolly = b.node("dolly")
    eye = b.node("eye", dolly, camera=0, translation=[0, 1.6, 5], rotation=[-math.sin(0.12), 0, 0, math.cos(0.12)])
    roots += [lift, bounce, dolly]
    b.animate(vane, "rotation", [seconds[0], seconds[11], seconds[-1]], [about_y(0), about_y(120), about_y(240)])
    b.animate(lift, "translation", seconds[::8], [[-0.7, y, 0] for y in (0.3, 0.6, 0.9)], "STEP")
    # In-tangent, value, out-tangent of each key, per second.
    keys = [([0.7, 0.3, 0.2], 0, 3), ([0.7, 0.9, 0.2], 0, 0), ([0.7, 0.3, 0.2], -3, 0)]
    b.animate(bounce, "translation", [seconds[0], seconds[12], seconds[-1]],
              [row for place, before, behind in keys for row in ([0, before, 0], place, [0, behind, 0])], "CUBICSPLINE")
    b.animate(dolly, "rotation", [seconds[0], seconds[-1]], [about_y(-10), about_y(10)])
    assert eye < len(b.nodes)
    if alive:
        roots += add_creatures(b, 0, 3, seconds)
    camera = {"type": "perspective", "name": "eye", "perspective": {"yfov": 0.55, "znear": 0.1, "aspectRatio": 16 / 9}}
    used = ["KHR_mesh_quantization", "KHR_materials_clearcoat"] + ["KHR_texture_transform", "KHR_materials_emissive_strength"] * textured
    more = add_textures(b, materials) if textured else {}
    return b.glb(roots, materials, [camera], extensionsUsed=used, extensionsRequired=["KHR_mesh_quantization"], **more)


if __name__ == "__main__":
    if len(sys.argv) < 2 or sys.argv[1].startswith("-") or not set(sys.argv[2:]) <= {"--textured", "--alive"}:
        sys.exit(__doc__)
    Path(sys.argv[1]).write_bytes(make_set(textured="--textured" in sys.argv, alive="--alive" in sys.argv))

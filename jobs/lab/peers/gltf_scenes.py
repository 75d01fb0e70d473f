"""The set of jobs/examples/make_gltf_set.py with materials that Baton and Cycles model alike."""

import json
import math
import struct
import sys
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parents[2] / "examples"))
from make_gltf_set import FLOAT, UINT16, Builder, make_set  # noqa: E402

NEAREST = 9728


def open_glb(glb):
    """Its JSON and the bytes of its buffer."""
    size = struct.unpack_from("<I", glb, 12)[0]
    return json.loads(glb[20:20 + size]), glb[28 + size:]


def write_glb(document, buffer):
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    buffer += bytes(-len(buffer) % 4)
    return (struct.pack("<4sII", b"glTF", 2, 28 + len(text) + len(buffer)) + struct.pack("<I4s", len(text), b"JSON") + text
            + struct.pack("<I4s", len(buffer), b"BIN\0") + buffer)


def as_one(animations):
    """One animation that is all of them: of several Blender shows the first."""
    samplers = [sampler for animation in animations for sampler in animation["samplers"]]
    channels = [animation["channels"][0] for animation in animations]  # one each
    return [{"samplers": samplers, "channels": [{**channel, "sampler": i} for i, channel in enumerate(channels)]}]


def with_alike_materials(document, normals):
    """The set with what both model alike."""
    for material in document["materials"]:
        material.setdefault("extensions", {}).pop("KHR_materials_clearcoat", None)
        material["extensions"]["KHR_materials_specular"] = {"specularFactor": 0}
        if not normals:
            material.pop("normalTexture", None)
        if material["pbrMetallicRoughness"]["metallicFactor"] > 0:
            material["pbrMetallicRoughness"]["baseColorFactor"] = [1, 1, 1, 1]
    for sampler in document["samplers"]:
        sampler.update(magFilter=NEAREST, minFilter=NEAREST)
    document["animations"] = as_one(document["animations"])
    used = [name for name in document["extensionsUsed"] if name != "KHR_materials_clearcoat"]
    document["extensionsUsed"] = [*used, "KHR_materials_specular"]


def hills(cells=240, side=4, height=0.12, wave=1.3):
    """Smooth positions, normals, coordinates and triangles in place of the floor."""
    positions, normals, uvs, triangles = [], [], [], []
    for i in range(cells + 1):
        for j in range(cells + 1):
            x, z = side * (2 * j / cells - 1), side * (2 * i / cells - 1)
            slope = [wave * height * math.cos(wave * x) * math.cos(wave * z),
                     -wave * height * math.sin(wave * x) * math.sin(wave * z)]
            long = math.sqrt(1 + slope[0] ** 2 + slope[1] ** 2)
            # Below y = 0, where the pillars stand.
            positions.append((x, height * (math.sin(wave * x) * math.cos(wave * z) - 1), z))
            normals.append((-slope[0] / long, 1 / long, -slope[1] / long))
            uvs.append((j / cells, i / cells))
    for i in range(cells):
        for j in range(cells):
            a, b = i * (cells + 1) + j, (i + 1) * (cells + 1) + j
            triangles += [(a, b, b + 1), (a, b + 1, a + 1)]
    return positions, normals, uvs, triangles


def put_hills(document, buffer):
    """Replaces the mesh of the floor; the buffer with the new one behind."""
    def add(rows, kind, component):
        nonlocal buffer
        buffer += bytes(-len(buffer) % 4)
        data = b"".join(struct.pack(f"<{len(row)}{'f' if component == FLOAT else 'H'}", *row) for row in rows)
        document["bufferViews"].append({"buffer": 0, "byteOffset": len(buffer), "byteLength": len(data)})
        buffer += data
        count = len(rows) * (3 if kind == "SCALAR" else 1)
        accessor = {"bufferView": len(document["bufferViews"]) - 1, "componentType": component, "count": count, "type": kind}
        if kind == "VEC3":
            accessor.update(min=[min(column) for column in zip(*rows)], max=[max(column) for column in zip(*rows)])
        document["accessors"].append(accessor)
        return len(document["accessors"]) - 1

    positions, normals, uvs, triangles = hills()
    mesh = document["nodes"][next(i for i, node in enumerate(document["nodes"]) if node["name"] == "floor")]["mesh"]
    primitive = document["meshes"][mesh]["primitives"][0]
    primitive["attributes"] = {"POSITION": add(positions, "VEC3", FLOAT), "NORMAL": add(normals, "VEC3", FLOAT),
                               "TEXCOORD_0": add(uvs, "VEC2", FLOAT)}
    primitive["indices"] = add(triangles, "SCALAR", UINT16)
    document["buffers"][0]["byteLength"] = len(buffer)
    return buffer


def set_of(texels):
    """The set's bytes; of its images every so many-th column and row."""
    class CoarseBuilder(Builder):
        def texture(self, width, height, texel):
            return super().texture(width // texels, height // texels, lambda x, y: texel(texels * x, texels * y))

    return make_set(textured=True, builder=CoarseBuilder())


def make_scene(texels=1, normals=False, hilly=False):
    """The bytes of the .glb."""
    document, buffer = open_glb(set_of(texels))
    with_alike_materials(document, normals)
    if hilly:
        buffer = put_hills(document, buffer)
    return write_glb(document, buffer)

"""Files that the jobs of tests are made of: meshes, maps and images. Standard library only."""

import math
import struct
import sys
from array import array
from pathlib import Path

sys.path.append(str(Path(__file__).parents[2] / "jobs/examples"))
from make_gltf_set import make_set, png  # noqa: E402, F401


def sphere(rings=8, segments=12):
    """(vertices, triangles) of a closed unit sphere."""
    vertices = [(0.0, 1.0, 0.0)]
    for theta in (math.pi * ring / rings for ring in range(1, rings)):
        for phi in (2 * math.pi * segment / segments for segment in range(segments)):
            place = (math.sin(theta) * math.cos(phi), math.cos(theta), math.sin(theta) * math.sin(phi))
            vertices.append(tuple(round(x, 6) for x in place))
    vertices.append((0.0, -1.0, 0.0))

    def index(ring, segment):
        return 1 + (ring - 1) * segments + segment % segments

    triangles = []
    for segment in range(segments):
        triangles.append((0, index(1, segment + 1), index(1, segment)))
        for ring in range(1, rings - 1):
            a, b = index(ring, segment), index(ring, segment + 1)
            c, d = index(ring + 1, segment), index(ring + 1, segment + 1)
            triangles += [(a, b, c), (b, d, c)]
        triangles.append((len(vertices) - 1, index(rings - 1, segment), index(rings - 1, segment + 1)))
    return vertices, triangles


def write_mesh(path, vertices, triangles):
    """A mesh as OFF, OBJ or PLY."""
    points = [" ".join(repr(float(x)) for x in vertex) for vertex in vertices]
    faces = ["3 " + " ".join(map(str, triangle)) for triangle in triangles]
    if path.suffix == ".off":
        lines = ["OFF", f"{len(points)} {len(triangles)} 0", *points, *faces]
    elif path.suffix == ".obj":
        lines = [f"v {point}" for point in points]
        lines += ["f " + " ".join(str(i + 1) for i in triangle) for triangle in triangles]
    else:
        lines = ["ply", "format ascii 1.0", f"element vertex {len(points)}"]
        lines += [f"property float {axis}" for axis in "xyz"]
        lines += [f"element face {len(triangles)}", "property list uchar int vertex_indices", "end_header", *points, *faces]
    path.write_text("\n".join(lines) + "\n", encoding="ascii")


def rgbe(rgb):
    """A texel of a Radiance file."""
    largest = max(rgb)
    if largest < 1e-32:
        return b"\0\0\0\0"
    exponent = math.frexp(largest)[1]
    return bytes([*(min(255, int(c * math.ldexp(256, -exponent))) for c in rgb), exponent + 128])


def write_hdr(path, width, rows):
    """A Radiance file without run lengths. rows: bytes of their texels."""
    header = f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {len(rows)} +X {width}\n"
    path.write_bytes(header.encode("ascii") + b"".join(rows))


def lamp(x, y, width, height):
    """Colour of a texel: a gradient sky, a dark floor and one small bright lamp."""
    if abs(x - width // 4) <= 1 and abs(y - height // 4) <= 1:
        return (40.0, 36.0, 30.0)
    sky = 0.2 + 0.8 * (height - y) / height if y < height / 2 else 0.05
    return (sky * 0.7, sky * 0.8, sky)


def write_map(path, width=32, height=16, colour=lamp):
    """A lat-long Radiance map of colour(x, y, width, height)."""
    write_hdr(path, width, [b"".join(rgbe(colour(x, y, width, height)) for x in range(width)) for y in range(height)])


def write_exr(path, width, rows):
    """An uncompressed scan-line EXR of float B, G, R. rows: interleaved float R, G, B."""

    def attribute(name, kind, value):
        return name + b"\0" + kind + b"\0" + struct.pack("<i", len(value)) + value

    channels = b"".join(name + b"\0" + struct.pack("<iiii", 2, 0, 1, 1) for name in (b"B", b"G", b"R")) + b"\0"
    window = struct.pack("<4i", 0, 0, width - 1, len(rows) - 1)
    header = b"\x76\x2f\x31\x01\x02\0\0\0" + b"".join([
        attribute(b"channels", b"chlist", channels),
        attribute(b"compression", b"compression", b"\0"),
        attribute(b"dataWindow", b"box2i", window),
        attribute(b"displayWindow", b"box2i", window),
        attribute(b"lineOrder", b"lineOrder", b"\0"),
        attribute(b"pixelAspectRatio", b"float", struct.pack("<f", 1)),
        attribute(b"screenWindowCenter", b"v2f", struct.pack("<2f", 0, 0)),
        attribute(b"screenWindowWidth", b"float", struct.pack("<f", 1))]) + b"\0"
    first, size = len(header) + 8 * len(rows), 8 + 12 * width
    with path.open("wb") as file:
        file.write(header + b"".join(struct.pack("<Q", first + size * y) for y in range(len(rows))))
        for y, row in enumerate(rows):
            floats = array("f", bytes(row))
            file.write(struct.pack("<2i", y, 12 * width))
            for channel in (2, 1, 0):
                file.write(floats[channel::3].tobytes())

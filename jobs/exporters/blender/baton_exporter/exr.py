"""Writes uncompressed EXR files. Standard library only."""

import struct

FLOAT, INCREASING_Y, NO_COMPRESSION = 2, 0, 0


def attribute(name, kind, value):
    return name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<i", len(value)) + value


def header(width, height):
    channels = b"".join(name + b"\0" + struct.pack("<iBxxxii", FLOAT, 0, 1, 1) for name in (b"B", b"G", b"R")) + b"\0"
    window = struct.pack("<4i", 0, 0, width - 1, height - 1)
    return (struct.pack("<2i", 20000630, 2) + attribute("channels", "chlist", channels)
            + attribute("compression", "compression", bytes([NO_COMPRESSION]))
            + attribute("dataWindow", "box2i", window) + attribute("displayWindow", "box2i", window)
            + attribute("lineOrder", "lineOrder", bytes([INCREASING_Y]))
            + attribute("pixelAspectRatio", "float", struct.pack("<f", 1))
            + attribute("screenWindowCenter", "v2f", struct.pack("<2f", 0, 0))
            + attribute("screenWindowWidth", "float", struct.pack("<f", 1)) + b"\0")


def write(path, width, height, lines):
    """lines: from the uppermost, each the bytes of `width` 32-bit numbers of B, then G, then R."""
    size = 12 * width
    start = header(width, height)
    first = len(start) + 8 * height
    with open(path, "wb") as file:
        file.write(start)
        file.write(struct.pack(f"<{height}Q", *(first + y * (size + 8) for y in range(height))))
        for y, line in enumerate(lines):
            file.write(struct.pack("<2i", y, size) + line)

"""Reads EXR frames, sharing nothing with the programs. Standard library only."""

import struct
import subprocess
import zlib
from array import array
from pathlib import Path

# Blender's names of passes that have others here; and of Blender's vector to the next frame, the other sign.
BLENDER_PASSES = {**{f"Combined.{c}": c for c in "RGBA"}, "Depth.Z": "Z", "Distance.X": "depth", "IndexOB.X": "object",
                  "IndexMA.X": "material", **{f"Normal.{c}": f"normal.{c}" for c in "XYZ"},
                  **{f"Position.{c}": f"P.{c}" for c in "XYZ"}, **{f"DiffCol.{c}": f"albedo.{c}" for c in "RGB"},
                  "Vector.X": "backward.u", "Vector.Y": "backward.v", "Vector.Z": "-forward.u", "Vector.W": "-forward.v"}
MAGIC = b"\x76\x2f\x31\x01"
COMPRESSIONS = ["none", "rle", "zips", "zip", "piz"]
ROWS_OF_A_BLOCK = {"none": 1, "rle": 1, "zips": 1, "zip": 16}
TYPES = {0: ("I", 4), 1: ("e", 2), 2: ("f", 4)}


class Frame:
    """A decoded EXR file: channels[name] is an array of floats, row by row; sample_bytes: of all samples, unpacked.
    Windows are (x0, y0, x1, y1), half-open; width and height are those of the data window."""

    def __init__(self, window, display, channels, sample_bytes):
        self.window, self.display, self.channels, self.sample_bytes = window, display, channels, sample_bytes
        self.width, self.height = window[2] - window[0], window[3] - window[1]

    def shown(self, name):
        """The values of a channel in the display window, which the data must fill."""
        (x0, y0, x1, y1), (left, top) = self.display, self.window[:2]
        rows = ((y - top) * self.width - left for y in range(y0, y1))
        return [value for row in rows for value in self.channels[name][row + x0:row + x1]]


def read_frame(path, values=None):
    """Decodes a file of scan lines. values(path, channel): all pixels of a channel, for what is packed by piz."""
    data = Path(path).read_bytes()
    if data[:4] != MAGIC:
        raise ValueError(f"{path}: expected an EXR file of scan lines")
    at, layout, window, display, compression = 8, [], None, None, None
    while data[at]:
        name_end = data.index(0, at)
        kind_end = data.index(0, name_end + 1)
        size, = struct.unpack_from("<i", data, kind_end + 1)
        value = data[kind_end + 5:kind_end + 5 + size]
        name = data[at:name_end].decode()
        at = kind_end + 5 + size
        if name == "channels":
            layout = read_channel_list(value)
        elif name == "dataWindow":
            window = read_box(value)
        elif name == "displayWindow":
            display = read_box(value)
        elif name == "compression":
            compression = COMPRESSIONS[value[0]]
    width, height = window[2] - window[0], window[3] - window[1]
    sample_bytes = width * height * sum(TYPES[kind][1] for _, kind in layout)
    if compression == "piz":  # what is printed has plain names and signs
        names = [plain_name(name)[0] for name, _ in layout]
        channels = {name: array("f", values(path, name)) for name in names}
    else:
        channels = plain_channels(read_blocks(data, at + 1, width, height, layout, compression))
    for name, plane in channels.items():
        if len(plane) != width * height:
            raise ValueError(f"{path}: {name}: {len(plane)} pixels, expected {width * height}")
    return Frame(window, display, channels, sample_bytes)


def plain_name(name):
    """Of a channel that may have Blender's name; and whether its values have the other sign."""
    layer = "ViewLayer."
    if name.startswith(layer):
        name = name[len(layer):]
        name = BLENDER_PASSES.get(name, name.removesuffix(".X"))
    return name.removeprefix("-"), name.startswith("-")


def plain_channels(channels):
    plain = {}
    for stored, plane in channels.items():
        name, is_negated = plain_name(stored)
        plain[name] = array("f", [-value for value in plane]) if is_negated else plane
    return plain


def read_box(value):
    """Half-open; in the file both corners belong to it."""
    x0, y0, x1, y1 = struct.unpack("<4i", value)
    return x0, y0, x1 + 1, y1 + 1


def read_channel_list(value):
    """[(name, type)], in file order."""
    at, layout = 0, []
    while value[at]:
        end = value.index(0, at)
        layout.append((value[at:end].decode(), struct.unpack_from("<i", value, end + 1)[0]))
        at = end + 17
    return layout


def read_blocks(data, table, width, height, layout, compression):
    """The planes of a scan-line file whose offset table is at `table`."""
    rows = ROWS_OF_A_BLOCK[compression]
    planes = {name: array("f") for name, _ in layout}
    row_bytes = width * sum(TYPES[kind][1] for _, kind in layout)
    for block in range((height + rows - 1) // rows):
        offset, = struct.unpack_from("<Q", data, table + 8 * block)
        size, = struct.unpack_from("<i", data, offset + 4)
        count = min(rows, height - block * rows)
        packed = data[offset + 8:offset + 8 + size]
        raw = packed if size == count * row_bytes else unpack(packed, compression)
        at = 0
        for _ in range(count):
            for name, kind in layout:
                letter, letter_bytes = TYPES[kind]
                planes[name].extend(struct.unpack_from(f"<{width}{letter}", raw, at))
                at += width * letter_bytes
    return planes


def unpack(packed, compression):
    """Undoes run lengths or zlib, then the differences and the two halves that both store."""
    coded = bytearray(unpack_runs(packed) if compression == "rle" else zlib.decompress(packed))
    for i in range(1, len(coded)):
        coded[i] = (coded[i - 1] + coded[i] - 128) & 255
    half = (len(coded) + 1) // 2
    raw = bytearray(len(coded))
    raw[0::2], raw[1::2] = coded[:half], coded[half:]
    return bytes(raw)


def unpack_runs(packed):
    at, raw = 0, bytearray()
    while at < len(packed):
        count = packed[at] - 256 if packed[at] > 127 else packed[at]
        if count < 0:
            raw += packed[at + 1:at + 1 - count]
            at += 1 - count
        else:
            raw += packed[at + 1:at + 2] * (count + 1)
            at += 2
    return raw


def values_by(program):
    """read_frame's `values` by a program that prints them."""

    def values(path, channel):
        done = subprocess.run([program, str(path), channel], capture_output=True, text=True, check=True)
        return [float(text) for text in done.stdout.split()]

    return values

"""Uncompressed EXR in, PNG out: what a comparison reads and shows. Pictures are float32 arrays (height, width, 3)."""

import struct
import zlib

import numpy as np

MAGIC = b"\x76\x2f\x31\x01"
SIZES = {1: 2, 2: 4}  # half, float


class Unreadable(Exception):
    """A file that is not what the comparison itself has written."""


def read_text(data, at):
    """A zero-terminated text; where it ends."""
    end = data.index(b"\0", at)
    return data[at:end].decode("ascii"), end + 1


def read_header(data, name):
    """Attributes of a scan-line file by name; where they end."""
    if data[:4] != MAGIC or struct.unpack_from("<I", data, 4)[0] not in (2, 0x402):
        raise Unreadable(f"{name}: expected an EXR file of scan lines")
    attributes, at = {}, 8
    while data[at] != 0:
        key, at = read_text(data, at)
        _, at = read_text(data, at)
        size = struct.unpack_from("<I", data, at)[0]
        attributes[key] = data[at + 4:at + 4 + size]
        at += 4 + size
    return attributes, at + 1


def channels_of(value):
    """Names and types (1: half, 2: float) in the order of the file."""
    channels, at = [], 0
    while value[at] != 0:
        name, at = read_text(value, at)
        channels.append((name, struct.unpack_from("<I", value, at)[0]))
        at += 16
    return channels


def read_exr(path):
    """R, G and B."""
    data = path.read_bytes()
    attributes, at = read_header(data, path)
    if attributes["compression"] != b"\0":
        raise Unreadable(f"{path}: expected no compression")
    left, top, right, bottom = struct.unpack("<4i", attributes["dataWindow"])
    width, height = right - left + 1, bottom - top + 1
    channels = channels_of(attributes["channels"])
    if any(kind not in SIZES for _, kind in channels) or not {"R", "G", "B"} <= {name for name, _ in channels}:
        raise Unreadable(f"{path}: expected R, G and B as floats, got {channels}")

    # Each line is its row, its size and one channel after the other; all are equally long.
    line = np.dtype([("row", "<i4"), ("size", "<i4")] +
                    [(name, "<f2" if kind == 1 else "<f4", (width,)) for name, kind in channels])
    lines = np.frombuffer(data, line, height, at + 8 * height)
    if np.any(lines["row"] != np.arange(top, bottom + 1)):
        raise Unreadable(f"{path}: expected lines from top to bottom")
    return np.stack([lines[name] for name in "RGB"], axis=-1).astype(np.float32)


def to_display(picture):
    """Linear radiance as sRGB, clamped to [0, 1]."""
    x = np.clip(picture, 0, 1)
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * np.power(x, 1 / 2.4) - 0.055)


def to_srgb(picture):
    """The same as 0 to 255."""
    return np.round(255 * to_display(picture)).astype(np.uint8)


def write_png(path, picture):
    """picture: uint8, (height, width, 3). Filter Paeth, which suits noise no worse than the others."""
    rows = picture.astype(np.int16)
    left = np.pad(rows, ((0, 0), (1, 0), (0, 0)))[:, :-1]
    up = np.pad(rows, ((1, 0), (0, 0), (0, 0)))[:-1]
    corner = np.pad(rows, ((1, 0), (1, 0), (0, 0)))[:-1, :-1]
    guess = left + up - corner
    a, b, c = (np.abs(guess - other) for other in (left, up, corner))
    paeth = np.where((a <= b) & (a <= c), left, np.where(b <= c, up, corner))
    lines = ((rows - paeth) & 255).astype(np.uint8).reshape(len(rows), -1)
    data = b"".join(b"\4" + line.tobytes() for line in lines)

    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    header = struct.pack(">IIBBBBB", rows.shape[1], rows.shape[0], 8, 2, 0, 0, 0)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(data, 9)) +
                     chunk(b"IEND", b""))


def sheet(rows, gap=4):
    """Pictures of one size side by side and one below the other, with white between. rows: lists of uint8 pictures."""
    def joined(parts, axis):
        edge = np.full_like(parts[0].take(range(gap), axis), 255)
        return np.concatenate([part for picture in parts for part in (picture, edge)][:-1], axis)

    return joined([joined(row, 1) for row in rows], 0)

"""EXR in, PNG out: what a comparison reads and shows. Pictures are float32 arrays (height, width, 3)."""

import struct
import sys
import zlib
from pathlib import Path

import numpy as np

sys.path.append(str(Path(__file__).resolve().parents[3] / "tests/system"))
from exr_frames import read_frame  # noqa: E402


def read_exr(path):
    """R, G and B."""
    frame = read_frame(path)
    planes = [np.array(frame.channels[name], np.float32) for name in "RGB"]
    return np.stack(planes, axis=-1).reshape(frame.height, frame.width, 3)


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

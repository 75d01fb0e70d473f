"""PNGs as people see frames: read, and left behind by tests of pictures. Standard library only."""

import struct
import zlib
from math import isfinite

from assets import png
from exr_frames import Frame


def read_png(path):
    """Width, height and the rows of RGB bytes of an 8-bit PNG."""
    data = path.read_bytes()
    if data[:8] != b"\x89PNG\r\n\x1a\n":
        raise ValueError(f"{path}: not a PNG")
    at, packed, size = 8, b"", None
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at:at + 8])
        body = data[at + 8:at + 8 + length]
        if kind == b"IHDR":
            size = struct.unpack(">II", body[:8])
        if kind == b"IDAT":
            packed += body
        at += 12 + length
    width, height = size
    raw, rows, before = zlib.decompress(packed), [], bytes(3 * width)
    for y in range(height):
        start = y * (3 * width + 1)
        row = bytearray(raw[start + 1:start + 1 + 3 * width])
        for i, up in enumerate(before):
            left = row[i - 3] if i >= 3 else 0
            left_up = before[i - 3] if i >= 3 else 0
            guess = {0: 0, 1: left, 2: up, 3: (left + up) // 2, 4: paeth(left, up, left_up)}[raw[start]]
            row[i] = (row[i] + guess) & 255
        rows.append(bytes(row))
        before = row
    return width, height, rows


def paeth(left, up, left_up):
    """The predictor of PNG."""
    guess = left + up - left_up
    return min((left, up, left_up), key=lambda value: abs(guess - value))


def srgb(linear):
    """The 8-bit value of linear light."""
    v = min(max(linear, 0), 1)
    return 255 * (12.92 * v if v <= 0.0031308 else 1.055 * v**(1 / 2.4) - 0.055)


def write_png(path, frame, shade):
    """The colours of a frame; shade: of a value, the 8-bit one that is shown. What is no number is white."""
    planes = ([int(shade(value)) if isfinite(value) else 255 for value in frame.channels[channel]] for channel in "RGB")
    texels = list(zip(*planes))
    path.write_bytes(png(frame.width, frame.height, lambda x, y: texels[y * frame.width + x]))


def leave_pictures(folder, got, expected):
    """Writes got.png, expected.png and difference.png of two frames. The difference is grey where both are equal, and black
    or white where they are farthest apart."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, frame in (("got", got), ("expected", expected)):
        write_png(folder / f"{name}.png", frame, srgb)
    if got.window == expected.window:
        apart = {c: [a - b for a, b in zip(got.channels[c], expected.channels[c])] for c in "RGB"}
        most = max((abs(value) for plane in apart.values() for value in plane if isfinite(value)), default=0) or 1
        difference = Frame(got.window, got.display, apart, 0)
        write_png(folder / "difference.png", difference, lambda value: 127.5 * (1 + value / most))

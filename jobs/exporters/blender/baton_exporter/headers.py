"""Headers of EXR and HDR files: whether Baton and Blender read the same pixels behind them. Standard library only.

Baton converts by what a header says: to Rec. 709, by exposures undone, into the display window, by a choice of parts and layers.
Blender reads numbers as they are. A file that says none of this is the same to both."""

import struct

EXR_MAGIC = struct.pack("<i", 20000630)
MULTIPART, DEEP, TILED = 0x1000, 0x800, 0x200
REC709 = (0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329)
SAME = 1e-3  # of chromaticities
RADIANCE_MAGIC = (b"#?RADIANCE", b"#?RGBE")
USUAL_SIDES = [b"-Y", b"+X"]
RADIANCE_COLORS = (b"EXPOSURE", b"COLORCORR", b"PRIMARIES")


def plain(data):
    """A file of which both read the same: as it is, or an HDR file without its colours. None where there is none.

    data: of the whole file."""
    try:
        if data[:4] == EXR_MAGIC:
            return data if is_plain_exr(data) else None
        return plain_radiance(data)
    except (ValueError, IndexError, KeyError, struct.error):
        return None


def is_plain_exr(data):
    flags, = struct.unpack_from("<i", data, 4)
    if flags & (MULTIPART | DEEP | TILED):
        return False
    attributes = exr_attributes(data)
    color = attributes.get("chromaticities")
    return (channels_of(attributes["channels"]) == [(b"B", 1, 1), (b"G", 1, 1), (b"R", 1, 1)]
            and attributes["dataWindow"] == attributes["displayWindow"]
            and (color is None or all(abs(a - b) < SAME for a, b in zip(struct.unpack("<8f", color), REC709))))


def exr_attributes(data):
    """Values by name."""
    found, at = {}, 8
    while data[at]:
        name_end = data.index(0, at)
        kind_end = data.index(0, name_end + 1)
        size, = struct.unpack_from("<i", data, kind_end + 1)
        found[data[at:name_end].decode()] = data[kind_end + 5:kind_end + 5 + size]
        at = kind_end + 5 + size
    return found


def channels_of(value):
    """Names and samplings."""
    found, at = [], 0
    while value[at]:
        end = value.index(0, at)
        found.append((value[at:end], *struct.unpack_from("<2i", value, end + 9)))
        at = end + 17
    return found


def plain_radiance(data):
    end = data.index(b"\n\n")
    lines = data[:end].split(b"\n")
    if lines[0] not in RADIANCE_MAGIC or lines.count(b"FORMAT=32-bit_rle_rgbe") != 1 or sides_of(data) != USUAL_SIDES:
        return None
    return b"\n".join(line for line in lines if not line.startswith(RADIANCE_COLORS)) + data[end:]


def is_turned(data):
    """Whether an HDR file has its rows or columns in another order than usual."""
    try:
        return data[:2] == b"#?" and sides_of(data) != USUAL_SIDES
    except ValueError:
        return False


def sides_of(data):
    """Such as -Y and +X."""
    return data[data.index(b"\n\n") + 2:].split(b"\n", 1)[0].split()[::2]

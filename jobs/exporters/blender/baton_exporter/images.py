"""The images of the world as files that a job reads; runs inside Blender."""

import shutil
from pathlib import Path

import bpy
import numpy

from . import exr, keys

LINEAR = {"Linear", "Raw", "Non-Color", "Linear ACEScg", "scene_linear"}
READ = {".exr", ".hdr"}


def export(texture, users, folder, frames, add):
    """`map` or numbered maps, and `filter`, of `environment`. add(what, remedy): reports.

    users: start, length, offset and cyclic of a sequence, for each frame."""
    image = texture.image
    check(texture, add)
    out = {"filter": "nearest"} if texture.interpolation == "Closest" else {}
    if image.source == "SEQUENCE":
        return {**out, **export_sequence(image, users, folder, frames, add)}
    return {**out, "map": copy(image, folder, "sky", add)}


def check(texture, add):
    image = texture.image
    if texture.interpolation in ("Cubic", "Smart"):
        add(f"interpolation {texture.interpolation}, read as Linear", "choose Linear")
    if image.colorspace_settings.name not in LINEAR | {"sRGB"}:
        add(f'the colour space "{image.colorspace_settings.name}" of its image', "save it as a linear EXR")
    if image.source not in ("FILE", "GENERATED", "SEQUENCE"):
        add(f"its image is of kind {image.source.lower()}", "save it as one EXR, or as a sequence of them")


def is_readable(image):
    """Whether its file is there, or it needs none. Reading the size loads it."""
    return min(image.size) > 0


def copy(image, folder, name, add):
    """Writes an image as EXR or HDR, as it is where it can be read so; its file name."""
    suffix = Path(image.filepath).suffix.lower()
    if suffix in READ and image.colorspace_settings.name in LINEAR and not image.is_dirty:
        target = folder / (name + suffix)
        path = Path(bpy.path.abspath(image.filepath, library=image.library))
        if image.packed_file:
            target.write_bytes(image.packed_file.data)
            return target.name
        if path.is_file():
            shutil.copyfile(path, target)
            return target.name
    if not is_readable(image):
        add(f'its image "{image.name}" cannot be read', "find the file (File > External Data)")
        return write_plain(folder / f"{name}.exr", (1, 0, 1))
    return write(folder / f"{name}.exr", *linear_pixels(image))


def linear_pixels(image):
    """(height, width, 3) from the lowest row up."""
    width, height = image.size
    values = numpy.empty(width * height * image.channels, numpy.float32)
    image.pixels.foreach_get(values)
    values = values.reshape(height, width, image.channels)
    color = values[..., :3] if image.channels >= 3 else numpy.repeat(values[..., :1], 3, axis=2)
    if not image.is_float and image.colorspace_settings.name == "sRGB":
        color = numpy.where(color <= 0.04045, color / 12.92, ((color + 0.055) / 1.055) ** 2.4)
    return color, width, height


def write(path, color, width, height):
    """An EXR of 32-bit numbers; its file name. color: (height, width, 3) from the lowest row up."""
    rows = numpy.asarray(color, "<f4")[::-1, :, ::-1]
    exr.write(path, width, height, (row.T.tobytes() for row in rows))
    return Path(path).name


def write_plain(path, color):
    return write(path, numpy.broadcast_to(numpy.array(color, numpy.float32), (8, 16, 3)), 16, 8)


def export_sequence(image, users, folder, frames, add):
    """The files that the frames show, each once; under numbers of frames where each frame has one of its own."""
    given = Path(bpy.path.abspath(image.filepath, library=image.library))
    numbers = [keys.sequence_number(frame, *user) for frame, user in zip(frames, users)]
    files = {}
    for number in sorted(set(numbers)):
        name = keys.numbered_file(given.name, number)
        path = given.with_name(name) if name else given
        if not path.is_file():
            add(f"its image {path.name} is not there", "mend start frame, offset and length of the sequence")
            continue
        files[number] = path
    if not files:
        return {"map": write_plain(folder / "sky.exr", (1, 0, 1))}
    # A missing one is replaced by the nearest.
    shown = [min(files, key=lambda n, number=number: abs(n - number)) for number in numbers]
    target = folder / "sky"
    target.mkdir(exist_ok=True)
    names = {number: f"sky/{copy_numbered(image, files[number], target, number)}" for number in sorted(set(shown))}
    if shown == frames and all(name == f"sky/sky.{n:04}{Path(name).suffix}" for n, name in names.items()):
        return {"frames": "sky/sky.####" + Path(names[shown[0]]).suffix}
    changes = [i for i, number in enumerate(shown) if i == 0 or number != shown[i - 1]]
    return {"keys": [{"frame": frames[i], "map": names[shown[i]]} for i in changes], "interpolate": False}


def copy_numbered(image, path, folder, number):
    suffix = path.suffix.lower()
    if suffix in READ and image.colorspace_settings.name in LINEAR:
        shutil.copyfile(path, folder / f"sky.{number:04}{suffix}")
        return f"sky.{number:04}{suffix}"
    single = bpy.data.images.load(str(path))
    single.colorspace_settings.name = image.colorspace_settings.name
    name = write(folder / f"sky.{number:04}.exr", *linear_pixels(single))
    bpy.data.images.remove(single)
    return name

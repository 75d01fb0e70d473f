"""The images of the world as files that a job reads; runs inside Blender."""

from pathlib import Path

import bpy
import numpy

from . import exr, headers, keys

LINEAR = {"Linear", "Raw", "Non-Color"}
READ = {".exr", ".hdr"}
FLOATS = {"OPEN_EXR", "OPEN_EXR_MULTILAYER", "HDR"}
WITH_ALPHA = {32, 64, 128}  # bits of a pixel
ASSOCIATED = {"STRAIGHT", "PREMUL"}  # modes of alpha in which Cycles multiplies colours by it


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
    """Writes an image as EXR or HDR, as it is where Baton reads the same of it as Blender; its file name."""
    data = None if image.is_dirty else stored(image, Path(bpy.path.abspath(image.filepath, library=image.library)))
    if data is not None and headers.is_turned(data):
        add(f'the order of rows and columns in its image "{image.name}", which Cycles does not heed', "save it anew")
    data = readable(image, data)
    if data:
        target = (folder / name).with_suffix(Path(image.filepath).suffix.lower())
        target.write_bytes(data)
        return target.name
    if not is_readable(image):
        add(f'its image "{image.name}" cannot be read', "find the file (File > External Data)")
        return write_plain(folder / f"{name}.exr", (1, 0, 1))
    return write(folder / f"{name}.exr", *linear_pixels(image))


def stored(image, path):
    """The bytes of an image's file; None without one."""
    if image.packed_file:
        return image.packed_file.data
    return path.read_bytes() if path.is_file() else None


def readable(image, data):
    """A file of which Baton reads what Blender reads, else None. data: of the image's file, None without one."""
    if data is None or Path(image.filepath).suffix.lower() not in READ or image.colorspace_settings.name not in LINEAR:
        return None
    return headers.plain(data)


def linear_pixels(image):
    """What Cycles shows of an image: (height, width, 3) from the lowest row up, width, height."""
    color = values_of(image, image.alpha_mode in ASSOCIATED)[..., :3]
    if image.colorspace_settings.name == "sRGB" and not image.is_float:
        color = to_linear(color)
    return color, *image.size


def values_of(image, is_associated):
    """(height, width, 4) from the lowest row up, of floats linear, else as they are stored. is_associated: colours are
    multiplied by alpha, as files store them; Blender does so when light is linear."""
    width, height = image.size
    # What Blender does with alpha when it loads a file is left out.
    is_raw = (is_associated and image.source in ("FILE", "SEQUENCE") and image.file_format not in FLOATS
              and not (image.is_dirty or image.packed_file))
    mode = image.alpha_mode
    if is_raw and mode != "CHANNEL_PACKED":
        image.alpha_mode = "CHANNEL_PACKED"
    values = numpy.empty(width * height * image.channels, numpy.float32)
    image.pixels.foreach_get(values)
    if image.alpha_mode != mode:
        image.alpha_mode = mode
    values = values.reshape(height, width, image.channels)
    if image.channels < 3:
        values = numpy.repeat(values[..., :1], 3, axis=2)
    alpha = values[..., 3:] if image.channels == 4 else numpy.ones((height, width, 1), numpy.float32)
    color = values[..., :3]
    if is_associated and (is_raw or not image.is_float):
        if not image.is_float:  # Cycles cuts to whole numbers, too
            color = numpy.floor(255 * color * alpha + 1e-3) / 255
        elif image.colorspace_settings.name == "sRGB":
            color = to_linear(to_srgb(color) * alpha)
        else:
            color = color * alpha
    return numpy.concatenate((color, alpha), axis=2)


def as_shown(image, is_alpha_used):
    """An image that shows without its alpha mode what Cycles shows of this one. Colours count times alpha where nothing takes
    its alpha."""
    if image.alpha_mode == "CHANNEL_PACKED" or image.depth not in WITH_ALPHA or is_alpha_used and image.alpha_mode != "NONE":
        return image
    name = f"{image.name}, {image.alpha_mode.lower()}"[-60:]
    if name in bpy.data.images:
        return bpy.data.images[name]
    values = values_of(image, image.alpha_mode in ASSOCIATED)
    if image.is_float and image.colorspace_settings.name == "sRGB":
        values = to_srgb(values)
    values[..., 3] = 1
    return image_of(name, image, values)


def alpha_alone(image):
    """White with the alpha of an image, which a glTF file has beside a colour."""
    values = values_of(image, False)
    values[..., :3] = 1
    return image_of(f"alpha of {image.name}"[:60], image, values)


def image_of(name, source, values):
    """A new image of bytes."""
    made = bpy.data.images.new(name, *source.size, alpha=True)
    made.alpha_mode = "CHANNEL_PACKED"
    made.colorspace_settings.name = source.colorspace_settings.name
    made.pixels.foreach_set(values.astype(numpy.float32).ravel())
    return made


def to_linear(color):
    return numpy.where(color <= 0.04045, color / 12.92, ((color + 0.055) / 1.055) ** 2.4)


def to_srgb(color):
    return numpy.where(color <= 0.0031308, color * 12.92, 1.055 * numpy.maximum(color, 0.0031308) ** (1 / 2.4) - 0.055)


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
    data = readable(image, path.read_bytes())
    if data:
        (folder / f"sky.{number:04}{suffix}").write_bytes(data)
        return f"sky.{number:04}{suffix}"
    single = bpy.data.images.load(str(path))
    single.colorspace_settings.name, single.alpha_mode = image.colorspace_settings.name, image.alpha_mode
    name = write(folder / f"sky.{number:04}.exr", *linear_pixels(single))
    bpy.data.images.remove(single)
    return name

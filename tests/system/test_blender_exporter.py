#!/usr/bin/env python3
"""The Blender exporter. Without Blender its arithmetic: axes of the map, angles of view, keys, frame numbers, and animations
that Baton reads. With Blender what files become, and what the report says of them."""

import itertools
import json
import math
import os
import shutil
import struct
import subprocess
import sys
from pathlib import Path

from farm import check, check_equal, run_tests
from jobs import make_job, write_job

ROOT = Path(__file__).parents[2]
sys.path += [str(ROOT / "jobs/exporters/blender/baton_exporter"), str(ROOT / "jobs/examples")]
import conventions  # noqa: E402
import exr  # noqa: E402
import gltf_materials  # noqa: E402
import headers  # noqa: E402
import keys  # noqa: E402
from folders import new_numbered  # noqa: E402
from glb import Glb, tracks_of, weights_of  # noqa: E402
from make_gltf_set import make_set  # noqa: E402
from report import Report  # noqa: E402

DIRECTIONS = [v for v in itertools.product((-0.8, 0.1, 0.7), repeat=3)]


def close(got, wanted, what, within=1e-6):
    pairs = list(zip(got, wanted)) if isinstance(got, (list, tuple)) else [(got, wanted)]
    check(all(abs(a - b) <= within for a, b in pairs), f"{what}: got {got}, expected {wanted}")


def applied(matrix, v):
    return [sum(a * b for a, b in zip(row, v)) for row in matrix]


def texel(side, ahead, up):
    """Column and row in a lat-long map that has `ahead` in its centre and `side` a quarter to the left."""
    return 0.5 - math.atan2(side, ahead) / (2 * math.pi), math.acos(up / math.hypot(side, ahead, up)) / math.pi


def map_of_every_mapping(_programs, _folder):
    """Both renderers read the same texel in every direction, however the Mapping node turns the map."""
    for kind, angles in itertools.product(("POINT", "TEXTURE", "VECTOR"), ((0, 0, 0), (0, 0, 0.7), (0.3, -1.1, 2.5))):
        lookup = conventions.mapping_lookup(kind, (0, 0, 0), angles, (2, 2, 2))
        to_map = conventions.transposed(conventions.map_rotation(lookup))
        for v in DIRECTIONS:
            x, y, z = applied(lookup, v)
            a, b, c = applied(to_map, conventions.to_baton(v))
            close(texel(a, c, b), texel(y, x, z), f"{kind} {angles}, texel along {v}")
    # What the nodes do, written out: POINT turns by Rz Ry Rx, TEXTURE undoes it.
    close(applied(conventions.mapping_lookup("POINT", (0, 0, 0), (0, 0, math.pi / 2), (1, 1, 1)), (1, 0, 0)), (0, 1, 0), "POINT")
    close(applied(conventions.mapping_lookup("TEXTURE", (0, 0, 0), (0, 0, math.pi / 2), (1, 1, 1)), (1, 0, 0)), (0, -1, 0),
          "TEXTURE")
    x_then_z = conventions.mapping_lookup("VECTOR", (9, 0, 0), (math.pi / 2, 0, math.pi / 2), (1, 1, 1))
    close(applied(x_then_z, (0, 1, 0)), (0, 0, 1), "first about x, then about z")


def mappings_that_are_no_rotation(_programs, _folder):
    for location, scale in (((1, 0, 0), (1, 1, 1)), ((0, 0, 0), (1, -1, 1)), ((0, 0, 0), (1, 2, 1)), ((0, 0, 0), (0, 0, 0)),
                            ((0, 0, 0), (-1, -1, -1))):
        try:
            conventions.mapping_lookup("POINT", location, (0, 0, 0), scale)
        except conventions.NotARotation:
            continue
        check(False, f"location {location}, scale {scale} is taken for a rotation")


def angles_of_rotations(_programs, _folder):
    for degrees in (-170, -40, 0, 50, 179):
        turned = conventions.turn(1, math.radians(degrees))
        close(conventions.up_angle(turned), degrees, "angle about up")
        lookup = conventions.mapping_lookup("POINT", (0, 0, 0), (0, 0, math.radians(degrees)), (1, 1, 1))
        expected = (90 - degrees + 180) % 360 - 180
        close(conventions.up_angle(conventions.map_rotation(lookup)), expected, "angle of a Mapping node")
    check_equal(conventions.up_angle(conventions.turn(0, 0.1)), None, "angle about up of a tilt")
    for axis, degrees in (([0, 0.6, 0.8], 120), ([1, 0, 0], 180), ([-0.6, 0, 0.8], 1)):
        rotation = about(axis, math.radians(degrees))
        got_axis, got_degrees = conventions.axis_angle(rotation)
        close(got_degrees, degrees, f"angle about {axis}", 1e-5)
        close(got_axis, axis, "axis", 1e-5)
    check_equal(conventions.axis_angle(about([1, 0, 0], 0)), ([0.0, 1.0, 0.0], 0.0), "no rotation")


def about(axis, angle):
    """Rodrigues' formula."""
    x, y, z = axis
    cross = [[0, -z, y], [z, 0, -x], [-y, x, 0]]
    square = conventions.product(cross, cross)
    return [[float(i == j) + math.sin(angle) * cross[i][j] + (1 - math.cos(angle)) * square[i][j] for j in range(3)]
            for i in range(3)]


def mappings_of_textures(_programs, _folder):
    """What a Mapping node of each type does to UVs, as glTF says it: scaled, turned, moved."""
    for angle, scale in itertools.product((0, 0.7, -2, math.pi / 2, math.pi), ((1, 1), (2, 2), (-1.5, 1.5), (0.5, 3), (-2, 0.5))):
        c, s = math.cos(angle), math.sin(angle)
        location = (0.3, -0.8)
        place = conventions.uv_mapping("TEXTURE", location, angle, scale)
        is_stretch = abs(abs(scale[0]) - abs(scale[1])) > 1e-9 and min(abs(c), abs(s)) > 1e-9
        check_equal(place is None, is_stretch, f"whether {angle}, {scale} cannot be said")
        for u, v in ((0, 0), (1, 0), (0.2, 0.9)) if place else ():
            x, y = u - location[0], v - location[1]
            expected = ((c * x + s * y) / scale[0], (c * y - s * x) / scale[1])
            moved, turned, scaled = place
            x, y = u * scaled[0], v * scaled[1]
            got = (math.cos(turned) * x - math.sin(turned) * y + moved[0], math.sin(turned) * x + math.cos(turned) * y + moved[1])
            close(got, expected, f"TEXTURE {angle} {scale} at {u}, {v}")
    check_equal(conventions.uv_mapping("TEXTURE", (0, 0), 0, (0, 1)), None, "scale of 0")
    check_equal(conventions.uv_mapping("POINT", (1, 2), 3, (4, 5)), ((1, 2), 3, (4, 5)), "POINT")


def files_that_are_read_alike(_programs, folder):
    """Copied: what says no colours, windows or layers of its own. Exposures of an HDR file are left out."""
    folder.mkdir()
    exr.write(folder / "plain.exr", 2, 1, [bytes(24)])
    plain = (folder / "plain.exr").read_bytes()
    check_equal(headers.plain(plain), plain, "an EXR file that says nothing")

    def with_attribute(*attribute):
        return plain[:8] + exr.attribute(*attribute) + plain[8:]

    for xy, is_plain in ((headers.REC709, True), ((0.713, 0.293, 0.165, 0.83, 0.128, 0.044, 0.322, 0.338), False), ((0,) * 8, False)):
        said = with_attribute("chromaticities", "chromaticities", struct.pack("<8f", *xy))
        check_equal(headers.plain(said) is not None, is_plain, f"chromaticities {xy}")
    window = plain.index(b"displayWindow")
    for what, changed in (("another window", plain[:window + 24] + b"\7" + plain[window + 25:]),
                          ("several parts", plain[:5] + b"\x10" + plain[6:]),
                          ("another channel", plain.replace(b"B\0\2", b"Z\0\2", 1)),
                          ("half of it", plain[:60]), ("another file", b"\x89PNG" + plain)):
        check_equal(headers.plain(changed), None, what)
    start, end = b"#?RADIANCE\n", b"FORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n12345678"
    check_equal(headers.plain(start + end), start + end, "an HDR file that says nothing")
    for line in (b"EXPOSURE=2\n", b"COLORCORR=1 2 3\n", b"PRIMARIES=0 0 0 0 0 0 0 0\n"):
        check_equal(headers.plain(start + line + end), start + end, f"{line}")
    for what, changed in (("XYZ", end.replace(b"rgbe", b"xyze")), ("no format", end[23:]), ("rows", end.replace(b"-Y", b"+Y"))):
        check_equal(headers.plain(start + changed), None, what)
    check(headers.is_turned(start + end.replace(b"-Y", b"+Y")) and not headers.is_turned(start + end), "order of rows")


def cameras(_programs, _folder):
    """Numbers of Blender's interface: a sensor of 36 x 24 mm and 50 mm give 39.5978 degrees across."""
    across = 39.597752
    for width, height, fit, horizontal in ((1920, 1080, "AUTO", across), (1080, 1920, "HORIZONTAL", across)):
        fov = conventions.vertical_fov_deg(width, height, fit, 36, 24, 50)
        again = 2 * math.degrees(math.atan(math.tan(math.radians(fov / 2)) * width / height))
        close(again, horizontal, f"horizontal angle of {fit}", 1e-4)
    close(conventions.vertical_fov_deg(1080, 1920, "AUTO", 36, 24, 50), across, "AUTO, upright", 1e-4)
    close(conventions.vertical_fov_deg(1920, 1080, "VERTICAL", 36, 24, 50), 2 * math.degrees(math.atan(12 / 50)), "VERTICAL")
    close(conventions.orthographic_height(320, 180, "AUTO", 6), 3.375, "orthographic height")
    close(conventions.orthographic_height(320, 180, "VERTICAL", 6), 6, "orthographic height, VERTICAL")
    close(conventions.shift_in_heights(320, 160, "AUTO", 0.1, -0.2), (0.2, -0.4), "shift by the longer side")
    close(conventions.shift_in_heights(320, 160, "VERTICAL", 0.1, -0.2), (0.1, -0.2), "shift by the height")
    close(conventions.aperture(False, 50, 2.8), 0.05 / 2.8, "aperture")
    close(conventions.aperture(True, 50, 4), 0.25, "orthographic aperture")
    check_equal(conventions.region(100, 50, 0.1, 0.6, 0.2, 0.5), [10, 25, 50, 15], "region from the upper left corner")
    check_equal(conventions.region(300, 360, 0.1, 0.95, 0.2, 0.9), [30, 36, 255, 252], "region in 32-bit numbers")


def keys_are_reduced(_programs, _folder):
    frames = [1, 2, 3, 5, 6]
    rows = [[2 * f, 7] for f in frames]
    check_equal(keys.reduce_linear(frames, rows, 1e-9), [0, 4], "keys of a line")
    check_equal(keys.reduce_linear(frames, [[3]] * 5, 1e-9), [0], "keys of a constant")
    bent = [[0], [1], [2], [2], [2]]
    check_equal(keys.reduce_linear(frames, bent, 1e-9), [0, 2, 4], "keys of a bend")
    curve = [[f * f] for f in range(40)]
    kept = keys.reduce_linear(list(range(40)), curve, 3)
    check(len(kept) < 20, f"{len(kept)} keys of a parabola")
    for first, last in zip(kept, kept[1:]):
        for f in range(first, last):
            line = first ** 2 + (last ** 2 - first ** 2) * (f - first) / (last - first)
            check(abs(line - f * f) <= 3, f"frame {f} is off by {line - f * f}")
    check_equal(keys.unwrapped([170, -170, -150, 160]), [170, 190, 210, 160], "angles across half a turn")
    close(keys.constant_speed(frames, [4 * f for f in frames], 1e-9), 4, "speed per frame number")
    check_equal(keys.constant_speed(frames, [0, 1, 2, 3, 4], 1e-9), None, "speed where a frame is left out")


def frame_numbers(_programs, _folder):
    check_equal([keys.frame_text(*f) for f in ((1, 24), (1, 24, 2), (7, 7), (5, 6, 4))], ["1-24", "1-24x2", "7", "5"], "texts")
    check_equal(keys.parse_frames("1,5,9-12"), [1, 5, 9, 10, 11, 12], "frames")
    check_equal(keys.parse_frames("1-10x4"), [1, 5, 9], "frames with a step")
    for text in ("", "a", "3,2", "1-", "-4"):
        try:
            keys.parse_frames(text)
        except ValueError:
            continue
        check(False, f'"{text}" is taken for frames')
    held = [keys.sequence_number(f, 3, 4, 100, False) for f in (3, 4, 6, 9)]
    check_equal(held, [101, 102, 104, 104], "a sequence that starts at frame 3 and holds")
    cyclic = [keys.sequence_number(f, 1, 4, 100, True) for f in (0, 1, 4, 5, 9)]
    check_equal(cyclic, [104, 101, 104, 101, 101], "a cyclic sequence")
    check_equal(keys.numbered_file("v2_sun_0099.exr", 100), "v2_sun_0100.exr", "name of a file")
    check_equal(keys.numbered_file("sun.exr", 1), None, "name without a number")


def animations_that_baton_reads(programs, folder):
    """Tracks keep the sign of quaternions, leave out what is constant, and move the nodes of the file."""
    half = math.sqrt(0.5)
    places = [((i, 0, 0), q, (1, 1, 1)) for i, q in enumerate([(0, 0, 0, 1), (0, half, 0, half), (0, 0, 0, -1)])]
    tracks = tracks_of(0, places)
    check_equal([path for _, path, _ in tracks], ["translation", "rotation"], "tracks")
    check(all(sum(a * b for a, b in zip(*pair)) >= 0 for pair in itertools.pairwise(tracks[1][2])), "a quaternion changes its sign")
    folder.mkdir()
    (folder / "set.glb").write_bytes(make_set(3))
    file = Glb.read(folder / "set.glb")
    file.document.pop("animations")
    ball = next(i for i, node in enumerate(file.document["nodes"]) if node["name"] == "ball")
    file.animate("shot", [(ball, "translation", [[0, 0.3, 0], [1, 0.3, 0]])], [1 / 24, 3 / 24])
    check_equal(file.document["animations"][0]["channels"][0]["target"]["node"], ball, "node that moves")
    file.write(folder / "moved.glb")
    job = make_job(folder, frames="1-3")
    del job["camera"]
    moved = {}
    for name in ("moved", "still"):
        if name == "still":
            file.document.pop("animations")
            file.write(folder / "still.glb")
        job["scene"] = {"gltf": {"file": f"{name}.glb"}}
        checked = programs.checked(write_job(folder / f"{name}.json", job))
        moved[name] = checked.get("motionMaxPx", 0)
    check(moved["moved"] > 1 and moved["still"] <= 1, f"motion in pixels: {moved}")


def shapes_of_frames(programs, folder):
    """What deforms has a target for each frame in which it is another than in the first one, and Baton follows it."""
    rows = [row[0] for row in weights_of([None, "bent", None, "flat"])]
    check_equal(rows, [0, 0, 1, 0, 0, 0, 0, 1], "weights of two targets in four frames")
    folder.mkdir()
    (folder / "set.glb").write_bytes(make_set(1, alive=True))
    file = Glb.read(folder / "set.glb")
    drop = next(i for i, node in enumerate(file.document["nodes"]) if node["name"] == "drop")
    del file.document["nodes"][drop]["translation"]
    file.document["animations"] = []
    file.animate("shot", [(drop, "weights", weights_of([None, "flat", None]))], [1 / 24, 2 / 24, 3 / 24])
    file.write(folder / "moved.glb")
    job = make_job(folder, frames="1-3")
    job["scene"] = {"gltf": {"file": "moved.glb"}}
    checked = programs.checked(write_job(folder / "job.json", job))
    check(checked["motionMaxPx"] > 1, f"motion of {checked['motionMaxPx']} pixels")


def images_that_baton_reads(programs, folder):
    folder.mkdir()
    lines = [struct.pack("<6f", *(10 * y + i for i in range(6))) for y in range(3)]  # B B G G R R
    exr.write(folder / "sky.exr", 2, 3, lines)
    for channel, first in (("B", 0), ("G", 2), ("R", 4)):
        wanted = [10.0 * y + first + x for y in range(3) for x in range(2)]
        check_equal(programs.values(folder / "sky.exr", channel), wanted, f"channel {channel}")


def diffuse_materials(_programs, _folder):
    """An image with its place on the surface, as the job's own textures have it."""
    turned = {"KHR_texture_transform": {"offset": [0.1, 0.2], "rotation": math.pi / 2, "scale": [2, 3]}}
    document = {"textures": [{"source": 4, "sampler": 0}], "samplers": [{"wrapS": 33071, "magFilter": 9728}]}
    material = {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0, "texCoord": 1, "extensions": turned}}}
    got = gltf_materials.diffuse(document, material, "scene.glb")
    check_equal(got["colorTexture"], {"file": "scene.glb", "image": 4, "wrapU": "clamp", "filter": "nearest", "uv": 1,
                                      "offset": [0.1, 0.2], "scale": [2, 3], "rotateDeg": 90.0}, "texture")
    document = {"materials": [{"extensions": {"KHR_materials_specular": {"specularColorFactor": [0, 0, 0]}}}]}
    gltf_materials.mend(document)
    check_equal(document["materials"][0]["extensions"]["KHR_materials_specular"], {"specularFactor": 0}, "no reflection")
    document = {"materials": [{}, {"extensions": {"KHR_materials_clearcoat": {"clearcoatFactor": 0.8,
                                                                              "clearcoatRoughnessFactor": 0.1}}}]}
    gltf_materials.mend(document)
    check_equal(document["materials"][1]["extensions"]["KHR_materials_clearcoat"],
                {"clearcoatFactor": 0.2, "clearcoatRoughnessFactor": 0.1}, "a quarter of the coat")


def reports(_programs, _folder):
    report = Report()
    check_equal(report.text(), "Everything is carried over.\n", "empty report")
    for _ in range(2):
        report.add('light "Sun"', "a sun lamp", "put it into the map")
    check_equal(report.text(), '1 thing is not carried over:\n- light "Sun": a sun lamp. Remedy: put it into the map.\n', "report")


def numbered_folders(_programs, folder):
    check_equal([new_numbered(folder / "shot").name for _ in range(2)], ["0001", "0002"], "folders")
    (folder / "shot/0001").rmdir()
    (folder / "shot/0017").mkdir()
    (folder / "shot/notes").mkdir()
    check_equal(new_numbered(folder / "shot").name, "0018", "folder after others")


def files_of_blender(programs, folder):
    """What each of many small files becomes (blender_cases.py). The report says what is lost, and no more; the job is one."""
    if not shutil.which("blender"):
        print("blender is not there: left out")
        return
    script = Path(__file__).with_name("blender_cases.py")
    environment = {**os.environ, "PATH": "/usr/bin:" + os.environ["PATH"]}  # Debian's Blender needs Debian's Python
    done = subprocess.run(["blender", "-b", "--factory-startup", "--python-exit-code", "1", "-P", str(script), "--",
                           str(ROOT / "jobs/exporters/blender"), str(folder)],
                          capture_output=True, text=True, check=False, env=environment)
    check_equal(done.returncode, 0, done.stdout + done.stderr)
    check("Traceback" not in done.stdout + done.stderr, done.stdout + done.stderr)
    wrong = []
    for name, told in json.loads((folder / "cases.json").read_text()).items():
        lines = [line for line in told["report"].splitlines() if line.startswith(("- ", "Blender's"))]
        if len(lines) != len(told["expected"]) or any(all(text not in line for line in lines) for text in told["expected"]):
            wrong.append(f"{name}: the report is {told['report']!r}, expected {told['expected']}")
        elif (folder / name / "job/job.json").exists():
            checked = programs.run("baton", "check", folder / name / "job/job.json", expect=None)
            if checked.returncode:
                wrong.append(f"{name}: {checked.stderr}")
    check(not wrong, "\n" + "\n".join(wrong))
    environments = {name: json.loads((folder / name / "job/job.json").read_text())["environment"]
                    for name in ("strength_from_zero", "world_hidden_from_rays", "camera_sees_an_image",
                                 "camera_sees_what_changes", "sequence_with_a_keyed_offset")}
    check_equal(environments["strength_from_zero"]["scaleKeys"][0], {"frame": 1, "scale": 0}, "first key of the strength")
    check_equal(environments["world_hidden_from_rays"]["cameraMap"], "backdrop.exr", "what the camera sees")
    check_equal(programs.values(folder / "world_hidden_from_rays/job/backdrop.exr", "R"), [0.0] * 128, "that it is black")
    check_equal(environments["camera_sees_an_image"]["cameraMap"], {"file": "backdrop.exr", "scale": 0.5}, "image seen")
    check_equal(environments["camera_sees_what_changes"]["map"], "sky.exr", "light")
    check_equal([key["map"][-8:-4] for key in environments["sequence_with_a_keyed_offset"]["keys"]], ["0001", "0003", "0004"],
                "images of a keyed offset")
    for name in ("hidden_with_the_playhead_before", "hidden_with_the_playhead_behind", "faces_that_come_later"):
        nodes = [node["name"] for node in Glb.read(folder / name / "job/scene.glb").document["nodes"]]
        check("ball" in nodes, f"{name}: nodes {nodes}")
    check_uv_sets(folder / "uv_maps_in_another_order/job/scene.glb")
    submitted = (folder / "submits_of_one_file/submitted").read_text().split()
    check(len(set(submitted)) == 2 and all(Path(job).is_file() for job in submitted), f"submitted: {submitted}")


def check_uv_sets(path):
    """Both sheets have what is named a, b, c where their materials read it, whatever the order in the file."""
    file = Glb.read(path)
    sheets = [mesh for mesh in file.document["meshes"] if mesh["name"].startswith("sheet")]
    check_equal(len(sheets), 2, "sheets")
    for mesh in sheets:
        read = []
        for part in mesh["primitives"]:
            surface = file.document["materials"][part["material"]]["pbrMetallicRoughness"]
            for name in ("baseColorTexture", "metallicRoughnessTexture"):
                if name in surface:
                    accessor = file.document["accessors"][part["attributes"][f"TEXCOORD_{surface[name].get('texCoord', 0)}"]]
                    start = file.document["bufferViews"][accessor["bufferView"]]["byteOffset"] + accessor.get("byteOffset", 0)
                    read.append(struct.unpack_from("<f", file.binary, start)[0])
        check_equal(sorted(read), [0, 0.25, 0.5], f"first coordinate of {mesh['name']} by a, b and c")


if __name__ == "__main__":
    sys.dont_write_bytecode = True
    run_tests()

#!/usr/bin/env python3
"""What of a comparison with another renderer needs no other renderer: axes and angles, statistics, files."""

import json
import math
import subprocess
import sys
from pathlib import Path

import numpy as np

TESTS = Path(__file__).resolve().parents[1]
PEERS = TESTS.parent / "jobs/lab/peers"
sys.path += [str(PEERS), str(TESTS / "system")]
import compare_gltf  # noqa: E402
import conventions  # noqa: E402
import errors  # noqa: E402
import gltf_scenes  # noqa: E402
import pictures  # noqa: E402
from farm import BAD_INPUT, check, check_equal, run_tests  # noqa: E402
from jobs import make_job, write_job  # noqa: E402
from png_files import read_png  # noqa: E402

random = np.random.default_rng(7)


def check_close(got, expected, what, within=1e-5):
    apart = float(np.max(np.abs(np.asarray(got, float) - np.asarray(expected, float))))
    check(apart <= within, f"{what}: got {got}, expected {expected}")


def some_directions(count):
    v = random.normal(size=(count, 3))
    return v / np.linalg.norm(v, axis=1, keepdims=True)


def some_rotation():
    q, r = np.linalg.qr(random.normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    return q if np.linalg.det(q) > 0 else -q


def about(axis, angle):
    """Rotation about axis number `axis`, right-handed."""
    m = np.eye(3)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    m[i, i] = m[j, j] = math.cos(angle)
    m[i, j], m[j, i] = -math.sin(angle), math.sin(angle)
    return m


def place(programs, folder, expect=0, lacquer=None, **changes):
    """Runs placed_scene on a job with changes and that material; returns the process and what it wrote, if anything."""
    job = make_job(folder, **changes)
    job["scene"]["materials"]["lacquer"] = lacquer or {"type": "diffuse"}
    path = write_job(folder / "job.json", job)
    done = programs.run("placed_scene", path, folder / "placed", expect=expect)
    scene = folder / "placed/scene.json"
    return done, json.loads(scene.read_text(encoding="utf-8")) if scene.exists() else None


# ---- axes and angles ----------------------------------------------------------------------------------------


def a_map_lies_alike(_programs, _folder):
    for w in some_directions(200):
        check_close(conventions.cycles_texel(conventions.to_blender(w), 64, 32), conventions.baton_texel(w, 64, 32),
                    f"texel along {w}", 1e-4)


def a_turned_map_lies_alike(_programs, _folder):
    rotations = [some_rotation() for _ in range(50)] + [about(0, math.pi / 2), about(1, -math.pi / 2), np.eye(3)]
    for rotation in rotations:
        a, b, c = conventions.map_euler(rotation.ravel().tolist())
        lookup = about(2, c) @ about(1, b) @ about(0, a)
        for w in some_directions(5):
            check_close(lookup @ conventions.to_blender(w), conventions.to_blender(rotation.T @ w),
                        f"direction {w} in a map turned by {rotation}")


def objects_stand_alike(_programs, _folder):
    for _ in range(20):
        m, p = random.normal(size=(3, 4)), random.normal(size=3)
        got = np.array(conventions.object_matrix(m.ravel().tolist())) @ [*conventions.to_blender(p), 1]
        check_close(got[:3], conventions.to_blender(m[:, :3] @ p + m[:, 3]), "a placed point")


def the_camera_sees_alike(programs, folder):
    """A point of the world is where its pixel says, from the job's own numbers to Blender's matrix and lens."""
    eye, target, fov, width, height = np.array([1.0, 2.0, 3.0]), np.array([0.2, 0.5, -1.0]), 35.0, 64, 48
    camera = {"position": eye.tolist(), "lookAt": target.tolist(), "up": [0.1, 1, 0.2], "verticalFovDeg": fov}
    _, placed = place(programs, folder, camera=camera, image={"width": width, "height": height})
    seen = placed["frames"][0]["camera"]
    to_camera = np.linalg.inv(np.array(conventions.camera_matrix(seen)))

    forward = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(forward, [0.1, 1, 0.2])
    right /= np.linalg.norm(right)
    down, step = np.cross(forward, right), 2 * math.tan(math.radians(fov / 2)) / height
    for x, y in [(0, 0), (64, 0), (10.25, 40.5), (32, 24)]:
        point = eye + 3 * (forward + (x - width / 2) * step * right + (y - height / 2) * step * down)
        px, py, pz, _ = to_camera @ [*conventions.to_blender(point), 1]
        scale = conventions.lens_mm(seen["verticalFovDeg"]) / conventions.SENSOR_MM * height / -pz
        check_close((width / 2 + px * scale, height / 2 - py * scale), (x, y), "a pixel", 2e-4)


def arrays_are_turned_like_points(_programs, _folder):
    import array
    values = array.array("f", range(9))
    turned = conventions.flat_to_blender(values)
    check_equal([tuple(turned[i:i + 3]) for i in (0, 3, 6)],
                [conventions.to_blender(values[i:i + 3]) for i in (0, 3, 6)], "vertices")


# ---- statistics ---------------------------------------------------------------------------------------------


def planted(level, pairs, variance, cpu, bias=0.0, size=(2, 48, 40)):
    """A setting whose runs are a gradient plus noise of that variance, other in each block."""
    truth = np.linspace(0.2, 1, size[2])[None, None, :, None] * np.ones((*size, 3))
    deviation = np.sqrt(variance * np.linspace(0.5, 1.5, size[1]))[None, :, None, None]
    runs = [(truth + bias + deviation * random.normal(size=truth.shape)).astype(np.float32) for _ in range(2 * pairs)]
    kept = [errors.measure_pair(a, b, (cpu, cpu)) for a, b in zip(runs[0::2], runs[1::2])]
    return errors.Setting("planted", level, kept, errors.block_sizes(*size[1:]))


def the_error_is_that_planted(_programs, _folder):
    inside = 0
    for _ in range(40):
        setting = planted(1, 2, 0.01, 1.0)
        check(abs(setting.mse() / 0.01 - 1) < 0.06, f"squared error: got {setting.mse()}, planted 0.01")
        errors.draw([setting])
        check(abs(setting.draws["mse"].mean() / setting.mse() - 1) < 0.03, "drawn anew, the error is another on the mean")
        low, high = errors.interval(setting.draws["mse"])
        inside += low < 0.01 < high
    check(inside >= 36, f"of 40 intervals {inside} hold the truth")


def an_error_as_shown_counts_what_a_screen_shows(_programs, _folder):
    """A grey is .4 at its exposure, whichever it is; by hand, a half that is twice as bright. White hides what is above it."""
    linear = ((0.4 + 0.055) / 1.055) ** 2.4
    apart = [1.055 * (linear * share) ** (1 / 2.4) - 0.055 for share in (1.05, 0.95)]
    for level in (1e-4, 1, 300):
        grey = np.full((32, 32, 3), level)
        blocks, seen = errors.error_as_shown(1.05 * grey, 0.95 * grey)
        for name, got in (("blocks", blocks), *((name, seen[name] ** 2) for name in ("darkest", "worst", "exceeded"))):
            check_close(got, 0.5 * (apart[0] - apart[1]) ** 2, f"{name} of {level}", 1e-6)
    half = np.full((32, 32, 3), 0.18)
    half[:, 24:] = 1000
    check_close(errors.error_as_shown(half, np.where(half > 1, half + 500, half))[0], 0, "above white", 1e-9)


def a_corner_and_its_specks_are_seen(_programs, _folder):
    """One block of 8 has all of the error, in the dark quarter; of black pixels those count that one picture has."""
    a = np.full((32, 64, 3), 0.18)
    a[16:, 32:] = 0.01
    b = a.copy()
    a[20, 40], a[18, 40], b[18, 40] = 0, 0, 0
    blocks, seen = errors.error_as_shown(a, b)
    check_close(seen["worst"] ** 2, blocks.sum(), "worst block", 1e-12)
    check_close(2 * seen["darkest"] ** 2, blocks.sum(), "darkest quarter", 1e-12)
    check_close(seen["black"], 0.5 / (32 * 64), "black", 1e-12)


def a_ratio_is_that_planted(_programs, _folder):
    """One renderer has the variance .08 / CPU s; the other takes 12 s for what it has after 2.5 s."""
    curve = [planted(level, 2, 0.08 / level, float(level)) for level in (1, 4, 16)]
    other = planted(64, 2, 0.08 / 2.5, 12.0)
    errors.draw([*curve, other])
    ratio = errors.ratio_at_error(curve, other)
    check(abs(ratio.value / (12 / 2.5) - 1) < 0.06, f"ratio: got {ratio.value}, planted {12 / 2.5}")
    check(ratio.low < 12 / 2.5 < ratio.high and not ratio.bound and not ratio.extrapolated, f"interval: {ratio}")


def a_curve_ends_honestly(_programs, _folder):
    check_close(errors.cpu_at([1, 4], [1.0, 0.25], 0.5), 2.0, "between", 1e-9)
    check_close(errors.cpu_at([1, 4], [1.0, 0.25], 0.125), 8.0, "beyond the dearest: as 1 / CPU", 1e-9)
    check_close(errors.cpu_at([1, 4], [1.0, 0.25], 0.25), 4.0, "on a point", 1e-9)
    check_equal(errors.cpu_at([1, 4], [1.0, 0.25], 2.0), None, "the cheapest is better already")


def a_difference_is_seen_and_noise_is_not(_programs, _folder):
    exact, same, off = (planted(1, 2, 0.01, 1.0, bias, (1, 160, 160)) for bias in (0, 0, 0.004))
    none, some = errors.difference(same, exact), errors.difference(off, exact)
    check(abs(none.z()) < 4 and 0.6 < none.z_squared < 1.5, f"of nothing: {none}")
    check(abs(some.relative * some.mean - 0.004) < 0.0008 and some.z() > 5, f"planted .004: {some}")
    check(some.systematic * some.mean > 0.003, f"systematic: {some}")


def a_difference_of_single_pixels_is_seen(_programs, _folder):
    """Of +- .01 from pixel to pixel, which no block's mean shows."""
    checkered = 0.01 * (np.indices((160, 160)).sum(0) % 2 * 2 - 1)[None, :, :, None]
    first, second = (0.05 * random.normal(size=(2, 160, 160, 3)) for _ in range(2))
    for planted_square, other in [(0, second), (1e-4, second + checkered)]:
        got, error = errors.beyond_noise(first, other)
        check(abs(got - planted_square) < 4 * error and error < 2e-5, f"planted {planted_square}: {got} +- {error}")


def blocks_at_the_edge_count_by_their_pixels(_programs, _folder):
    values = random.normal(size=(2, 37, 50))
    sizes = errors.block_sizes(37, 50)
    check_equal(int(sizes.sum()), 37 * 50, "pixels")
    check_close(errors.block_means(values) @ sizes / sizes.sum(), values.mean((1, 2)), "mean", 1e-9)


# ---- a glTF scene -------------------------------------------------------------------------------------------


def beyond(a, b):
    return float(np.mean(np.abs(compare_gltf.z_of(a, b)) > 3))


def pixels_differ_as_often_as_chance_says(_programs, _folder):
    chance = compare_gltf.by_chance(8, random)
    check_close(chance, 0.0096, "8 pictures of both", 5e-4)
    a, b = random.normal(5, 1, size=(2, 8, 300, 300))
    check_close(beyond(a, b), chance, "the same", 1.5e-3)
    check(beyond(a + 1, b) > 10 * chance, "one by a standard deviation, which is 2 standard errors, off")
    still = np.full((8, 10), 3.0)
    check_equal([beyond(still, still * 1.00001), beyond(still, still * 1.01)], [0.0, 1.0], "without noise")


def a_pixel_is_put_where_it_belongs(_programs, _folder):
    """4 x 2 pixels of 2 x 2: sky, then two objects of clay side by side, in the last column of steel."""
    planes = {"object": np.zeros((4, 8)), "material": np.zeros((4, 8))}
    for name, number in (("object", 1), ("material", 1)):
        planes[name][:, 2:] = number
    planes["object"][:, 6:], planes["material"][:2, 6:] = 2, 4
    places = compare_gltf.places_of(planes, 2)
    check_equal({name: mask.astype(int).tolist() for name, mask in places.items() if mask.any()},
                {"edges": [[1, 1, 1, 1]] * 2}, "next to another object")
    planes["object"][:] = 1
    places = compare_gltf.places_of(planes, 2)
    check_equal({name: mask.astype(int).tolist() for name, mask in places.items() if mask.any()},
                {"sky": [[1, 0, 0, 0]] * 2, "clay": [[0, 1, 1, 0], [0, 1, 1, 1]], "steel": [[0, 0, 0, 1], [0, 0, 0, 0]]},
                "by material")
    check_equal(compare_gltf.blocks(np.arange(8).reshape(2, 4), 2).mean(-1).tolist(), [[2.5, 4.5]], "means")


def hills_have_their_normals(_programs, _folder):
    positions, normals, _, triangles = gltf_scenes.hills()
    at, to = np.array(positions), np.array(normals)
    corners = at[np.array(triangles)]
    flat = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    flat /= np.linalg.norm(flat, axis=1, keepdims=True)
    check(float(np.sum(flat[:, None] * to[np.array(triangles)], -1).min()) > 0.9995, "normals of corners and triangles")
    check(at[:, 1].max() <= 0, "below what stands on the floor")


def sets_of_both_kinds_render(programs, folder):
    """As Baton reads them: with fewer texels, normal maps and hills that catch."""
    folder.mkdir(parents=True)
    for name, arguments in (("set", {}), ("hills", {"texels": 4, "normals": True, "hilly": True})):
        scene = folder / f"{name}.glb"
        scene.write_bytes(gltf_scenes.make_scene(**arguments))
        document, buffer = gltf_scenes.open_glb(scene.read_bytes())
        check(gltf_scenes.write_glb(document, buffer) == scene.read_bytes(), f"{name}: read and written")
        if name == "hills":
            check_equal(document["accessors"][-1]["count"], 6 * 240 * 240, "indices of the hills")
        nodes = {"floor": {"catcher": True}} if name == "hills" else {}
        output = {"directory": str(folder / name), "compression": "none", "pixelType": "float"}
        job = make_job(folder, frames="1", output=output)
        job["scene"] = {"gltf": {"file": str(scene), "nodes": nodes}}
        job.pop("camera", None)
        programs.render_in(folder, job)
        frame = pictures.read_frame(next((folder / name).glob("*.exr")))
        check_equal("shadow.R" in frame.channels, name == "hills", f"{name}: channels of a catcher")
        if name == "hills":
            shadow = np.array(frame.channels["shadow.R"])
            check(float(shadow.min()) < 0.7 and float(np.median(shadow)) > 0.8, f"{name}: shadows")


def jobs_are_legal(programs, _folder):
    """Their files may be missing."""
    for job in sorted((PEERS / "scenes").glob("*.json")):
        done = subprocess.run([programs.path("baton"), "check", job], capture_output=True, text=True)
        check(f"{job.name}: $" not in done.stderr, done.stderr)


# ---- files --------------------------------------------------------------------------------------------------


def frames_are_read_as_written(programs, folder):
    output = {"directory": str(folder / "frames"), "compression": "none", "pixelType": "float", "aovs": ["normal"]}
    programs.render_in(folder, make_job(folder, frames="1", output=output))
    file = next((folder / "frames").glob("*.exr"))
    got = pictures.read_exr(file)
    for k, name in enumerate("RGB"):
        check_close(got[:, :, k].ravel(), programs.values(file, name), f"channel {name}", 1e-5)


def a_picture_is_written_as_it_is(_programs, folder):
    folder.mkdir(parents=True)
    picture = random.integers(0, 256, (13, 17, 3)).astype(np.uint8)
    pictures.write_png(folder / "a.png", picture)
    width, height, rows = read_png(folder / "a.png")
    check_equal((width, height, b"".join(rows)), (17, 13, picture.tobytes()), "pixels")


def what_is_not_modelled_alike_is_refused(programs, folder):
    gold = {"type": "metallicRoughness", "color": [1, 0.7, 0.3], "metallic": 1, "roughness": 0.2}
    white = {**gold, "color": [1, 1, 1]}
    for number, (material, expected) in enumerate([
            (white, None), (gold, "color [1, 1, 1]"), ({**white, "roughness": 0.8}, "a roughness of at most 0.3"),
            ({**white, "clearcoat": 0.5, "clearcoatRoughness": 0.1}, None),
            ({"type": "metallicRoughness", "specular": 0, "clearcoat": 1, "clearcoatRoughness": 0.8},
             "a clearcoatRoughness of at most 0.3"),
            ({"type": "phong"}, "only diffuse and metallicRoughness"),
            ({"type": "diffuse", "emission": [1, 1, 1]}, "textures, holes and emission")]):
        done, placed = place(programs, folder / str(number), 0 if expected is None else BAD_INPUT, lacquer=material)
        if expected is None:
            check_equal([len(placed[key]) for key in ("materials", "instances", "frames")], [2, 3, 6], "parts")
            continue
        check(placed is None and expected in done.stderr and "scene.materials.lacquer: " in done.stderr
              and done.stderr.count("\n") == 1, f"{material}: {done.stderr!r}")


if __name__ == "__main__":
    run_tests()

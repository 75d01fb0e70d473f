#!/usr/bin/env python3
"""Renders the glTF set of jobs/examples with Baton and with Cycles, which reads it by Blender's own importer, and compares
pixel by pixel.

/usr/bin/python3 compare_gltf.py --bin build/release/bin --map MAP.exr --out FOLDER [--frame 24] [--seeds 8] [--spp 64]
        [--rounds N] [--fine 2] [--texels 4] [--width 320] [--fault turn|frame|shadow]
        [--normals | --catcher plane|hills]

Both get the set's geometry, instances, motion, camera, textures and their transforms, holes and emission, with materials
that both model alike: diffuse and, as far as it is metal, a white GGX lobe; images are not blended between texels, and
without --normals there is no normal map.

Baton looks up the mean of a texture over a site's share of its pixel, Cycles the texel at each ray. So that footprints are
narrower than texels, where both are the same, Baton renders a picture --fine times as wide and high, which is then averaged,
and images have --texels times fewer columns and rows. 1 and 1: the set and the picture themselves. --rounds: 1, or 4 with
--fine 1.
--catcher: the floor, as it is or with hills, catches shadows. Baton's channels `shadow` are compared with the light that
Cycles finds on the floor over that which arrives where nothing blocks, two pictures of the same seed.

Each renders with several seeds, whose spread is the standard error of a pixel. Printed are the share of pixels beyond 3
standard errors, what chance explains of that, and z^2: of all pixels, then of those that see one material, the sky, or the
edges of objects; and both ratios for each renderer alone, the first half of the seeds beside the second. --fault plants one
that must be seen. Exit code 1 where more than twice as many pixels differ as chance explains. Cycles' pictures are kept.
"""

import argparse
import hashlib
import json
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path += [str(HERE), str(HERE.parents[2] / "tests/system")]
sys.dont_write_bytecode = True
import gltf_scenes  # noqa: E402
import pictures  # noqa: E402
from exr_frames import read_frame  # noqa: E402

MOST_BEYOND = 2  # times what chance explains
MATERIALS = ("clay", "floor", "rubber", "steel")  # as the AOV counts them, from 1
LEAST_SEEN = 0.02  # of a pixel, for its catcher to be compared


def run(*command):
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(f"{' '.join(map(str, command))}: exit code {done.returncode}\n{done.stdout[-3000:]}{done.stderr[-3000:]}")


def job_of(options, scene, height):
    job = {"specificationVersion": 1, "name": "gltf", "frames": str(options.frame),
           "image": {"width": options.width * options.fine, "height": height * options.fine, "sites": 16},
           "scene": {"gltf": {"file": str(scene)}}, "environment": {"map": str(options.map.resolve()), "filter": "bilinear"},
           "light": {"bounces": 0}, "quality": {"rounds": options.rounds},
           "output": {"directory": "frames", "compression": "none", "pixelType": "float", "clampNegative": False,
                      "aovs": ["object", "material"]}}
    if options.catcher:
        job["scene"]["gltf"]["nodes"] = {"floor": {"catcher": True}}
        job["output"]["background"] = "transparent"
    return job


def plant(job, fault):
    """A fault, put into the job."""
    if fault == "turn":
        job["environment"]["rotation"] = {"startDeg": 1}
    elif fault == "frame":
        job["scene"]["gltf"]["startFrame"] = 1
    elif fault == "shadow":
        job["scene"]["gltf"].setdefault("nodes", {})["ball"] = {"visible": False}


def by_chance(seeds, random):
    """The share of pixels beyond 3 standard errors, which are estimated from so many pictures of both, where both
    are the same."""
    a, b = random.normal(size=(2, seeds, 400000))
    return np.mean(np.abs(z_of(a, b)) > 3)


def z_of(a, b):
    """a, b: (seeds, ...)."""
    error = np.sqrt((a.var(0, ddof=1) + b.var(0, ddof=1)) / len(a))
    apart = a.mean(0) - b.mean(0)
    # Of pixels without noise, such as a map's, differences below rounding are none.
    return apart / np.maximum(error, 1e-4 * np.abs(b.mean(0)) + 1e-7)


def blocks(plane, fine):
    """(height, width) as (height / fine, width / fine, fine^2)."""
    height, width = plane.shape[0] // fine, plane.shape[1] // fine
    return plane.reshape(height, fine, width, fine).swapaxes(1, 2).reshape(height, width, fine * fine)


def render_baton(options, job_file, seed):
    """Planes of a picture by name, as the EXR has them."""
    folder = options.out / f"baton.{seed}"
    shutil.rmtree(folder, ignore_errors=True)
    run(options.bin / "baton", "render", job_file, "--restart", "--set", f"seed={seed}", "--set", f"output.directory={folder}")
    frame = read_frame(next(folder.glob("frame.*.exr")))
    return {name: np.array(values, np.float64).reshape(frame.height, frame.width) for name, values in frame.channels.items()}


def render_cycles(options, scene, seed, *more):
    """R, G and B; kept in a folder that what it shows names."""
    settings = [part for name in ("frame", "width", "spp") for part in (f"--{name}", getattr(options, name))]
    settings += ["--height", options.width * 9 // 16, *more]
    scripts = [(HERE / f"cycles_{name}.py").read_bytes() for name in ("gltf", "scene", "settings")]
    shown = hashlib.sha256(b"".join([scene.read_bytes(), options.map.read_bytes(), *scripts, str(settings).encode()]))
    file = options.out / f"cycles-{shown.hexdigest()[:12]}" / f"{seed}.exr"
    if not file.exists():
        file.parent.mkdir(exist_ok=True)
        made = file.with_suffix(".new.exr")
        run("blender", "-b", "--factory-startup", "-noaudio", "--python-exit-code", "1", "-P", HERE / "cycles_gltf.py", "--",
            scene, options.map.resolve(), made, *settings, "--seed", seed, "--threads", options.threads)
        made.rename(file)
    return pictures.read_exr(file).astype(np.float64)


def shadows_of_cycles(options, scene):
    """Blocked light over free light of each seed, (seeds, height, width, 3), and what is seen of the catcher."""
    lit, free = (np.stack([render_cycles(options, scene, seed, "--catcher", "floor", *more)
                           for seed in range(1, options.seeds + 1)]) for more in ((), ("--unblocked",)))
    mean = np.maximum(free.mean(0), 1e-9)
    ratio = lit.mean(0) / mean
    # Around the ratio of the means, as a ratio of one seed is biased.
    return ratio + (lit - ratio * free) / mean, free.mean(0)


def places_of(planes, fine):
    """Masks of pixels by what they see: edges of objects, the sky, one material."""
    ring = np.pad(planes["object"], 1, mode="edge")
    height, width = planes["object"].shape
    near = np.stack([ring[y:y + height, x:x + width] for y in range(3) for x in range(3)])
    edge = blocks(near.max(0), fine).max(-1) != blocks(near.min(0), fine).min(-1)
    material = blocks(planes["material"], fine)
    places = {"edges": edge}
    for number, name in enumerate(("sky", *MATERIALS)):
        places[name] = ~edge & (material == number).all(-1)
    return places


def shares(z):
    return f"{100 * np.mean(np.abs(z) > 3):5.2f} % of {z.size} pixels, z^2 {np.square(z).mean():.2f}"


def report(a, b, places):
    """a, b: (seeds, height, width). The share beyond 3 standard errors, and by chance."""
    used = np.any(list(places.values()), 0)
    z, random = z_of(a, b), np.random.default_rng(1)
    chance, half = by_chance(len(a), random), len(a) // 2
    print(f"beyond 3 standard errors: {shares(z[used])}; by chance {100 * chance:.2f} %")
    print(f"means, Baton over Cycles: {a[:, used].mean() / b[:, used].mean():.5f}")
    for name, seen in places.items():
        if seen.any():
            print(f"  {name:8} {shares(z[seen])}, means {a[:, seen].mean() / b[:, seen].mean():.5f}")
    if half > 1:
        for name, runs in (("Baton", a), ("Cycles", b)):
            print(f"{name}, the first {half} seeds beside the next: {shares(z_of(runs[:half], runs[half:2 * half])[used])}, "
                  f"by chance {100 * by_chance(half, random):.2f} %")
    return z, np.mean(np.abs(z[used]) > 3), chance


def parse_arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name in ("bin", "map", "out"):
        parser.add_argument(f"--{name}", type=Path, required=True)
    for name, value in (("frame", 24), ("seeds", 8), ("spp", 64), ("rounds", None), ("fine", None), ("texels", 4), ("width", 320), ("threads", 2)):
        parser.add_argument(f"--{name}", type=int, default=value)
    parser.add_argument("--fault", choices=("turn", "frame", "shadow"))
    parser.add_argument("--normals", action="store_true")
    parser.add_argument("--catcher", choices=("plane", "hills"))
    options = parser.parse_args()
    options.out = options.out.resolve()
    if options.fine is None:
        options.fine = 1 if options.catcher else 2
    if options.catcher and options.fine > 1:
        parser.error("--catcher: a mean of shares is that of a larger pixel only with --fine 1")
    options.rounds = options.rounds or (4 if options.fine == 1 else 1)
    return options


def main():
    options = parse_arguments()
    out, fine = options.out, options.fine
    out.mkdir(parents=True, exist_ok=True)
    height = options.width * 9 // 16
    scene = out / "set.glb"
    scene.write_bytes(gltf_scenes.make_scene(options.texels, options.normals, options.catcher == "hills"))
    job = job_of(options, scene, height)
    plant(job, options.fault)
    (out / "job.json").write_text(json.dumps(job, indent=1), encoding="utf-8")
    baton = [render_baton(options, out / "job.json", seed) for seed in range(1, options.seeds + 1)]
    names = [f"shadow.{c}" for c in "RGB"] if options.catcher else "RGB"
    a = np.stack([np.stack([blocks(planes[name], fine).mean(-1) for name in names], -1) for planes in baton])
    if options.catcher:
        b, free = shadows_of_cycles(options, scene)
        seen = free.mean(-1) > LEAST_SEEN * free.mean(-1).max()
        covered = np.max([blocks(planes["A"], fine).max(-1) for planes in baton], 0) > 0
        places = {"edges": seen & covered, "floor": seen & ~covered}
    else:
        b = np.stack([render_cycles(options, scene, seed) for seed in range(1, options.seeds + 1)])
        places = places_of(baton[0], fine)
    z, beyond, chance = report(a.mean(-1), b.mean(-1), places)
    shade = np.clip(np.stack([z, 0 * z, -z], -1) / 6, 0, 1)
    pictures.write_png(out / "compared.png", pictures.sheet([
        [pictures.to_srgb(runs.mean(0)) for runs in (a, b)] + [np.round(255 * shade).astype(np.uint8)]]))
    return int(beyond > MOST_BEYOND * chance)


if __name__ == "__main__":
    sys.exit(main())

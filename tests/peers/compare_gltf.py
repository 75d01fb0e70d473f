#!/usr/bin/env python3
"""Renders the glTF set of jobs/examples with Baton and with Cycles, which reads it by Blender's own importer, and compares
pixel by pixel.

/usr/bin/python3 compare_gltf.py --bin build/release/bin --map MAP.exr --out FOLDER [--frame 24] [--seeds 8] [--spp 64]
                                 [--rounds 4] [--width 480] [--fault turn|frame] [--normals]

Both get the set's geometry, instances, motion, camera, textures and their transforms, holes and emission, with materials
that both model alike: diffuse and, as far as it is metal, a white GGX lobe; images are not blended between texels, and
without --normals there is no normal map. Each renders with several seeds, whose spread is the standard error of a pixel.
Printed are the share of pixels beyond 3 standard errors, what chance explains of that, the ratio of the means and z^2;
then the same by material. --fault plants one that must be seen. Exit code 1 where more than twice as many pixels differ
as chance explains.
"""

import argparse
import json
import shutil
import struct
import subprocess
import sys
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path += [str(HERE), str(HERE.parents[1] / "jobs/examples"), str(HERE.parent / "system")]
sys.dont_write_bytecode = True
import pictures  # noqa: E402
from make_gltf_set import make_set  # noqa: E402

NEAREST = 9728
MOST_BEYOND = 2  # times what chance explains


def run(*command):
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(f"{' '.join(map(str, command))}: exit code {done.returncode}\n{done.stdout[-3000:]}{done.stderr[-3000:]}")


def as_one(animations):
    """One animation that is all of them: of several Blender shows the first."""
    samplers = [sampler for animation in animations for sampler in animation["samplers"]]
    channels = [animation["channels"][0] for animation in animations]  # one each
    return [{"samplers": samplers, "channels": [{**channel, "sampler": i} for i, channel in enumerate(channels)]}]


def with_alike_materials(glb, normals):
    """The set with what both model alike."""
    size = struct.unpack_from("<I", glb, 12)[0]
    document, rest = json.loads(glb[20:20 + size]), glb[20 + size:]
    for material in document["materials"]:
        material.setdefault("extensions", {}).pop("KHR_materials_clearcoat", None)
        material["extensions"]["KHR_materials_specular"] = {"specularFactor": 0}
        if not normals:
            material.pop("normalTexture", None)
        if material["pbrMetallicRoughness"]["metallicFactor"] > 0:
            material["pbrMetallicRoughness"]["baseColorFactor"] = [1, 1, 1, 1]
    for sampler in document["samplers"]:
        sampler.update(magFilter=NEAREST, minFilter=NEAREST)
    document["animations"] = as_one(document["animations"])
    used = [name for name in document["extensionsUsed"] if name != "KHR_materials_clearcoat"]
    document["extensionsUsed"] = [*used, "KHR_materials_specular"]
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    return (struct.pack("<4sII", b"glTF", 2, 20 + len(text) + len(rest)) + struct.pack("<I4s", len(text), b"JSON") + text
            + rest)


def job_of(options, scene, height):
    return {"specificationVersion": 1, "name": "gltf", "frames": str(options.frame),
            "image": {"width": options.width, "height": height, "sites": 16},
            "scene": {"gltf": {"file": str(scene)}}, "environment": {"map": str(options.map.resolve()), "filter": "bilinear"},
            "quality": {"rounds": options.rounds},
            "output": {"directory": "frames", "compression": "none", "pixelType": "float", "clampNegative": False}}


def plant(job, fault):
    """A fault, put into the job."""
    if fault == "turn":
        job["environment"]["rotation"] = {"startDeg": 1}
    elif fault == "frame":
        job["scene"]["gltf"]["startFrame"] = 1


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


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name in ("bin", "map", "out"):
        parser.add_argument(f"--{name}", type=Path, required=True)
    for name, value in (("frame", 24), ("seeds", 8), ("spp", 64), ("rounds", 4), ("width", 480), ("threads", 2)):
        parser.add_argument(f"--{name}", type=int, default=value)
    parser.add_argument("--fault", choices=("turn", "frame"))
    parser.add_argument("--normals", action="store_true")
    options = parser.parse_args()
    out = options.out.resolve()
    out.mkdir(parents=True, exist_ok=True)
    height = options.width * 9 // 16
    scene = out / "set.glb"
    scene.write_bytes(with_alike_materials(make_set(textured=True), options.normals))
    job = job_of(options, scene, height)
    plant(job, options.fault)
    (out / "job.json").write_text(json.dumps(job, indent=1), encoding="utf-8")
    baton, cycles = [], []
    for seed in range(1, options.seeds + 1):
        shutil.rmtree(out / f"baton.{seed}", ignore_errors=True)
        run(options.bin / "baton", "render", out / "job.json", "--restart", "--set", f"seed={seed}",
            "--set", f"output.directory={out}/baton.{seed}")
        baton.append(pictures.read_exr(next((out / f"baton.{seed}").glob("frame.*.exr"))))
        file = out / f"cycles.{seed}.exr"
        if not options.fault or not file.exists():
            run("blender", "-b", "--factory-startup", "-noaudio", "--python-exit-code", "1", "-P", HERE / "cycles_gltf.py",
                "--", scene, options.map.resolve(), file, *(part for name in ("frame", "width", "spp", "threads")
                                                  for part in (f"--{name}", getattr(options, name))),
                "--height", height, "--seed", seed)
        cycles.append(pictures.read_exr(file))
    a, b = (np.stack(runs).mean(-1, dtype=np.float64) for runs in (baton, cycles))
    np.savez(out / "pictures.npz", a=a, b=b)
    z = z_of(a, b)
    chance, beyond = by_chance(options.seeds, np.random.default_rng(1)), np.mean(np.abs(z) > 3)
    print(f"beyond 3 standard errors: {100 * beyond:.2f} % of {z.size} pixels, by chance {100 * chance:.2f} %")
    print(f"means, Baton over Cycles: {a.mean() / b.mean():.5f}; z^2: {np.square(z).mean():.2f}, median {np.median(np.square(z)):.2f}")
    shade = np.clip(np.stack([z, 0 * z, -z], -1) / 6, 0, 1)
    pictures.write_png(out / "compared.png", pictures.sheet([
        [pictures.to_srgb(np.stack(runs).mean(0)) for runs in (baton, cycles)] + [np.round(255 * shade).astype(np.uint8)]]))
    return int(beyond > MOST_BEYOND * chance)


if __name__ == "__main__":
    sys.exit(main())

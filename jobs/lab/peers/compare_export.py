#!/usr/bin/env python3
"""Exports a Blender file, renders it with Baton and with Cycles, and compares the pictures.

/usr/bin/python3 compare_export.py --bin build/release/bin --out FOLDER --frames 1,12,24 [--rounds 16] [--spp 64]
                                   [--fault turn|frame] shot.blend

Both render twice, with other seeds, which tells how noisy each block of pixels is. For each frame stand there: the
ratio of the means, Baton's over Cycles'; the rms difference of blocks over the picture's mean, and over what noise
explains (about 1 where both render the same); the largest difference of a block over the mean. Exit code 1 where noise
does not explain the difference. --fault plants one, which must be seen: the map turned by two degrees, or objects one
frame late (which needs two frames or more).
"""

import argparse
import json
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np

import errors
import pictures

HERE = Path(__file__).resolve().parent
EXPORTER = HERE.parents[1] / "exporters/blender/export_baton.py"
FAULT_DEG = 2
SEEDS = (1, 2)
MOST_OVER_NOISE = 1.5
MOST_RMS = 0.002  # of the mean: below it, filters of the two differ more than a viewer sees


def run(*command):
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(f"{' '.join(map(str, command))}: exit code {done.returncode}\n{done.stdout[-3000:]}{done.stderr[-3000:]}")


def plant(job, fault):
    """A fault of the exporter, put into the job."""
    if fault == "frame":
        job["scene"]["gltf"]["startFrame"] = 1
    elif fault == "turn":
        rotation = job["environment"].setdefault("rotation", {})
        for key in rotation.get("keys", []):
            key["deg"] += FAULT_DEG
        if "keys" not in rotation:
            rotation["startDeg"] = rotation.get("startDeg", 0) + FAULT_DEG


def judge(baton, cycles):
    """baton, cycles: pictures of both seeds."""
    ours, theirs = (errors.block_means(np.stack(runs).mean(-1)) for runs in (baton, cycles))
    noise = sum(np.square(runs[0] - runs[1]).mean() / 4 for runs in (ours, theirs))
    apart = ours.mean(0) - theirs.mean(0)
    mean, rms = theirs.mean(), np.sqrt(np.square(apart).mean())
    return {"ratio": ours.mean() / mean, "rms": rms / mean, "over_noise": rms / np.sqrt(noise),
            "largest": np.abs(apart).max() / mean}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bin", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--frames", required=True)
    parser.add_argument("--rounds", type=int, default=16)
    parser.add_argument("--spp", type=int, default=64)
    parser.add_argument("--fault", choices=("turn", "frame"))
    parser.add_argument("blend", type=Path)
    options = parser.parse_args()
    out = options.out.resolve()
    run("blender", "-b", options.blend, "-P", EXPORTER, "--", out / "job", "--frames", options.frames)
    print((out / "job/report.txt").read_text(encoding="utf-8"), end="")
    job = json.loads((out / "job/job.json").read_text(encoding="utf-8"))
    plant(job, options.fault)
    (out / "job/compared.json").write_text(json.dumps(job, indent=1), encoding="utf-8")

    for seed in SEEDS:
        shutil.rmtree(out / f"baton.{seed}", ignore_errors=True)
        run(options.bin / "baton", "render", out / "job/compared.json", "--restart", "--set", f"seed={seed}",
            "--set", f"quality.rounds={options.rounds}", "--set", "output.pixelType=float",
            "--set", "output.clampNegative=false", "--set", f"output.directory={out}/baton.{seed}")
        if not options.fault or not (out / f"cycles.{seed}").exists():
            run("blender", "-b", options.blend, "-P", HERE / "cycles_file.py", "--", out / f"cycles.{seed}",
                "--frames", options.frames, "--spp", options.spp, "--seed", seed)

    failed = False
    print("frame  ratio     rms  over noise  largest")
    for file in sorted((out / "baton.1").glob("frame.*.exr")):
        number = file.name.split(".")[1]
        found = judge(*([pictures.read_exr(out / f"{name}.{seed}" / f"{stem}.{number}.exr") for seed in SEEDS]
                        for name, stem in (("baton", "frame"), ("cycles", "cycles"))))
        wrong = found["over_noise"] > MOST_OVER_NOISE and found["rms"] > MOST_RMS
        failed = failed or wrong
        print(f"{number}  {found['ratio']:.4f}  {100 * found['rms']:.2f} %  {found['over_noise']:8.2f}"
              f"  {100 * found['largest']:6.2f} %{'  DIFFERS' if wrong else ''}")
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())

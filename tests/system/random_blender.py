#!/usr/bin/env python3
"""Random Blender files, each rendered by Cycles and, as exported, by Baton: where the pictures differ beyond noise, the
exporter's report must have a line.

usage: random_blender.py --bin build/release/bin --source . [--seed S] [--files N] [--start I] [--keep DIR]
       random_blender.py --bin build/release/bin --source . --each [REGEX]      each trait alone, of these names
Both render direct light. Exits 1 when a file fails; its folder stays in DIR. Standard library only; needs Blender."""

import argparse
import json
import math
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from exr_frames import read_frame
from farm import Programs

HERE = Path(__file__).resolve().parent
BLOCK = 8  # pixels
# Pictures differ where blocks are apart by more than this share of the picture's mean, and by more than so many times the noise.
MOST_RMS, MOST_OVER_NOISE = 0.01, 3.5
MOST_LARGEST, MOST_LARGEST_OVER_NOISE = 0.1, 12
BATON = ["--workers", "1", "--threads-per-worker", "2", "--set", "sampling.method=bidirectional", "--set", "quality.rounds=24",
         "--set", "output.pixelType=float", "--set", "output.clampNegative=false", "--set", "output.aovs=[]"]
FILES_OF_A_PROCESS = 20
LONGEST_S = 900


def blender(script, *arguments):
    """Debian's Blender needs Debian's Python."""
    environment = {**os.environ, "PATH": "/usr/bin:" + os.environ["PATH"]}
    return subprocess.run(["blender", "-b", "--factory-startup", "--python-exit-code", "1", "-P", str(HERE / script), "--",
                           *map(str, arguments)], capture_output=True, text=True, check=False, env=environment, timeout=LONGEST_S)


def has_blender():
    return shutil.which("blender") is not None


def blocks_of(path, names, is_cropped=False):
    """Means of blocks of these channels, one after the other, over the display window, where pixels without data are 0, or
    over the data window."""
    frame = read_frame(path)
    x0, y0, x1, y1 = frame.window if is_cropped else frame.display
    left, top, right, bottom = frame.window
    means = []
    for name in names:
        plane = frame.channels[name]
        for by in range(y0, y1, BLOCK):
            for bx in range(x0, x1, BLOCK):
                inside = [plane[(y - top) * frame.width + x - left] for y in range(by, min(by + BLOCK, y1))
                          for x in range(bx, min(bx + BLOCK, x1)) if left <= x < right and top <= y < bottom]
                means.append(sum(inside) / ((min(by + BLOCK, y1) - by) * (min(bx + BLOCK, x1) - bx)))
    return means


def rms(values):
    return math.sqrt(sum(value * value for value in values) / len(values))


def compare(ours, pair):
    """Whether one picture differs from the mean of two by more than noise explains, and how."""
    if len({len(ours), *map(len, pair)}) > 1:
        return True, f"sizes differ: {len(ours)} and {len(pair[0])} blocks"
    mean = max(sum(map(abs, pair[0])) / len(ours), 1e-6)
    apart = [o - (a + b) / 2 for o, a, b in zip(ours, *pair)]
    if not all(map(math.isfinite, apart)):
        return True, "values that are not finite"
    noise = max(rms([(a - b) / 2 for a, b in zip(*pair)]), 1e-4 * mean)
    off, largest = rms(apart), max(map(abs, apart))
    text = (f"means {sum(ours) / max(sum(pair[0]), 1e-9):.4f}, rms of blocks {100 * off / mean:.2f} %, {off / noise:.1f} times the "
            f"noise, largest {100 * largest / mean:.1f} %")
    differs = (off > MOST_RMS * mean and off > MOST_OVER_NOISE * noise
               or largest > MOST_LARGEST * mean and largest > MOST_LARGEST_OVER_NOISE * noise)
    return differs, text


class Run:
    """Renders what Blender has made, and keeps account."""

    def __init__(self, programs, folder):
        self.programs, self.folder = programs, folder
        self.agree = self.told = 0
        self.silent = []

    def judge(self, number):
        folder = self.folder / str(number)
        if not (folder / "told.json").exists():
            return self.fail(number, "Blender has ended before")
        told = json.loads((folder / "told.json").read_text(encoding="utf-8"))
        what = ", ".join(told["traits"])
        if "fault" in told:
            return self.fail(number, f"{what}: {told['fault']}")
        if not (folder / "job/job.json").exists():
            return self.account(number, what, True, "no job", told["report"])
        done = self.programs.run("baton", "render", folder / "job/job.json", *BATON, "--set", f"output.directory={folder}/baton",
                                 "--work-dir", folder / "work", expect=None)
        if done.returncode:
            return self.fail(number, f"{what}: {done.stderr}")
        channels = "RGBA" if told["transparent"] else "RGB"
        found = [compare(blocks_of(ours, channels, told["cropped"]), [blocks_of(theirs, channels) for theirs in
                                                     sorted(folder.glob(f"cycles.*.{ours.name.split('.')[1]}.exr"))])
                 for ours in sorted((folder / "baton").glob("frame.*.exr"))]
        return self.account(number, what, *max(found), told["report"])

    def account(self, number, what, differs, text, report):
        if differs and not report:
            return self.fail(number, f"{what}: no line in the report, but {text}")
        self.told += differs
        self.agree += not differs
        print(f"file {number}: {'differs, as told' if differs else 'agrees'} ({what}): {text}"
              + "".join(f"\n    {line}" for line in report), flush=True)
        shutil.rmtree(self.folder / str(number), ignore_errors=True)
        return None

    def fail(self, number, text):
        self.silent.append(number)
        print(f"file {number}: FAILED: {text}", flush=True)


def run_files(programs, source, seed, numbers, folder):
    """The numbers of files that fail."""
    run, left = Run(programs, folder), list(numbers)
    while left:
        now, left = left[:FILES_OF_A_PROCESS], left[FILES_OF_A_PROCESS:]
        done = blender("random_blender_files.py", source, folder, seed, *now)
        made = [number for number in now if (folder / str(number)).exists()]
        if done.returncode:
            said = [line for line in (done.stdout + done.stderr).splitlines() if not line.startswith("Fra:")]
            print("\n".join(said[-20:]), flush=True)
            left = [number for number in now if number not in made] + left if made else left
        for number in made or now:
            run.judge(number)
    print(f"{len(list(numbers))} files of seed {seed}: {run.agree} agree, {run.told} differ and are told of, "
          f"{len(run.silent)} fail: {run.silent}", flush=True)
    return run.silent


def names_of_traits():
    """In the order of their numbers below 0."""
    done = blender("blender_traits.py")
    return json.loads(next(line for line in done.stdout.splitlines() if line.startswith("[")))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bin", type=Path, required=True)
    parser.add_argument("--source", type=Path, required=True)
    parser.add_argument("--seed", default="1")
    parser.add_argument("--files", type=int, default=200)
    parser.add_argument("--start", type=int, default=0)
    parser.add_argument("--each", nargs="?", const="")
    parser.add_argument("--keep", type=Path)
    options = parser.parse_args()
    if not has_blender():
        sys.exit("blender is not there")
    folder = (options.keep or Path(tempfile.mkdtemp(prefix="baton-blender-"))).resolve()
    numbers = range(options.start, options.start + options.files)
    if options.each is not None:
        names = names_of_traits()
        numbers = [i - len(names) for i, name in enumerate(names) if re.search(options.each, name)]
    return int(bool(run_files(Programs(options.bin.resolve()), options.source.resolve(), options.seed, numbers, folder)))


if __name__ == "__main__":
    sys.exit(main())

#!/usr/bin/env python3
"""Baton beside Cycles on the same jobs: CPU seconds, errors from pairs of seeds, and whether both show the same.

usage: compare.py --bin build/release/bin --output FOLDER [JOB...]      without jobs: those of scenes/ with a number

FOLDER gets compare.md, compare.json and compare.png; runs are kept there, and the same command goes on with what is
missing. First a test picture must agree in both renderers, and disagree where a convention is broken on purpose.
"""

import argparse
import platform
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import errors
import pictures
import renderers
import report

HERE = Path(__file__).parent
SPP = {True: (16, 64, 256, 1024), False: (64,)}  # of stills, of sequences
MOST_PAIRS = 2


@dataclass(frozen=True)
class Variant:
    """Settings of Baton in place of a job's, and the rounds that they are measured with, if with any."""
    changes: dict
    still_rounds: tuple
    sequence_rounds: tuple
    least_rounds: int = 1


THE_JOB = "the job"
VARIANTS = {
    THE_JOB: Variant({}, (1, 4, 16, 64), (1, 4)),
    "M = 128": Variant({"sampling.numCandidates": 128}, (1, 4, 16), (1,)),
    "4 sites": Variant({"image.sites": 4, "sampling.numCandidates": 128}, (1, 4, 16, 64), (1, 4)),
    "4 to 16 sites": Variant({"image.sites": 4, "image.maxSites": 16, "sampling.numCandidates": 128}, (1, 4, 16), (1, 4)),
    "bidirectional": Variant({"sampling.method": "bidirectional"}, (1, 4, 16), (1,)),
    "bidirectional, 4 sites": Variant({"sampling.method": "bidirectional", "sampling.numCandidates": 128,
                                       "image.sites": 4}, (1, 4, 16), (1,)),
    "adaptive, 4 sites": Variant({"quality.adaptiveThreshold": 0.024, "sampling.numCandidates": 128,
                                  "image.sites": 4}, (16, 32), (), 3),
    "adaptive, bidirectional, 4 sites": Variant({"quality.adaptiveThreshold": 0.024, "image.sites": 4,
                                                 "sampling.method": "bidirectional", "sampling.numCandidates": 128},
                                                (8, 16, 32), (), 3),
}

# Means of the test picture: how far they may be apart, and where a planted fault must show.
CHECK_SPP, CHECK_ROUNDS = 256, 16
MOST_APART = 0.001
MOST_Z_SQUARED = 2


def say(text):
    print(text, file=sys.stderr, flush=True)


def measure(make, work, pairs, names):
    """Pairs of each setting, interleaved so that a slow hour of the machine is shared. make: (name, level) to renderer;
    pairs: how many of each. Returns settings and the files of their pairs."""
    found = {key: [] for key in names}
    files = {}
    for number in range(max(pairs(key) for key in names)):
        for key in names:
            if number >= pairs(key):
                continue
            pair, files[key] = renderers.pair_of_runs(make(key), work, number)
            found[key].append(pair)
            say(f"{work.name}: {key[0]}, {key[1]}: {pair.cpu.mean():.2f} CPU s")
    settings = {key: errors.Setting(*key, found[key], work.block_pixels()) for key in names}
    return settings, files


def renderer_of(key):
    name, level = key
    return renderers.Cycles(level) if name == "Cycles" else renderers.Baton(level, name, VARIANTS[name].changes)


def agreement(work, fault):
    """Whether both renderers show the test picture alike, and the difference."""
    pairs = {}
    for key, renderer in {("Cycles", CHECK_SPP): renderers.Cycles(CHECK_SPP, fault=fault),
                          (THE_JOB, CHECK_ROUNDS): renderers.Baton(CHECK_ROUNDS, THE_JOB, {})}.items():
        pairs[key] = errors.Setting(*key, [renderers.pair_of_runs(renderer, work, 0)[0]], work.block_pixels())
    d = errors.difference(*pairs.values())
    return abs(d.relative) < MOST_APART and d.z_squared < MOST_Z_SQUARED, d


def check_conventions(options):
    """Ends the program unless the test picture agrees, and each planted fault is seen."""
    work = renderers.Work(HERE / "scenes/test-picture.json", options.output / "test-picture", options.bin)
    work.place()
    for fault in ("", "turn", "mirror", "shift"):
        same, d = agreement(work, fault)
        say(f"test picture{', planted: ' + fault if fault else ''}: means {100 * d.relative:+.3f} % apart "
            f"(+- {196 * d.error:.3f} %), blocks {100 * d.systematic:.2f} %, z^2 {d.z_squared:.1f}")
        if same == bool(fault):
            raise renderers.Failed("the renderers do not show the same" if not fault else
                                   f"the planted fault \"{fault}\" was not seen")


def compare(job, options):
    """Measures one job. Returns the scene and a row of pictures."""
    work = renderers.Work(job, options.output / job.stem, options.bin)
    work.place()
    still = report.kind_of(work.placed) == "still"
    work.every = 1 if still else options.every
    levels = {"Cycles": options.spp or SPP[still]}
    for name, variant in VARIANTS.items():
        usual = variant.still_rounds if still else variant.sequence_rounds
        some = [rounds for rounds in options.rounds or usual if rounds >= variant.least_rounds]
        if usual and some:
            levels[name] = tuple(some)
    dearest = {"Cycles": max(levels["Cycles"]), **{name: max(levels[THE_JOB]) for name in VARIANTS}}

    def pairs(key):
        return max(1, min(options.pairs, dearest[key[0]] // (16 * key[1])))

    names = [(name, level) for name, some in levels.items() for level in some]
    settings, files = measure(renderer_of, work, pairs, names)
    curves = {name: [settings[name, level] for level in some] for name, some in levels.items()}
    finest = [renderers.last_frames(files[name, dearest[name]]) for name in ("Cycles", THE_JOB)]
    scene = report.Scene(work.placed, curves.pop("Cycles"), curves, errors.beyond_noise(*finest))
    other, own = report.equal_time(scene, 64)
    row = [report.cropped(renderers.last_frames(files[s.name, s.level])[0]) for s in (other, own)]
    row.append(report.cropped(finest[0].mean(0)))
    said = (f"{work.name}: Cycles {other.level} spp ({other.cpu():.1f} CPU s), Baton, {own.name}, {own.level} rounds "
            f"({own.cpu():.1f} CPU s), Cycles {dearest['Cycles']} spp twice")
    return scene, row, said


def machine():
    """What the numbers depend on."""
    model = next(line for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines() if "model name" in line)
    version = subprocess.run(["blender", "--version"], capture_output=True, text=True, check=True).stdout.splitlines()[0]
    return f"{model.split(': ')[1]}, {platform.machine()}; {version}"


def parse_arguments():
    def levels(text):
        return tuple(sorted(int(word) for word in text.split(",")))

    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("jobs", nargs="*", type=Path, metavar="JOB")
    parser.add_argument("--bin", type=Path, required=True, help="folder of Baton's programs")
    parser.add_argument("--output", type=Path, required=True)
    parser.add_argument("--spp", type=levels, help="of Cycles: 16,64,256")
    parser.add_argument("--rounds", type=levels, help="of Baton: 1,4,16")
    parser.add_argument("--every", type=int, default=4, help="of a sequence, Cycles renders every so-manyth frame (4)")
    parser.add_argument("--pairs", type=int, default=MOST_PAIRS, help="of the cheaper settings")
    return parser.parse_args()


def main():
    options = parse_arguments()
    if shutil.which("blender") is None:
        raise renderers.Failed("blender is not installed; ./run compare installs it")
    options.bin, options.output = options.bin.resolve(), options.output.resolve()
    jobs = options.jobs or sorted((HERE / "scenes").glob("[0-9]*.json"))
    options.output.mkdir(parents=True, exist_ok=True)
    check_conventions(options)

    scenes, rows, captions = [], [], []
    for job in jobs:
        scene, row, said = compare(job.resolve(), options)
        scenes.append(scene)
        rows.append(row)
        captions.append(said)
        # What is known so far, so that a long comparison can be looked at.
        text = report.text(scenes, [machine()]) + "\n".join(captions) + "\n"
        (options.output / "compare.md").write_text(text, encoding="utf-8")
        (options.output / "compare.json").write_text(report.numbers(scenes), encoding="utf-8")
        if len({picture.shape for one in rows for picture in one}) == 1:
            pictures.write_png(options.output / "compare.png", pictures.sheet(rows))
    print(text)


if __name__ == "__main__":
    try:
        main()
    except renderers.Failed as failed:
        say(f"compare: {failed}")
        sys.exit(1)

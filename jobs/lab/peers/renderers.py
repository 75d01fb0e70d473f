"""Runs Baton and Cycles on one job and keeps what pairs of runs say, so that a comparison can be continued."""

import hashlib
import json
import os
import re
import shutil
import subprocess
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

import errors
import pictures

HERE = Path(__file__).parent
# Of every rendering of Baton: all its sites' noise is in the pairs, all its light in the files.
FRAMES_AS_THEY_ARE = {"image.filter": "box", "output.aovs": "[]", "output.background": "environment",
                      "output.pixelType": "float", "output.compression": "none", "output.clampNegative": "false",
                      "output.pattern": "frame.####.exr", "light.filterGlossy": "false"}


class Failed(Exception):
    """A program that did not do its part, with what it said."""


def run(command, log):
    """Runs a program with its output in `log`; returns the CPU seconds of it and of all that it started and waited
    for, user and system."""
    with log.open("wb") as file:
        child = subprocess.Popen([str(word) for word in command], stdout=file, stderr=subprocess.STDOUT)
        _, status, used = os.wait4(child.pid, 0)
    child.returncode = os.waitstatus_to_exitcode(status)
    if child.returncode != 0:
        said = log.read_text(encoding="utf-8", errors="replace")[-2000:]
        raise Failed(f"{' '.join(map(str, command))}: exit code {child.returncode}\n{said}")
    return used.ru_utime + used.ru_stime


def settings_of(overrides):
    return [word for key, value in overrides.items() for word in ("--set", f"{key}={value}")]


@dataclass
class Work:
    """One job, placed for the other renderer, and where its runs are."""
    job: Path
    folder: Path
    bin: Path
    every: int = 1  # frames that errors are measured in, and that Cycles renders: the first, and every so-manyth
    placed: dict = field(default_factory=dict)
    digest: str = ""

    def place(self):
        target = self.folder / "placed"
        shutil.rmtree(target, ignore_errors=True)
        fixed = [f"{key}={value}" for key, value in FRAMES_AS_THEY_ARE.items()]
        self.folder.mkdir(parents=True, exist_ok=True)
        run([self.bin / "placed_scene", self.job, target, *fixed], self.folder / "placed.log")
        self.placed = json.loads((target / "scene.json").read_text(encoding="utf-8"))
        self.digest = digest_of(sorted(target.iterdir()))

    @property
    def name(self):
        return self.placed["name"]

    @property
    def files(self):
        return [frame["file"] for frame in self.placed["frames"][::self.every]]

    def log(self):
        return (self.folder / "last.log").read_text(encoding="utf-8", errors="replace")

    def block_pixels(self):
        return errors.block_sizes(self.placed["height"], self.placed["width"])


def digest_of(files):
    digest = hashlib.sha256()
    for file in files:
        digest.update(file.name.encode() + b"\0" + file.read_bytes())
    return digest.hexdigest()


@dataclass
class Cycles:
    """Cycles with `level` samples a pixel."""
    level: int
    name: str = "Cycles"
    fault: str = ""

    def identity(self, _):
        version = subprocess.run(["blender", "--version"], capture_output=True, text=True, check=True).stdout
        scripts = [HERE / f"{name}.py" for name in ("cycles_scene", "cycles_settings", "conventions")]
        return digest_of(scripts) + version + self.fault

    def command(self, work, seed, out):
        fault = ["--fault", self.fault] if self.fault else []
        return ["blender", "-b", "--factory-startup", "-noaudio", "--python-exit-code", "1",
                "-P", HERE / "cycles_scene.py", "--", work.folder / "placed", out, "--spp", self.level,
                "--seed", seed, "--threads", os.cpu_count(), "--every", work.every, *fault]

    def cpu_of_all(self, work, cpu):
        """CPU seconds if it had rendered all frames: each starts from nothing and takes as long as the others."""
        marks = [float(text) for text in re.findall(r"^CPU seconds: (.*)$", work.log(), re.MULTILINE)]
        left = len(work.placed["frames"]) - len(marks)
        return cpu + (left * (marks[-1] - marks[0]) / (len(marks) - 1) if left > 0 else 0)


@dataclass
class Baton:
    """Baton with `level` rounds; changes: of the job's settings."""
    level: int
    name: str
    changes: dict

    def identity(self, work):
        programs = [work.bin / name for name in ("baton", "baton-coordinator", "baton-worker")]
        return digest_of(programs) + json.dumps(self.changes, sort_keys=True)

    def command(self, work, seed, out):
        changes = {**FRAMES_AS_THEY_ARE, **self.changes, "quality.rounds": self.level, "seed": seed,
                   "output.directory": out}
        return [work.bin / "baton", "render", work.job, *settings_of(changes)]

    def cpu_of_all(self, _, cpu):
        return cpu


def render(renderer, work, seed):
    """The frames of one run that errors are measured in, (frames, height, width, 3), and the CPU seconds of all."""
    out = work.folder / "frames"
    shutil.rmtree(out, ignore_errors=True)
    cpu = run(renderer.command(work, seed, out), work.folder / "last.log")
    frames = np.stack([pictures.read_exr(out / file) for file in work.files])
    shutil.rmtree(out)
    return frames, renderer.cpu_of_all(work, cpu)


def pair_of_runs(renderer, work, number):
    """Pair `number` (from 0) of a setting, from disk where it was made before, and the path of its last frames."""
    key = f"{work.digest} {renderer.identity(work)} {renderer.level} {work.every} {number}"
    path = work.folder / "pairs" / (hashlib.sha256(key.encode()).hexdigest()[:24] + ".npz")
    if not path.exists():
        (a, cpu_a), (b, cpu_b) = (render(renderer, work, 2 * number + half + 1) for half in (0, 1))
        pair = errors.measure_pair(a, b, (cpu_a, cpu_b))
        path.parent.mkdir(exist_ok=True)
        unfinished = path.with_suffix(".tmp.npz")
        np.savez(unfinished, mse=pair.mse, grey_variance=pair.grey_variance, grey=pair.grey, cpu=pair.cpu,
                 last=np.stack([a[-1], b[-1]]))
        unfinished.rename(path)
    with np.load(path) as kept:
        return errors.Pair(kept["mse"], kept["grey_variance"], kept["grey"], kept["cpu"],
                           *errors.error_as_shown(*kept["last"])), path


def last_frames(path):
    """Both runs' last frames of a pair."""
    with np.load(path) as kept:
        return kept["last"]

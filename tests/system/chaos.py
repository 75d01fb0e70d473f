#!/usr/bin/env python3
"""Jobs of every kind on a farm whose programs and files are struck at random; every frame must come out right.

usage: chaos.py --bin FOLDER [--faults N] [--seed S] [--keep]

Real processes: one coordinator, three workers, three jobs at once (at rest, in motion, with a second pass), again and
again until N faults have struck. Then the farm is left alone, each job is submitted once more (frames may have been
removed) and must end as done, with the pixels of an undisturbed run, no job failed and no temporary file left.
"""

import argparse
import contextlib
import json
import os
import random
import shutil
import signal
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

from farm import PATIENCE, Farm, Fault, Programs, check, make_job, wait_until, write_job

NUM_WORKERS = 3
LONGEST_FREEZE_S = 5
END_S = 300 * PATIENCE

MOVING_CAMERA = [{"frame": 1, "position": [0, 1.2, 5], "lookAt": [0, 0.6, 0]},
                 {"frame": 6, "position": [0.5, 1.3, 4.6], "lookAt": [0, 0.6, 0]}]
KINDS = {
    "rest": {"frames": "1-8", "sampling": {"method": "sequential", "numCandidates": 256, "numDistributions": 12}},
    "motion": {"frames": "1-6", "sampling": {"method": "pool", "numParticles": 32, "numCandidates": 512},
               "camera": {"keys": MOVING_CAMERA}},
    "second-pass": {"frames": "1-5", "sampling": {"method": "bidirectional", "numCandidates": 512},
                    "visibility": {"correlated": True}},
}


class Job:
    """One submission of a kind of job."""

    def __init__(self, kind, number, folder):
        self.kind, self.frames = kind, folder / f"{kind}{number}"
        changes = {**KINDS[kind], "name": f"{kind} {number}", "output": {"directory": str(self.frames)},
                   "image": {"tileSize": 16}, "state": {"keep": "last"}}
        self.path = write_job(folder / f"{kind}{number}.json", make_job(folder / "assets", **changes))
        self.id = None


class Chaos:
    """Strikes a farm at random."""

    def __init__(self, farm, rng):
        self.farm, self.rng = farm, rng
        self.jobs, self.struck, self.frozen = [], Counter(), []
        self.faults = [self.kill_worker, self.kill_coordinator, self.freeze, self.end_worker, self.end_coordinator,
                       self.flip_byte, self.cut_blob, self.remove_blob, self.remove_frame, self.submit_again]

    def strike(self):
        """One fault that really struck."""
        while not self.rng.choice(self.faults)():
            time.sleep(0.02)

    def tend(self):
        """Starts again what is gone, and thaws what has been frozen long enough."""
        for until, pid in list(self.frozen):
            if time.monotonic() >= until:
                self.frozen.remove((until, pid))
                self.signal(pid, signal.SIGCONT)
        if not self.farm.coordinator.alive():
            self.farm.start_coordinator()
        self.farm.workers = [worker for worker in self.farm.workers if worker.alive()]
        while len(self.farm.workers) < NUM_WORKERS:
            self.start_worker()

    def start_worker(self):
        """With a name that no other worker has had."""
        name = f"worker-{self.struck.total()}-{self.rng.randrange(1 << 30)}"
        self.farm.start_worker(name=name)

    # ---- faults: each returns whether it struck ------------------------------------------------------------

    def kill_worker(self):
        return self.end(self.some_worker(), signal.SIGKILL, "worker killed")

    def kill_coordinator(self):
        return self.end(self.farm.coordinator, signal.SIGKILL, "coordinator killed")

    def end_worker(self):
        return self.end(self.some_worker(), signal.SIGTERM, "worker terminated")

    def end_coordinator(self):
        return self.end(self.farm.coordinator, signal.SIGTERM, "coordinator terminated")

    def freeze(self):
        worker = self.some_worker()
        if worker is None or any(pid == worker.pid for _, pid in self.frozen):
            return False
        self.signal(worker.pid, signal.SIGSTOP)
        wait_until(lambda: state_of(worker.pid) in ("T", "Z", None), "a worker is frozen")
        self.frozen.append((time.monotonic() + self.rng.uniform(0.2, LONGEST_FREEZE_S), worker.pid))
        return self.count("worker frozen")

    def flip_byte(self):
        def damage(path, content):
            at = self.rng.randrange(len(content))
            path.write_bytes(content[:at] + bytes([content[at] ^ 0x10]) + content[at + 1:])
        return self.harm_blob(damage, "byte of a blob changed")

    def cut_blob(self):
        return self.harm_blob(lambda path, content: path.write_bytes(content[:len(content) // 2]), "blob cut")

    def remove_blob(self):
        return self.harm_blob(lambda path, _: path.unlink(), "blob removed")

    def remove_frame(self):
        frames = [frame for job in self.jobs for frame in job.frames.glob("*.exr")]
        if not frames:
            return False
        self.rng.choice(frames).unlink()
        return self.count("frame removed")

    def submit_again(self):
        if not self.jobs or not self.farm.coordinator.alive():
            return False
        job = self.rng.choice(self.jobs)
        return self.farm.baton("job", "submit", job.path, expect=None).returncode == 0 and self.count("submitted again")

    # ---- helpers -------------------------------------------------------------------------------------------

    def some_worker(self):
        alive = [worker for worker in self.farm.workers if worker.alive()]
        return self.rng.choice(alive) if alive else None

    def end(self, process, number, what):
        if process is None or not process.alive() or any(pid == process.pid for _, pid in self.frozen):
            return False
        self.signal(process.pid, number)
        wait_until(lambda: not process.alive(), f"{what}: it has ended")
        return self.count(what)

    def harm_blob(self, harm, what):
        blobs = list(self.farm.work_folder.rglob("*.blob"))
        if not blobs:
            return False
        path = self.rng.choice(blobs)
        try:
            content = path.read_bytes()
            if not content:
                return False
            harm(path, content)
        except FileNotFoundError:  # removed by the farm meanwhile
            return False
        return self.count(what)

    def count(self, what):
        self.struck[what] += 1
        return True

    @staticmethod
    def signal(pid, number):
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, number)


def state_of(pid):
    """The letter of a process's state, None when it is gone."""
    try:
        return Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rsplit(")", 1)[1].split()[0]
    except FileNotFoundError:
        return None


def open_jobs(farm, jobs):
    """Those of the jobs that are not done. A failed one ends the test."""
    left = []
    for job in jobs:
        shown = farm.baton("job", "show", job.id, "--json", expect=None)
        if shown.returncode != 0:
            left.append(job)
            continue
        status = json.loads(shown.stdout)["status"]
        check(status not in ("failed", "cancelled"), f"job {job.path.stem} is {status}:\n{shown.stdout[-1500:]}")
        if status != "done":
            left.append(job)
    return left


def undisturbed(programs, folder):
    """Kind -> pixels of its frames."""
    pixels = {}
    for kind in KINDS:
        job = Job(kind, "-plain", folder)
        programs.render(job.path, folder / f"work-{kind}", threads=2)
        pixels[kind] = programs.pixels(job.frames)
    return pixels


def check_leftovers(farm):
    """What was being written when its writer died is removed by the next coordinator, once it is old."""
    unfinished = list(farm.work_folder.rglob("*.tmp"))
    for path in unfinished:
        os.utime(path, (0, 0))
    farm.coordinator.kill()
    farm.start_coordinator()
    left = [path for path in unfinished if path.exists()]
    check(not left, f"temporary files are left: {left[:3]}")


def run(programs, folder, num_faults, seed):
    """Everything. Raises Fault."""
    rng = random.Random(seed)
    expected = undisturbed(programs, folder)
    with Farm(programs, folder / "farm") as farm:
        farm.start_coordinator()
        chaos = Chaos(farm, rng)
        rounds = 0
        while chaos.struck.total() < num_faults:
            chaos.tend()
            if not open_jobs(farm, chaos.jobs):
                rounds += 1
                fresh = [Job(kind, rounds, folder) for kind in KINDS]
                for job in fresh:
                    job.id = farm.submit(job.path)
                chaos.jobs += fresh
            time.sleep(rng.uniform(0, 0.5))
            chaos.strike()

        # Leave it alone; what was removed is asked for once more.
        def all_done():
            chaos.tend()
            return not open_jobs(farm, chaos.jobs)
        wait_until(all_done, "all jobs are done", END_S)
        for job in chaos.jobs:
            job.id = farm.submit(job.path)
        wait_until(all_done, "all jobs are done once more", END_S)
        for job in chaos.jobs:
            got = programs.pixels(job.frames)
            for frame, pixels in expected[job.kind].items():
                check(got.get(frame) == pixels, f"{job.frames / frame}: {'other pixels' if frame in got else 'missing'}")
        check_leftovers(farm)
    faults = ", ".join(f"{count} {what}" for what, count in sorted(chaos.struck.items()))
    print(f"seed {seed}: {chaos.struck.total()} faults in {rounds} rounds ({faults}), all frames right")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--bin", required=True, help="folder of the programs")
    parser.add_argument("--faults", type=int, default=300)
    parser.add_argument("--seed", type=int, default=random.SystemRandom().randrange(1 << 30))
    parser.add_argument("--keep", action="store_true", help="leave the files")
    options = parser.parse_args()
    folder = Path(tempfile.mkdtemp(prefix="baton-chaos-"))
    try:
        run(Programs(options.bin), folder, options.faults, options.seed)
    except Fault as fault:
        print(f"seed {options.seed}: {fault}\nfiles are in {folder}")
        return 1
    if not options.keep:
        shutil.rmtree(folder, ignore_errors=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())

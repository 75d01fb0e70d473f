#!/usr/bin/env python3
"""Sequences of edits of jobs, each submitted while the one before is at work: names of files, frames both ways, AOVs, sweeps,
tiles; now and then with --restart, or frames once more. All workers give way to others, which render with another instruction set, and back. Waiters
are killed. Of each version that is left alone until it is done, the last one among them, every frame must be there and right,
all of them by one instruction set; no attempt may fail.

usage: edits.py --bin FOLDER [--sequences N] [--seed S] [--keep]
"""

import argparse
import contextlib
import json
import random
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from chaos_jobs import FOREIGN_ISA, KINDS, Job, Undisturbed, edits_of
from farm import BAD_INPUT, OK, PATIENCE, Farm, Fault, Programs, check, wait_until

EDITS, END_S = 5, 300 * PATIENCE
AT_ONCE = 4  # sequences on one farm
ISAS = ("auto", FOREIGN_ISA)
SWITCH_S = (1, 8)  # from one kind of workers to the other
NUM_WORKERS = 2


class Workers:
    """All of one instruction set, then all of the other."""

    def __init__(self, farm, seed):
        self.farm, self.rng, self.isa, self.num_switches, self.num_started = farm, random.Random(f"{seed} workers"), ISAS[0], 0, 0
        self.workers = []
        self.start()

    def start(self):
        for _ in range(NUM_WORKERS):
            self.num_started += 1
            self.workers.append(self.farm.start_worker(name=f"{self.isa}-{self.num_started}", extra=("--isa", self.isa)))
        self.next_at = time.monotonic() + self.rng.uniform(*SWITCH_S)

    def tend(self):
        if time.monotonic() >= self.next_at:
            self.switch()

    def switch(self):
        for worker in self.workers:
            worker.kill() if self.rng.random() < 0.05 else worker.terminate()
        for worker in self.workers:
            worker.wait()
        self.workers.clear()
        self.isa = ISAS[1] if self.isa == ISAS[0] else ISAS[0]
        self.num_switches += 1
        self.start()

    def wait_until_there(self):
        first = self.num_started - NUM_WORKERS + 1
        names = [f"worker {self.isa}-{number} joined" for number in range(first, self.num_started + 1)]
        wait_until(lambda: all(name in self.farm.coordinator.log() for name in names), f"{names}", END_S)


class Sequence:
    """One job and its edits."""

    def __init__(self, farm, workers, expected, number, seed):
        self.farm, self.workers, self.expected, self.rng, self.diary = farm, workers, expected, random.Random(seed), []
        self.job = Job(self.rng.choice(list(KINDS)), f"-{number}", farm.folder)
        self.next_at, self.waits_for_end = 0, False
        # Every third one begins with versions of fewer frames by others, and of all again.
        self.turn = 2 if number % 3 == 0 else 0
        self.left = EDITS

    def submit(self, *options):
        answer = self.farm.baton("job", "submit", self.job.path, "--json", *options, expect=None)
        if answer.returncode == BAD_INPUT and "pixels may differ" in answer.stderr:  # frames of the others are there
            self.diary.append("asked, --restart")
            answer = self.farm.baton("job", "submit", self.job.path, "--json", "--restart", expect=None)
        check(answer.returncode == OK, f"{self}: {answer.stderr}")
        ident = json.loads(answer.stdout)["id"]
        check(self.job.id in (None, ident), f"{self}: another ID, {ident} after {self.job.id}")
        self.job.id = ident

    def submit_turn(self):
        """What the first workers made of the frames that the version of the others has not: only --restart replaces it."""
        is_first = self.turn == 2
        if is_first:
            self.workers.switch()
            self.workers.wait_until_there()
        self.job.edit(frames="1-2" if is_first else f"1-{self.job.last}")
        self.submit(*(["--restart"] if is_first else []))
        self.diary.append(f"turn {self.turn}")
        self.turn -= 1
        self.left -= 1
        self.waits_for_end = True

    def requeue(self):
        """Some frames once more, whether they are there, in work or still to come."""
        shown = self.farm.show(self.job.id)
        first = self.rng.randint(1, self.job.last)
        frames = f"{first}-{self.rng.randint(first, self.job.last)}"
        answer = self.farm.baton("job", "requeue", self.job.id, "--frames", frames, "--yes", expect=None)
        self.diary.append(f"requeue {frames} of {shown['status']}")
        is_refused = answer.returncode == BAD_INPUT and ("pixels may differ" in answer.stderr or "it has no frames" in answer.stderr)
        check(answer.returncode == OK or is_refused, f"{self}: {answer.stderr}")

    def tend(self):
        """Edits the job when it is time. Returns whether it has ended."""
        if time.monotonic() < self.next_at:
            return False
        if self.waits_for_end:
            if self.farm.show(self.job.id)["status"] != "done":
                return False
            # The next version might make wrong frames anew.
            self.judge()
            self.waits_for_end = False
        if self.job.id is None:
            self.submit()
            self.waits_for_end = self.turn > 0
            return False
        elif self.left > 0 and self.turn > 0:
            self.submit_turn()
            return False
        elif self.left > 0 and self.rng.random() < 0.25:
            self.requeue()
            self.left -= 1
        elif self.left > 0:
            what, settings = self.rng.choice(edits_of(self.job, self.rng))
            self.job.edit(**settings)
            options = ["--restart"] if self.rng.random() < 0.4 else []
            # What is done is by the others then, and is made anew.
            if options and self.rng.random() < 0.5:
                self.workers.switch()
                self.workers.wait_until_there()
            self.diary.append(f"{what} {json.dumps(settings)}{' --restart' if options else ''}")
            self.submit(*options)
            self.left -= 1
        else:
            shown = self.farm.show(self.job.id)
            check(shown["status"] in ("running", "done"), f"{self}: {shown['status']}, {shown.get('waits')}")
            return shown["status"] == "done"
        if self.rng.random() < 0.3:
            waiter = subprocess.Popen([self.farm.programs.path("baton"), "job", "wait", self.job.id, "--coordinator",
                                       self.farm.endpoint], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            time.sleep(self.rng.uniform(0, 0.3))
            waiter.kill()
            waiter.wait()
        # From at once to after the end.
        self.next_at = time.monotonic() + self.rng.choice([0, 0.3, 1, 3]) * self.rng.random()
        self.waits_for_end = self.rng.random() < 0.3
        return False

    def judge(self):
        try:
            self.expected.check(self.job)
        except Fault as fault:
            raise Fault(f"{self}: {fault}") from fault

    def __str__(self):
        return f"{self.job.path.stem} after {'; '.join(self.diary)}"


def run(programs, folder, num_sequences, seed):
    """Everything. Raises Fault."""
    folder.mkdir(parents=True, exist_ok=True)
    expected = Undisturbed(programs, folder / "plain", isas=ISAS)
    num_edits = 0
    with contextlib.ExitStack() as stack:
        farm = stack.enter_context(Farm(programs, folder / "farm", workers=0))
        workers = Workers(farm, seed)
        for first in range(0, num_sequences, AT_ONCE):
            sequences = [Sequence(farm, workers, expected, number, f"{seed} {number}")
                         for number in range(first, min(first + AT_ONCE, num_sequences))]
            waiting = list(sequences)

            def all_done():
                workers.tend()
                waiting[:] = [sequence for sequence in waiting if not sequence.tend()]
                return not waiting
            wait_until(all_done, f"sequences {first} on are done: {', '.join(map(str, sequences))}", END_S)
            for sequence in sequences:
                num_edits += len(sequence.diary)
                sequence.judge()
                shutil.rmtree(sequence.job.frames)
        log = farm.coordinator.log()
        check("BUG" not in log, "the coordinator has found a bug")
        failed = [line for line in log.splitlines() if ": attempt " in line and " failed: " in line]
        check(not failed, f"{len(failed)} attempts have failed: {failed[:1]}")
    print(f"seed {seed}: {num_sequences} sequences, {num_edits} edits, {workers.num_switches} times other workers; all frames "
          "right")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--bin", required=True, help="folder of the programs")
    parser.add_argument("--sequences", type=int, default=200)
    parser.add_argument("--seed", type=int, default=random.SystemRandom().randrange(1 << 30))
    parser.add_argument("--keep", action="store_true", help="leave the files")
    options = parser.parse_args()
    folder = Path(tempfile.mkdtemp(prefix="baton-edits-"))
    try:
        run(Programs(options.bin), folder, options.sequences, options.seed)
    except Fault as fault:
        print(f"seed {options.seed}: {fault}\nfiles are in {folder}")
        return 1
    if not options.keep:
        shutil.rmtree(folder, ignore_errors=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())

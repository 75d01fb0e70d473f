#!/usr/bin/env python3
"""Random legal jobs, drawn from the schema itself, each rendered twice and judged.

Any job that `baton check` accepts must render, without a crash or a lost attempt, to numbers that are finite and do not
depend on tiles, runs, workers, threads or an interruption, and as `check` predicts; methods that claim to be unbiased
must have the mean of brute force (random_job_means.py). A job that fails is made smaller while it fails, and printed as
one JSON file with everything that is needed to repeat it.

usage: random_jobs.py --bin build/release/bin --source . [--seed S] [--jobs N] [--seconds T] [--parallel P] [--keep DIR]
       random_jobs.py --bin build/release/bin --source . --case FILE      repeat one case
       random_jobs.py --self-test      generator, judge and shrinker, without programs
TMPDIR=/dev/shm makes long runs faster. Exits 1 when a job fails. Standard library only."""

import argparse
import concurrent.futures
import json
import os
import sys
import tempfile
import threading
import time
import traceback
from collections import Counter
from pathlib import Path

from farm import Programs
from random_job_draws import draw_case
from random_job_judge import Judge, Refused, Wrong, remove
from random_job_shrink import shrink

# A failure is made smaller for so long; only the first few of a kind and method are.
SHRINK_SECONDS = 60
SHRUNK_OF_A_KIND = 1
# Failures that do not come every time.
TIMELY = {"lost attempts", "not done", "no end"}
# More refusals than this are a fault of the generator.
MOST_REFUSED = 0.2


class Run:
    """Judges cases in parallel and keeps account."""

    def __init__(self, judge, schema, options, folder):
        self.judge, self.schema, self.options, self.folder = judge, schema, options, Path(folder)
        self.keep = Path(options.keep or folder)
        self.keep.mkdir(parents=True, exist_ok=True)
        self.counts, self.failures, self.shrunk = Counter(), [], Counter()
        self.lock = threading.Lock()
        self.next_folder = 0

    def verdict(self, case):
        """None, a Wrong or a Refused."""
        with self.lock:
            self.next_folder += 1
            folder = self.folder / f"run{self.next_folder}"
        try:
            self.judge.judge(case, folder)
            return None
        except (Wrong, Refused) as found:
            return found
        finally:
            remove(folder)

    def one(self, number):
        """Draws and judges one case; makes it smaller and reports it when it fails."""
        case = draw_case(self.schema, self.options.seed, number)
        found = self.verdict(case)
        with self.lock:
            self.counts["jobs"] += 1
            self.counts[case["job"]["sampling"]["method"] if "spoiled" not in case else "spoiled"] += 1
            if isinstance(found, Refused):
                self.counts["refused spoiled" if "spoiled" in case else "refused"] += 1
                if "spoiled" not in case:
                    print(f"job {number} is refused: {found}", flush=True)
        if isinstance(found, Wrong):
            self.fail(number, case, found)

    def fail(self, number, case, found):
        """Makes the case smaller, unless others of its kind are known, and reports it."""
        sampling = case["job"].get("sampling")
        kind = (found.kind, sampling.get("method") if isinstance(sampling, dict) else None)
        with self.lock:
            self.shrunk[kind] += 1
            first = self.shrunk[kind] <= SHRUNK_OF_A_KIND
            self.failures.append(found.kind)
        print(f"job {number} of seed {self.options.seed}: {found}", flush=True)
        if first and self.options.shrink > 0:
            case = shrink(case, lambda smaller: self.fails_as(smaller, found.kind), self.options.shrink)
        path = self.keep / f"failed-{self.options.seed}-{number}.json"
        path.write_text(json.dumps(case, indent=1), encoding="utf-8")
        print(f"job {number}, {found.kind}: {json.dumps(case)}\nrepeat: python3 {Path(__file__).resolve()} "
              f"--bin {self.options.bin} --source {self.options.source} --case {path}", flush=True)

    def fails_as(self, case, kind):
        """Whether the case fails in that way; what depends on the moment has three tries."""
        for _ in range(3 if "interruption" in case["second"] or kind in TIMELY else 1):
            try:
                found = self.verdict(case)
            except (LookupError, TypeError, ValueError, AttributeError):
                return False  # no longer a case that can be judged
            if isinstance(found, Wrong) and found.kind == kind:
                return True
        return False

    def all(self):
        """Judges jobs until their number or the time is reached."""
        end = time.monotonic() + self.options.seconds
        with concurrent.futures.ThreadPoolExecutor(self.options.parallel) as pool:
            def guarded(number):
                if time.monotonic() >= end:
                    return
                try:
                    self.one(number)
                except Exception:  # a fault of the test itself must not pass unseen
                    with self.lock:
                        self.failures.append("fault of the test")
                    print(f"job {number}: fault of the test\n{traceback.format_exc()}", flush=True)
            list(pool.map(guarded, range(self.options.start, self.options.start + self.options.jobs)))


def parse_options(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bin", help="folder of the programs")
    parser.add_argument("--source", default=".", help="root of the project")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--start", type=int, default=0, help="number of the first job")
    parser.add_argument("--jobs", type=int, default=100)
    parser.add_argument("--seconds", type=float, default=1e9, help="no new job after so many seconds")
    parser.add_argument("--parallel", type=int, default=2 * (os.cpu_count() or 1))
    parser.add_argument("--keep", help="folder for failed cases; it is created")
    parser.add_argument("--shrink", type=float, default=SHRINK_SECONDS, help="seconds to make a failure smaller")
    parser.add_argument("--case", help="a case to repeat")
    parser.add_argument("--self-test", action="store_true")
    return parser.parse_args(arguments)


def run_jobs(options):
    """Judges the jobs that the options ask for; returns the number of failures."""
    schema = json.loads((Path(options.source) / "jobs/schema/job.schema.json").read_text(encoding="utf-8"))
    folder = Path(tempfile.mkdtemp(prefix="baton-random-"))
    judge = Judge(Programs(options.bin), folder)
    run = Run(judge, schema, options, folder)
    start = time.monotonic()
    run.all()
    seconds = time.monotonic() - start

    counts = run.counts
    by_method = ", ".join(f"{count} {what}" for what, count in sorted(counts.items()) if what != "jobs")
    print(f"seed {options.seed}: {counts['jobs']} jobs in {seconds:.0f} s, {counts['jobs'] / max(seconds, 1e-9):.1f} a "
          f"second; {len(run.failures)} failed {dict(Counter(run.failures))}; {by_method}", flush=True)
    print(f"{judge.num_scarce} of the second renderings had little memory", flush=True)
    if counts["refused"] > MOST_REFUSED * max(counts["jobs"], 10):
        run.failures.append("refusals")
        print("`baton check` refuses too many: the generator draws what is not legal", flush=True)
    if run.failures:
        print(f"failed cases are in {run.keep}")
    if not run.failures or options.keep:
        remove(folder)
    return len(run.failures)


def repeat(options):
    """Judges one case; prints what is wrong. Returns the number of failures."""
    case = json.loads(Path(options.case).read_text(encoding="utf-8"))
    folder = Path(options.keep or tempfile.mkdtemp(prefix="baton-random-"))
    try:
        Judge(Programs(options.bin), folder).judge(case, folder / "case")
        print("nothing is wrong")
    except Refused as found:
        print(f"refused: {found}")
    except Wrong as found:
        print(found)
        return 1
    finally:
        print(f"files are in {folder}")
    return 0


def main():
    options = parse_options()
    if options.self_test:
        from random_job_self_test import self_test
        return self_test(options.source)
    if not options.bin:
        print("--bin is needed", file=sys.stderr)
        return 64
    return 1 if (repeat(options) if options.case else run_jobs(options)) else 0


if __name__ == "__main__":
    sys.exit(main())

#!/usr/bin/env python3
"""A hundred random jobs, always the same, and the test of that test. More: random_jobs.py by hand."""

import json
import os
import random
import tempfile
from pathlib import Path

from farm import BAD_INPUT, OK, Fault, check, check_equal, check_says, run_tests
from jobs import make_job, write_job
from exr_frames import read_frame
from png_files import read_png
from random_job_draws import Draw
from random_job_files import write_file
from random_job_judge import Judge, Wrong
from random_job_rules import RULES, breaks
from random_job_self_test import self_test
from random_jobs import parse_options, run_jobs

SEED = 1
JOBS = 100
TRIED_OF_A_RULE = 4
MEMORY = "/dev/shm"
SOURCE = Path(__file__).resolve().parents[2]


def planted_faults_are_found(_programs, folder):
    check_equal(self_test(SOURCE), 0, "failures of the test itself")


class Saboteur(Judge):
    """Turns one bit of the last pixel of the second rendering."""

    def rendered(self, case, split, folder, name, predicted):
        frames = super().rendered(case, split, folder, name, predicted)
        if name == "second":
            path = sorted((folder / name).glob("*.exr"))[-1]
            data = bytearray(path.read_bytes())
            data[-4] ^= 1
            path.write_bytes(data)
            frames[path.name] = read_frame(path)
        return frames


def a_wrong_bit_is_found(programs, folder):
    job = make_job(folder / "files", frames="1-2", image={"width": 20, "height": 12},
                   output={"pixelType": "float", "aovs": []})
    case = {"job": job, "files": {}, "first": {"tileSize": 8, "workers": 1, "threads": 2, "checkpointEvery": 2}}
    case["second"] = {**case["first"], "tileSize": 64, "compression": "none"}
    Judge(programs, folder).judge(case, folder / "untouched")
    try:
        Saboteur(programs, folder).judge(case, folder / "touched")
    except Wrong as found:
        check("frame.0002.exr" in str(found) and "1 of 240 pixels of R, first at (19, 11)" in str(found), str(found))
        return
    check(False, "nobody saw a bit that was turned")


def frames_that_differ_leave_pictures(programs, folder):
    """Of another seed: both frames, and where they are apart."""
    jobs = [make_job(folder / str(seed), frames="1", seed=seed, image={"width": 20, "height": 12}) for seed in (1, 2)]
    one, other = (programs.rendered(folder / str(job["seed"]), job) for job in jobs)
    check_equal(one, programs.pixels(folder / "1/frames"), "frames and themselves")
    try:
        check_equal(other, one, "frames of two seeds")
    except Fault as found:
        left = folder / "2/frames-frame.0001-differs"
        check_says(str(found), "frames of two seeds", "frame.0001.exr", str(left))
        sizes = [read_png(left / f"{name}.png")[:2] for name in ("got", "expected", "difference")]
        check_equal(sizes, [(20, 12)] * 3, "sizes")
        texels = {value for row in read_png(left / "difference.png")[2] for value in row}
        check(127 in texels and texels & {0, 255}, f"values of the difference: {sorted(texels)}")
        return
    check(False, "frames of two seeds are equal")


def rules_are_those_of_check(programs, folder):
    """What obeys all of them is accepted, what breaks one alone is refused."""
    schema = json.loads((SOURCE / "jobs/schema/job.schema.json").read_text(encoding="utf-8"))
    for rule in [None, *RULES]:
        tried = 0
        for number in range(600):
            case = Draw(schema, random.Random(number), without=rule).case()
            if rule is None or (isinstance(case["job"]["scene"], dict) and breaks(case["job"], rule)):
                place = folder / f"{rule.__name__ if rule else 'all'}-{number}"
                for name, recipe in case["files"].items():
                    write_file(place / name, recipe, folder)
                done = programs.run("baton", "check", write_job(place / "job.json", case["job"]), expect=None)
                check_equal(done.returncode, BAD_INPUT if rule else OK, f"{place}: exit code, which says\n{done.stderr}")
                tried += 1
            if tried == TRIED_OF_A_RULE:
                break
        check(tried == TRIED_OF_A_RULE, f"{rule}: {tried} jobs break it")


def random_jobs_render(programs, folder):
    """In memory where there is some: the store waits for the disk."""
    if os.access(MEMORY, os.W_OK):
        tempfile.tempdir = MEMORY
    options = parse_options(["--bin", str(programs.bin), "--source", str(SOURCE), "--seed", str(SEED),
                             "--jobs", str(JOBS), "--keep", str(folder), "--shrink", "20"])
    check_equal(run_jobs(options), 0, f"failures of {JOBS} random jobs with seed {SEED}")


if __name__ == "__main__":
    run_tests()

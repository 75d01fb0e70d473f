#!/usr/bin/env python3
"""A hundred random jobs, always the same, and the test of that test. More: random_jobs.py by hand."""

import os
import tempfile
from pathlib import Path

from farm import check_equal, run_tests
from random_job_self_test import self_test
from random_jobs import parse_options, run_jobs

SEED = 1
JOBS = 100
MEMORY = "/dev/shm"
SOURCE = Path(__file__).resolve().parents[2]


def planted_faults_are_found(_, folder):
    check_equal(self_test(SOURCE), 0, "failures of the test itself")


def random_jobs_render(programs, folder):
    """In memory where there is some: the store waits for the disk."""
    if os.access(MEMORY, os.W_OK):
        tempfile.tempdir = MEMORY
    options = parse_options(["--bin", str(programs.bin), "--source", str(SOURCE), "--seed", str(SEED),
                             "--jobs", str(JOBS), "--keep", str(folder), "--shrink", "20"])
    check_equal(run_jobs(options), 0, f"failures of {JOBS} random jobs with seed {SEED}")


if __name__ == "__main__":
    run_tests([planted_faults_are_found, random_jobs_render])

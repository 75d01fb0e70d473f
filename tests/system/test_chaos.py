#!/usr/bin/env python3
"""The short form of chaos.py, whose faults are random but for their seed."""

import os
import subprocess
from pathlib import Path

from chaos import run
from chaos_disk import PowerCut, enter_namespace
from farm import check, check_equal, run_tests
from jobs import make_job, write_job

NUM_FAULTS, SEED = 25, 1


def a_power_cut_sees_what_it_might_take(programs, folder):
    """Blobs and frames get their names before the witness's eyes."""
    if not Path(programs.path("libsync_witness.so")).exists():
        return
    folder.mkdir(parents=True, exist_ok=True)
    power = PowerCut(programs, folder)
    job = write_job(folder / "job.json", make_job(folder, frames="1-2"))
    subprocess.run([programs.path("baton"), "render", job, "--workers", "1", "--work-dir", folder / "work"], check=True,
                   capture_output=True, env={**os.environ, **power.environment})
    named = [line.split()[2] for line in (folder / "syncs").read_text(encoding="ascii").splitlines() if line.startswith("rename")]
    check(any(name.endswith(".blob") for name in named), "no blob got its name")
    check_equal(sorted(name for name in named if name.endswith(".exr")), sorted(map(str, (folder / "frames").glob("*.exr"))),
                "frames that got their names")
    check(not [name for name in power.at_risk() if name.endswith(".exr")], "a frame had its name before it was on the disk")


def every_frame_is_right_after_random_faults(programs, folder):
    run(programs, folder, NUM_FAULTS, SEED)


if __name__ == "__main__":
    enter_namespace()
    run_tests()

#!/usr/bin/env python3
"""The short form of chaos.py, whose faults are random but for their seed."""

import os
import subprocess
import time
from pathlib import Path

import chaos_witness as witness
from chaos import run
from chaos_disk import PowerCut, enter_namespace
from chaos_jobs import Job
from farm import Farm, Fault, check, check_equal, run_tests
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


def a_lease_that_is_taken_is_seen(_programs, _folder):
    """By the witness, unless something that it knows has taken it."""
    def seen(ms, kind, worker=1, version="aa", attempt=1, epoch=1):
        return witness.Seen(ms, worker, kind, (version, witness.RENDER, 0, 0), (attempt, epoch), ())

    def is_told(messages, returns=(), struck_ms=(), epochs=((0, 1),), ends=()):
        try:
            witness.check_nothing_revoked(messages, returns, struck_ms, epochs, ends, {"aa": "0123", "bb": "4567"})
        except Fault:
            return True
        return False

    taken = [seen(1000, "LeaseGrant"), seen(2600, "LeaseRevoke")]
    check(is_told(taken), "nothing has taken it")
    check(not is_told(taken[:1] + [seen(1500, "LeaseGrant", worker=2, attempt=2)] + taken[1:]), "another worker has it")
    for what, excused, not_excused in [("returns", [(2000, 1)], [(2000, 2)]), ("struck_ms", [2000], [500]),
                                       ("epochs", [(2500, 2)], [(2700, 2)]), ("ends", [("01", 2000)], [("45", 2000)]),
                                       ("ends", [("01", 1000)], [("01", 500)])]:
        check(not is_told(taken, **{what: excused}), f"{what} {excused} have taken it")
        check(is_told(taken, **{what: not_excused}), f"{what} {not_excused} have not taken it")
    unknown = [seen(1000, "LeaseGrant", version="cc"), seen(2600, "LeaseRevoke", version="cc")]
    check(not is_told(unknown, ends=[("45", 2000)]), "a version whose submission was not answered may be of any job")


def what_ends_a_version_is_in_the_log(programs, folder):
    with Farm(programs, folder / "farm") as farm:
        job = Job("rest", 1, farm.folder)
        since_ms = 1000 * time.monotonic()
        ident = farm.submit(job.path)
        farm.submit(job.edit(image={"tileSize": 32}))
        ended = witness.superseded(farm.coordinator.log())
        check_equal([ident.startswith(name) for name, _ in ended], [True], "versions that have ended")
        check(since_ms - witness.LOG_MS <= ended[0][1] <= 1000 * time.monotonic() + witness.LOG_MS, f"when: {ended}")


def every_frame_is_right_after_random_faults(programs, folder):
    run(programs, folder, NUM_FAULTS, SEED)


if __name__ == "__main__":
    enter_namespace()
    run_tests()

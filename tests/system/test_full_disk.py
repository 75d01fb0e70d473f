#!/usr/bin/env python3
"""A disk that is full costs time, but neither frames nor attempts. Needs user namespaces, to mount a small disk of its own."""

import json
import subprocess

from farm import OK, Process, check, check_equal, run_tests, wait_until
from jobs import make_job, write_job

# In a mount namespace: a disk of 32 MiB at $1 with 1 MiB left, and the command; the rest goes when $1.free appears.
SMALL_DISK = """
set -e
mkdir -p "$1" && mount -t tmpfs -o size=32m none "$1"
head -c 31M /dev/zero > "$1/filler"
(while ! [ -e "$1.free" ]; do sleep 0.05; done; rm "$1/filler") &
disk=$1; shift
"$@"
"""


def can_mount():
    """Whether this machine lets a test mount anything."""
    command = ["unshare", "--map-root-user", "--mount", "sh", "-c", "mount -t tmpfs none /mnt"]
    return subprocess.run(command, check=False, capture_output=True).returncode == OK


def a_full_disk_is_waited_for(programs, folder):
    job = make_job(folder / "witness", frames="1-6")
    programs.render(write_job(folder / "witness/job.json", job), folder / "witness/work")
    job = make_job(folder / "full", frames="1-6")
    path = write_job(folder / "full/job.json", job)
    disk = folder / "disk"
    render = Process(["unshare", "--map-root-user", "--mount", "sh", "-c", SMALL_DISK, "sh", str(disk),
                      programs.path("baton"), "render", str(path), "--work-dir", str(disk / "work"), "--json"],
                     folder / "render.log")
    wait_until(lambda: "waits for space" in render.log() or not render.alive(), "the render waits")
    check(render.alive(), f"ended, expected to wait:\n{render.log()}")
    check("are left to frames and the journal" in render.log(), render.log())
    (folder / "disk.free").touch()
    wait_until(lambda: not render.alive(), "the render ends")
    log = render.log()
    summary = json.loads(log[log.index("{"):log.rindex("}") + 1])
    check_equal(summary["status"], "done", "status")
    check_equal(summary["attemptsLost"], 0, "attempts lost")
    check_equal(programs.pixels(folder / "full/frames"), programs.pixels(folder / "witness/frames"), "pixels")


if __name__ == "__main__":
    if can_mount():
        run_tests()
    else:
        print("skipped: this machine has no user namespaces")

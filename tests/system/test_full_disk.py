#!/usr/bin/env python3
"""A disk that is full costs time, but neither frames nor attempts. Needs user namespaces, to mount a small disk of its own."""

import json
import subprocess

from farm import OK, Process, check, check_equal, run_tests, wait_until
from jobs import make_job, write_job

FRAMES = 24

# In a mount namespace: a disk of 32 MiB at $1 with $2 of it filled, and the command; the last byte is filled when $1.fill
# appears, and all of that goes when $1.free does.
SMALL_DISK = """
set -e
disk=$1
mkdir -p "$disk" && mount -t tmpfs -o size=32m none "$disk"
head -c "$2" /dev/zero > "$disk/filler"
wait_for() { while ! [ -e "$disk.$1" ]; do [ -e "/proc/$$" ] || exit 0; sleep 0.05; done; }
(wait_for free; rm "$disk"/filler*) &
(wait_for fill; cat /dev/zero > "$disk/filler-all" 2>/dev/null || true; touch "$disk.full") &
shift; shift
exec "$@"
"""


def can_mount():
    """Whether this machine lets a test mount anything."""
    command = ["unshare", "--map-root-user", "--mount", "sh", "-c", "mount -t tmpfs none /mnt"]
    return subprocess.run(command, check=False, capture_output=True).returncode == OK


def start_on_small_disk(programs, folder, filled):
    """A render whose work folder is on that disk."""
    path = write_job(folder / "full/job.json", make_job(folder / "full", frames=f"1-{FRAMES}"))
    disk = folder / "disk"
    return Process(["unshare", "--map-root-user", "--mount", "sh", "-c", SMALL_DISK, "sh", str(disk), filled, programs.path("baton"),
                    "render", str(path), "--work-dir", str(disk / "work"), "--json"], folder / "render.log")


def check_waits_and_goes_on(programs, folder, render):
    """It says that it waits; where there is room it ends with all frames and no attempt lost."""
    wait_until(lambda: "waits for space" in render.log() or not render.alive(), "the render waits")
    check(render.alive(), f"ended, expected to wait:\n{render.log()}")
    check("are left to frames and the journal" in render.log(), render.log())
    (folder / "disk.free").touch()
    wait_until(lambda: not render.alive(), "the render ends")
    log = render.log()
    summary = json.loads(log[log.index("{"):log.rindex("}") + 1])
    check_equal(summary["status"], "done", "status")
    check_equal(summary["attemptsLost"], 0, "attempts lost")
    check("disk is full" not in log, log)
    job = make_job(folder / "witness", frames=f"1-{FRAMES}")
    programs.render(write_job(folder / "witness/job.json", job), folder / "witness/work")
    check_equal(programs.pixels(folder / "full/frames"), programs.pixels(folder / "witness/frames"), "pixels")


def a_full_disk_is_waited_for(programs, folder):
    check_waits_and_goes_on(programs, folder, start_on_small_disk(programs, folder, "31M"))


def a_disk_that_others_fill_to_the_last_byte_is_waited_for(programs, folder):
    """What the journal writes meanwhile finds the room that it has taken before."""
    render = start_on_small_disk(programs, folder, "8M")
    wait_until(lambda: list((folder / "full/frames").glob("*.exr")) or not render.alive(), "a frame is written")
    (folder / "disk.fill").touch()
    wait_until((folder / "disk.full").exists, "the disk is full")
    check_waits_and_goes_on(programs, folder, render)


if __name__ == "__main__":
    if can_mount():
        run_tests()
    else:
        print("skipped: this machine has no user namespaces")

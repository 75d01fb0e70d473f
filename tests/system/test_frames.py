#!/usr/bin/env python3
"""Frames and folders that are harmed while a job runs: "done" means that every frame is there and right, without another
submission."""

import json
import os
import re
import shutil
import signal
import time
from pathlib import Path

from farm import BAD_INPUT, DEADLINE_S, IO, OK, Farm, Process, check, check_equal, check_says, run_tests, wait_until
from jobs import make_job, write_job

FRAMES = 8
STANDSTILL_S = 5  # longer than a worker may be silent


def make(folder, **changes):
    return write_job(folder / "job.json", make_job(folder, **{"frames": f"1-{FRAMES}", "image": {"tileSize": 32}, **changes}))


def _undisturbed(programs, folder):
    programs.render(make(folder / "witness"), folder / "witness/work", threads=2)
    return programs.pixels(folder / "witness/frames")


def frame(folder, number):
    return folder / f"frames/frame.{number:04d}.exr"


def begin(farm, folder, num_done=2, make_job_file=make):
    """Submits the job and has its first frames made, then nobody works. Returns its ID."""
    worker = farm.start_worker()
    ident = farm.submit(make_job_file(folder))
    wait_until(lambda: farm.show(ident)["framesDone"] >= num_done, "frames are done")
    worker.terminate()
    worker.wait()
    check(farm.show(ident)["framesDone"] < FRAMES, "all was done too soon")
    return ident


def finish(farm, ident, expect=OK):
    farm.start_worker()
    return farm.baton("job", "wait", ident, expect=expect)


def make_unreadable_picture(programs, path):
    """Changes one byte so that not all pixels can be decoded."""
    content = path.read_bytes()
    for at in range(len(content) // 2, len(content)):
        path.write_bytes(content[:at] + bytes([content[at] ^ 0x10]) + content[at + 1:])
        if programs.run("exr_digest", path, expect=None).returncode != OK:
            return
    check(False, f"{path}: no byte makes it unreadable")


def harmed_frames_are_made_again(programs, folder):
    expected = _undisturbed(programs, folder)
    harms = {"removed": lambda path: path.unlink(),
             "cut": lambda path: path.write_bytes(path.read_bytes()[:1000]),
             "emptied": lambda path: path.write_bytes(b""),
             "no-picture": lambda path: path.write_text("not a picture", encoding="ascii"),
             "damaged": lambda path: make_unreadable_picture(programs, path)}
    for name, harm in harms.items():
        place = folder / name
        with Farm(programs, place / "farm") as farm:
            ident = begin(farm, place)
            harm(frame(place, 1))
            finish(farm, ident)
            shown = farm.show(ident)
            check_equal((shown["status"], shown["framesDone"]), ("done", FRAMES), f"job whose frame was {name}")
            check_says(farm.coordinator.log(), "frame.0001.exr is gone, or not as it was written, and is made again")
        check_equal(programs.pixels(place / "frames"), expected, f"pixels after a frame was {name}")


def a_frame_is_missed_after_a_restart(programs, folder):
    expected = _undisturbed(programs, folder)
    with Farm(programs, folder / "farm") as farm:
        ident = begin(farm, folder)
        farm.coordinator.kill()
        frame(folder, 1).unlink()
        make_unreadable_picture(programs, frame(folder, 2))
        farm.start_coordinator()
        finish(farm, ident)
    check_equal(programs.pixels(folder / "frames"), expected, "pixels")


def somebody_elses_picture_is_kept(programs, folder):
    """The job fails, says which frame it is, and goes on only with --restart."""
    expected = _undisturbed(programs, folder)
    other = folder / "other"
    programs.render(make(other, seed=77), other / "work", threads=2)
    painted = frame(other, 2).read_bytes()
    with Farm(programs, folder / "farm") as farm:
        ident = begin(farm, folder)
        frame(folder, 2).write_bytes(painted)
        words = ["frame.0002.exr is not what a job has written", "--restart"]
        check_says(finish(farm, ident, expect=IO).stdout, *words)
        check_equal(farm.show(ident)["status"], "failed", "status")
        for command in (["submit", folder / "job.json"], ["retry", ident]):
            check_says(farm.baton("job", *command, expect=IO).stderr, *words)
        check_equal(frame(folder, 2).read_bytes(), painted, "the other picture")
        farm.baton("job", "submit", folder / "job.json", "--restart")
        farm.wait_for(ident)
    check_equal(programs.pixels(folder / "frames"), expected, "pixels")


def render_says_what_is_wrong(programs, folder):
    """The same of the one command: its exit code, and the way on."""
    expected = _undisturbed(programs, folder)
    other = folder / "other"
    programs.render(make(other, seed=77), other / "work", threads=2)
    path = make(folder, sampling={"numCandidates": 512, "numDistributions": 48})
    command = [programs.path("baton"), "render", str(path), "--workers", "1", "--threads-per-worker", "1",
               "--work-dir", str(folder / "work")]
    running = Process(command, folder / "render.log")
    wait_until(frame(folder, 1).exists, "the first frame is written")
    time.sleep(0.3)  # until it is reported
    frame(folder, 1).write_bytes(frame(other, 1).read_bytes())
    check_equal(running.wait(), IO, "exit code")
    check_says(running.log(), "frame.0001.exr is not what a job has written", "--restart")
    check_says(programs.run("baton", *command[1:], expect=IO).stderr, "frame.0001.exr is not what a job has written")
    programs.run("baton", *command[1:], "--restart")
    check_equal(sorted(programs.pixels(folder / "frames")), sorted(expected), "frames")


def another_folder_is_not_the_folder(programs, folder):
    """Renamed, and an empty one in its place: the job pauses, and goes on when it is back."""
    expected = _undisturbed(programs, folder)
    for name in ("gone", "empty"):
        place = folder / name
        with Farm(programs, place / "farm") as farm:
            ident = begin(farm, place)
            (place / "frames").rename(place / "away")
            if name == "empty":
                (place / "frames").mkdir()
            farm.start_worker()
            shown = wait_until(lambda: (lambda s: s if s["status"] == "paused" else None)(farm.show(ident)), "it is paused")
            check_says(shown["waits"], "its output folder", str(place / "frames"))
            check(not list((place / "frames").glob("*.exr")), "frames went to the wrong folder")
            for command in (["submit", place / "job.json"], ["resume", ident]):
                check_says(farm.baton("job", *command, expect=IO).stderr, str(place / "frames"))
            if name == "empty":
                (place / "frames").rmdir()
            (place / "away").rename(place / "frames")
            farm.baton("job", "resume", ident)
            farm.wait_for(ident)
        check_equal(programs.pixels(place / "frames"), expected, f"pixels, {name}")
        check(not list((place / "frames").glob(".baton-*")), "the mark stays")


def a_lost_folder_is_made_again_on_demand(programs, folder):
    expected = _undisturbed(programs, folder)
    with Farm(programs, folder / "farm") as farm:
        ident = begin(farm, folder)
        (folder / "frames").rename(folder / "away")
        farm.start_worker()
        wait_until(lambda: farm.show(ident)["status"] == "paused", "it is paused")
        farm.baton("job", "submit", folder / "job.json", "--restart")
        farm.wait_for(ident)
    check_equal(programs.pixels(folder / "frames"), expected, "pixels")


def a_frame_that_cannot_be_read_pauses_the_job(programs, folder):
    """A folder in its place, and another frame that is gone: neither counts as there."""
    expected = _undisturbed(programs, folder)
    with Farm(programs, folder / "farm") as farm:
        ident = begin(farm, folder)
        for number in (1, 2):
            frame(folder, number).unlink()
        frame(folder, 1).mkdir()
        farm.start_worker()
        shown = wait_until(lambda: (lambda s: s if s["status"] == "paused" else None)(farm.show(ident)), "it is paused")
        check_says(shown["waits"], "frame.0001.exr: is a folder, expected a file")
        for command in (["submit", folder / "job.json"], ["resume", ident]):
            check_says(farm.baton("job", *command, expect=IO).stderr, "frame.0001.exr: is a folder")
        frame(folder, 1).rmdir()
        farm.baton("job", "resume", ident)
        farm.wait_for(ident)
    check_equal(programs.pixels(folder / "frames"), expected, "pixels")


def what_nobody_here_has_written_is_not_replaced(programs, folder):
    """A picture in the place of a frame that is still to be rendered: another program's, or of a job whose work folder is gone."""
    expected = _undisturbed(programs, folder)
    other = folder / "other"
    programs.render(make(other, seed=77), other / "work", threads=2)
    strange = frame(other, 3).read_bytes()

    def refused(place, *arguments):
        command = ["render", make(place, **dict(arguments)), "--work-dir", place / "work", "--threads-per-worker", "2"]
        check_says(programs.run("baton", *command, expect=IO).stderr, "frame.0003.exr is not what a job has written", "--restart")
        check_equal(frame(place, 3).read_bytes(), strange, "the other picture")
        programs.run("baton", *command, "--restart")
        check_equal(programs.pixels(place / "frames"), expected, f"pixels, {place.name}")

    fresh = folder / "fresh"
    frame(fresh, 3).parent.mkdir(parents=True)
    frame(fresh, 3).write_bytes(strange)
    refused(fresh)

    longer = folder / "longer"
    programs.render(make(longer, frames="1-2"), longer / "work", threads=2)
    frame(longer, 3).write_bytes(strange)
    refused(longer)

    # A whole folder of them, of a job that nobody knows any more.
    forgotten = folder / "forgotten"
    programs.render(make(forgotten, seed=77), forgotten / "work", threads=2)
    shutil.rmtree(forgotten / "work")
    command = ["render", make(forgotten), "--work-dir", forgotten / "work"]
    check_says(programs.run("baton", *command, expect=IO).stderr, "frame.0008.exr are not what a job has written")

    # The same job again makes the same frames.
    programs.render(make(forgotten, seed=77), forgotten / "work", threads=2)
    check_equal(programs.pixels(forgotten / "frames"), programs.pixels(other / "frames"), "pixels of the same job")


def what_is_no_file_in_the_place_of_a_frame_is_waited_for(programs, folder):
    expected = _undisturbed(programs, folder)
    kinds = {"a folder": (Path.mkdir, Path.rmdir), "no plain file": (os.mkfifo, Path.unlink),
             "a loop of links": (lambda path: path.symlink_to(path), Path.unlink)}
    with Farm(programs, folder / "farm") as farm:
        for name, (put, remove) in kinds.items():
            place = folder / name.replace(" ", "-")
            ident = begin(farm, place)
            put(frame(place, FRAMES))
            worker = farm.start_worker()
            shown = wait_until(lambda: (lambda s: s if f"frame.{FRAMES:04d}.exr: is {name}" in s.get("waits", "") else None)
                               (farm.show(ident)), f"it waits for the place of the frame, {name}")
            check_equal((shown["status"], shown["failures"]), ("running", []), "a job that waits")
            remove(frame(place, FRAMES))
            farm.wait_for(ident)
            worker.terminate()
            worker.wait()
            check_equal(programs.pixels(place / "frames"), expected, f"pixels, {name}")


def an_output_folder_that_cannot_be_made_is_refused(programs, folder):
    with Farm(programs, folder / "farm") as farm:
        for name in ("file", "loop", "below"):
            place = folder / name
            path = make(place)
            if name == "loop":
                (place / "frames").symlink_to(place / "frames")
            elif name == "file":
                (place / "frames").write_text("", encoding="ascii")
            else:
                job = json.loads(path.read_text(encoding="utf-8"))
                (place / "a").write_text("", encoding="ascii")
                job["output"]["directory"] = str(place / "a/b")
                path.write_text(json.dumps(job), encoding="utf-8")
            check_says(farm.baton("job", "submit", path, expect=IO).stderr, "the output folder cannot be made")
        check_equal(json.loads(farm.baton("job", "list", "--all", "--json").stdout)["jobs"], [], "jobs")


def a_locked_frame_outlives_everything(programs, folder):
    """An edited frame stays through its own job's end, --restart with another picture, other sweeps, more frames and other
    names, and the death of the coordinator; a locked frame that is gone is told of."""
    def make_loose(place, **changes):
        return make(place, **{"state": {"carry": False}, **changes})

    other = folder / "other"
    programs.render(make_loose(other, seed=77), other / "work", threads=2)
    painted = frame(other, 2).read_bytes()
    with Farm(programs, folder / "farm") as farm:
        ident = begin(farm, folder, make_job_file=make_loose)
        frame(folder, 2).write_bytes(painted)
        check_says(finish(farm, ident, expect=IO).stdout, f"`baton job lock {ident[:8]} --frames 2` keeps it for good")
        check_says(farm.baton("job", "lock", ident, "--frames", "2").stderr, "frames 2 are locked", f"baton job retry {ident[:8]}")
        farm.baton("job", "retry", ident)
        farm.wait_for(ident)
        check_says(farm.baton("job", "show", ident).stdout, "locked     2\n")

        def goes_on(*extra, says="frame 2 is locked and stays as it is", at=2, **changes):
            said = farm.baton("job", "submit", make_loose(folder, **changes), "--json", *extra)
            answer = json.loads(said.stdout)
            check_says(answer["plan"], says)
            check_equal(answer["id"], ident, "ID")
            farm.wait_for(ident)
            check_equal(frame(folder, at).read_bytes(), painted, f"the edited frame after {extra} {changes}")
            check_equal(farm.show(ident)["locked"], [2], "locked frames")

        goes_on(quality={"sweeps": 2})
        farm.coordinator.kill()
        farm.start_coordinator()
        goes_on(quality={"sweeps": 2}, frames=f"1-{FRAMES + 2}", says="frames 1-8 are kept")
        goes_on("--restart", seed=5)
        goes_on("--from-frame", "2", seed=6)
        witness = folder / "witness"
        programs.render(make_loose(witness, seed=6), witness / "work", threads=2)
        expected = programs.pixels(witness / "frames")
        got = programs.pixels(folder / "frames")
        check_equal([got[f"frame.{n:04d}.exr"] for n in range(3, FRAMES + 1)],
                    [expected[f"frame.{n:04d}.exr"] for n in range(3, FRAMES + 1)], "pixels of the others")

        # Under another name the locked frame is not there.
        renamed = {"output": {"pattern": "beauty.####.exr"}}
        words = ["beauty.0002.exr is locked and not there", f"baton job lock {ident[:8]} --off --frames 2"]
        check_says(farm.baton("job", "submit", make_loose(folder, seed=6, **renamed), "--restart", expect=IO).stderr, *words)
        (folder / "frames/beauty.0002.exr").write_bytes(painted)
        goes_on(seed=6, frames=f"2-{FRAMES}", **renamed)
        check_equal((folder / "frames/beauty.0002.exr").read_bytes(), painted, "the edited frame under its new name")

        # Refused, and unlocked.
        for words, says in [(["--frames", "99"], "it has no frames 99"), (["--frames", "3", "--off"], "frames 3 are not locked")]:
            check_says(farm.baton("job", "lock", ident, *words, expect=BAD_INPUT).stderr, says)
        farm.baton("job", "lock", ident, "--frames", "2", "--off")
        check_says(farm.baton("job", "submit", make_loose(folder, seed=6, frames=f"2-{FRAMES}", **renamed), expect=IO).stderr,
                   "beauty.0002.exr is not what a job has written")

def a_picture_that_comes_before_its_frame_is_kept(programs, folder):
    """Nobody's here, it stays; --restart gives it up."""
    other = folder / "other"
    programs.render(make(other, seed=77), other / "work", threads=2)
    pictures = {number: frame(other, number).read_bytes() for number in (1, 3)}
    with Farm(programs, folder / "farm") as farm:
        ident = farm.submit(make(folder))
        for number, picture in pictures.items():
            frame(folder, number).write_bytes(picture)
        check_says(finish(farm, ident, expect=IO).stdout, "frame.0001.exr", "frame.0003.exr are not what a job has written here")
        for number, picture in pictures.items():
            check_equal(frame(folder, number).read_bytes(), picture, f"the picture in the place of frame {number}")
        check_equal(farm.show(ident)["framesDone"], FRAMES, "frames, those of others among them")
        frame(folder, 1).unlink()
        farm.baton("job", "submit", folder / "job.json", "--restart")
        farm.wait_for(ident)
    check_equal(programs.pixels(folder / "frames"), _undisturbed(programs, folder), "pixels after --restart")


def who_gave_a_picture_up_may_take_that_back(programs, folder):
    """--restart lets a painted frame go until the job is cancelled, or the frame is locked."""
    def painted_job(place):
        programs.render(make(place / "other", seed=77), place / "other/work", threads=2)
        return frame(place / "other", 2).read_bytes()

    for how in ("cancelled", "locked"):
        place = folder / how
        painted = painted_job(place)
        with Farm(programs, place / "farm") as farm:
            ident = begin(farm, place)
            frame(place, 2).write_bytes(painted)
            farm.baton("job", "cancel", ident)
            farm.baton("job", "submit", place / "job.json", "--restart")
            if how == "cancelled":
                farm.baton("job", "cancel", ident)
            else:
                farm.baton("job", "lock", ident, "--frames", "2")
                finish(farm, ident)
                farm.baton("job", "lock", ident, "--frames", "2", "--off")
            check_says(farm.baton("job", "submit", place / "job.json", expect=IO).stderr, "frame.0002.exr is not what a job has written")
            check_equal(frame(place, 2).read_bytes(), painted, f"the painted frame, {how}")


def a_locked_frame_is_not_written_by_a_worker_that_was_silent(programs, folder):
    """It was stopped while it wrote the frame, and lost its lease."""
    large = {"image": {"width": 640, "height": 400, "tileSize": 128}, "state": {"carry": False},
             "sampling": {"method": "environment", "numParticles": 1, "numCandidates": 1},
             "output": {"aovs": ["depth", "normal", "position", "albedo", "lns", "visibility", "unshadowed", "blocked"]}}
    with Farm(programs, folder / "farm") as farm:
        worker = farm.start_worker()
        ident = farm.submit(make(folder, **large))

        # One that has not got its name yet.
        end, written = time.monotonic() + DEADLINE_S, []
        while not written and time.monotonic() < end:
            written = [name for name in os.listdir(folder / "frames") if ".exr" in name and not name.endswith(".exr")]
        os.kill(worker.pid, signal.SIGSTOP)
        check(written, "no frame is seen while it is written")
        number = int(re.search(r"frame\.(\d+)", written[0])[1])
        place = frame(folder, number)
        if place.exists():  # it was renamed meanwhile: no harm can be seen
            place.unlink()
        place.write_text("painted", encoding="ascii")
        farm.baton("job", "lock", ident, "--frames", number)
        os.kill(worker.pid, signal.SIGCONT)
        finish(farm, ident)
        check_equal(place.read_text(encoding="ascii"), "painted", f"the locked frame {number}")
        check("have made different bytes" not in farm.coordinator.log(), "a locked frame was compared")


def a_coordinator_that_stood_still_takes_nobody_for_silent(programs, folder):
    with Farm(programs, folder / "farm") as farm:
        worker = farm.start_worker()
        wait_until(lambda: "joined" in farm.coordinator.log(), "the worker is there")
        for _ in range(3):
            os.kill(farm.coordinator.pid, signal.SIGSTOP)
            time.sleep(STANDSTILL_S)
            os.kill(farm.coordinator.pid, signal.SIGCONT)
            time.sleep(1)
        check("is silent" not in farm.coordinator.log(), "a worker counts as silent")
        check(worker.alive(), "the worker has ended")


if __name__ == "__main__":
    run_tests()

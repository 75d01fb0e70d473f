#!/usr/bin/env python3
"""Frames and folders that are harmed while a job runs: "done" means that every frame is there and right, without another
submission."""

import json
import os
import shutil
import signal
import time
from pathlib import Path

from farm import IO, OK, Farm, Process, check, check_equal, check_says, run_tests, wait_until
from interrupted import FRAMES, STANDSTILL_S, begin, finish, frame, make, undisturbed


def make_unreadable_picture(programs, path):
    """Changes one byte so that not all pixels can be decoded."""
    content = path.read_bytes()
    for at in range(len(content) // 2, len(content)):
        path.write_bytes(content[:at] + bytes([content[at] ^ 0x10]) + content[at + 1:])
        if programs.run("exr_digest", path, expect=None).returncode != OK:
            return
    check(False, f"{path}: no byte makes it unreadable")


def harmed_frames_are_made_again(programs, folder):
    expected = undisturbed(programs, folder)
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
            check_says(farm.coordinator.log(), "frame.0001.exr is gone, or not as it was last written, and is made again")
        check_equal(programs.pixels(place / "frames"), expected, f"pixels after a frame was {name}")


def a_frame_is_missed_after_a_restart(programs, folder):
    expected = undisturbed(programs, folder)
    with Farm(programs, folder / "farm") as farm:
        ident = begin(farm, folder)
        farm.coordinator.kill()
        frame(folder, 1).unlink()
        make_unreadable_picture(programs, frame(folder, 2))
        farm.start_coordinator()
        finish(farm, ident)
    check_equal(programs.pixels(folder / "frames"), expected, "pixels")


def render_says_what_is_wrong(programs, folder):
    """The same of the one command: its exit code, and the way on."""
    expected = undisturbed(programs, folder)
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


def link_frames(place, name):
    """The folder of frames is a link to `name` from now on."""
    (place / name).mkdir(parents=True)
    (place / "frames").symlink_to(place / name)


def another_folder_is_not_the_folder(programs, folder):
    """Renamed, and an empty one in its place: the job pauses, and goes on when it is back."""
    expected = undisturbed(programs, folder)
    for name in ("gone", "empty", "another link", "another coordinator's"):
        place = folder / name.replace(" ", "-").replace("'", "")
        if name == "another link":
            link_frames(place, "first")
        with Farm(programs, place / "farm") as farm:
            ident = begin(farm, place)
            (place / "frames").rename(place / "away")
            if name == "empty":
                (place / "frames").mkdir()
            elif name == "another link":
                link_frames(place, "second")
            elif name == "another coordinator's":
                (place / "frames").mkdir()
                [mark] = (place / "away").glob(".baton-*")
                (place / "frames" / mark.name).write_text("0123456789abcdef")
            farm.start_worker()
            shown = wait_until(lambda: (lambda s: s if s["status"] == "paused" else None)(farm.show(ident)), "it is paused")
            check_says(shown["waits"], "its output folder", str(place / "frames"))
            check(not list((place / "frames").glob("*.exr")), "frames went to the wrong folder")
            for command in (["submit", place / "job.json"], ["resume", ident]):
                check_says(farm.baton("job", *command, expect=IO).stderr, str(place / "frames"))
            if name == "another link":
                (place / "frames").unlink()
            elif name != "gone":
                shutil.rmtree(place / "frames")
            (place / "away").rename(place / "frames")
            farm.baton("job", "resume", ident)
            farm.wait_for(ident)
        check_equal(programs.pixels(place / "frames"), expected, f"pixels, {name}")
        check(not list((place / "frames").glob(".baton-*")), "the mark stays")


def a_lost_folder_is_made_again_on_demand(programs, folder):
    """Also one that a link does not lead to any more: where that leads now, all frames come."""
    expected = undisturbed(programs, folder)
    for name in ("gone", "another link"):
        place = folder / name.replace(" ", "-")
        if name == "another link":
            link_frames(place, "first")
        with Farm(programs, place / "farm") as farm:
            ident = begin(farm, place)
            (place / "frames").rename(place / "away")
            if name == "another link":
                link_frames(place, "second")
            farm.start_worker()
            wait_until(lambda: farm.show(ident)["status"] == "paused", "it is paused")
            farm.baton("job", "submit", place / "job.json", "--restart")
            farm.wait_for(ident)
        check_equal(programs.pixels(place / "frames"), expected, f"pixels, {name}")


def a_frame_that_cannot_be_read_pauses_the_job(programs, folder):
    """A folder in its place, and another frame that is gone: neither counts as there."""
    expected = undisturbed(programs, folder)
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


def what_is_no_file_in_the_place_of_a_frame_is_waited_for(programs, folder):
    expected = undisturbed(programs, folder)
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

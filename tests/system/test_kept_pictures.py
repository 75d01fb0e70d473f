#!/usr/bin/env python3
"""Pictures that people have put in the places of frames, or locked: they stay, and the end of the job tells of them."""

import json
import os
import re
import shutil
import signal
import time

from farm import BAD_INPUT, DEADLINE_S, IO, OK, Farm, check, check_equal, check_says, run_tests, wait_until
from interrupted import FRAMES, begin, finish, frame, make, undisturbed


def somebody_elses_picture_is_kept(programs, folder):
    """The job fails, says which frame it is, and goes on only with --restart."""
    expected = undisturbed(programs, folder)
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


def what_nobody_here_has_written_is_not_replaced(programs, folder):
    """A picture in the place of a frame that is still to be rendered: another program's, or of a job whose work folder is gone."""
    expected = undisturbed(programs, folder)
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
        check_says(farm.baton("job", "lock", ident, "--frames", "2").stderr, "frames 2 are locked")
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

def a_lock_holds_for_other_coordinators(programs, folder):
    """They do not know each other: what is locked stands in the folder."""
    with Farm(programs, folder / "farm", workers=1) as farm, Farm(programs, folder / "other") as other:
        ident = farm.submit(make(folder))
        farm.wait_for(ident)
        frame(folder, 2).write_bytes(painted := frame(folder, 3).read_bytes())
        command = ["render", folder / "job.json", "--work-dir", folder / "work"]

        # One that had begun before the lock does all but the locked frame.
        begun = json.loads(other.baton("job", "submit", folder / "job.json", "--restart", "--json").stdout)["id"]
        farm.baton("job", "lock", ident, "--frames", "2")
        other.start_worker()
        check_says(other.baton("job", "wait", begun, expect=IO).stdout, "frame.0002.exr is not what a job has written")
        check_equal(frame(folder, 2).read_bytes(), painted, "the locked frame, begun before")

        for extra in ([], ["--restart"]):
            refused = programs.run("baton", *command, *extra, expect=BAD_INPUT)
            check_says(refused.stderr, "frames 2 in", "are locked by a job of another coordinator", ".baton-locked")
        check_equal(frame(folder, 2).read_bytes(), painted, "the locked frame")
        farm.baton("job", "lock", ident, "--frames", "2", "--off")
        check(not (folder / "frames/.baton-locked").exists(), "the file of locks stays")
        farm.baton("job", "lock", ident, "--frames", "3")
        check_says(farm.baton("job", "delete", "--ended").stdout, "1 jobs with locked frames stay")
        check((folder / "frames/.baton-locked").exists(), "--ended takes locks off")
        check_says(farm.baton("job", "delete", ident).stderr, "frames 3 are not locked any more")
        check(not (folder / "frames/.baton-locked").exists(), "the file of locks outlives the job")
        programs.run("baton", *command, "--restart", expect=OK)


def a_lock_is_seen_by_others_or_refused(programs, folder):
    """Where it cannot be written into the folder nothing is locked; it has every name that a frame had in the job's versions."""
    with Farm(programs, folder / "farm", workers=1) as farm:
        ident = farm.submit(make(folder))
        farm.wait_for(ident)
        in_the_way = folder / "frames/.baton-locked"
        in_the_way.touch()
        check_says(farm.baton("job", "lock", ident, "--frames", "2", expect=IO).stderr, "nothing is locked")
        check("locked" not in farm.baton("job", "show", ident).stdout, "a lock that nobody sees")
        in_the_way.unlink()

        farm.baton("job", "lock", ident, "--frames", "2")
        (folder / "frames/other.0002.exr").write_bytes(frame(folder, 2).read_bytes())
        farm.wait_for(farm.submit(make(folder, output={"pattern": "other.####.exr"})))
        refused = programs.run("baton", "render", make(folder), "--work-dir", folder / "work", "--restart", expect=BAD_INPUT)
        check_says(refused.stderr, "frames 2 in", "are locked by a job of another coordinator")

        # In a folder that is away nothing is locked, and what is unlocked is told there once it is back.
        (folder / "frames").rename(folder / "away")
        check_says(farm.baton("job", "lock", ident, "--frames", "3", expect=None).stderr, "not there")
        farm.baton("job", "lock", ident, "--frames", "2", "--off")
        check(not (folder / "frames").exists(), "a folder that is away is made anew")
        (folder / "away").rename(folder / "frames")
        check(in_the_way.exists(), "nobody has said it there")
        farm.baton("job", "submit", folder / "job.json", expect=None)
        check(not in_the_way.exists(), "the lock stays in the folder")


def two_coordinators_have_one_job_open(programs, folder):
    """The same document in the same folder: neither takes the other's mark for a sign of another folder."""
    expected = undisturbed(programs, folder)
    with Farm(programs, folder / "farm") as farm, Farm(programs, folder / "other", workers=1) as other:
        path = make(folder)
        waiting, done = farm.submit(path), other.submit(path)
        other.wait_for(done)
        farm.start_worker()
        farm.wait_for(waiting)
        check("not the output folder" not in farm.coordinator.log() + other.coordinator.log(), "the folder is another's")
    check_equal(programs.pixels(folder / "frames"), expected, "pixels")


def what_is_unlocked_is_looked_at(programs, folder):
    """Gone: it is rendered; another picture: the job has failed."""
    expected = undisturbed(programs, folder)
    with Farm(programs, folder / "farm", workers=1) as farm:
        ident = farm.submit(make(folder))
        farm.wait_for(ident)
        farm.baton("job", "lock", ident, "--frames", "2-3")
        frame(folder, 2).write_bytes(frame(folder, 4).read_bytes())
        farm.baton("job", "lock", ident, "--frames", "2", "--off")
        check_says(farm.baton("job", "wait", ident, expect=IO).stdout, "frame.0002.exr is not what a job has written")
        frame(folder, 2).unlink()
        frame(folder, 3).unlink()
        farm.baton("job", "lock", ident, "--frames", "3", "--off")
        farm.wait_for(ident)
    check_equal(programs.pixels(folder / "frames"), expected, "pixels")


def a_byte_that_changed_is_seen_whatever_the_time_says(programs, folder):
    with Farm(programs, folder / "farm", workers=1) as farm:
        ident = farm.submit(make(folder))
        farm.wait_for(ident)
        before = frame(folder, 2).stat()
        with frame(folder, 2).open("r+b") as file:
            content = bytearray(file.read())
            content[len(content) // 2] ^= 1
            file.seek(0)
            file.write(content)
        os.utime(frame(folder, 2), ns=(before.st_atime_ns, before.st_mtime_ns))
        said = farm.baton("job", "submit", folder / "job.json", expect=None)
        check_says(said.stdout + said.stderr, "frame.0002.exr is")


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
    check_equal(programs.pixels(folder / "frames"), undisturbed(programs, folder), "pixels after --restart")


def who_gave_a_picture_up_may_take_that_back(programs, folder):
    """--restart lets a painted frame go until the job is cancelled, the frame is locked, or a version of the job has it not."""
    def painted_job(place):
        programs.render(make(place / "other", seed=77), place / "other/work", threads=2)
        return frame(place / "other", 2).read_bytes()

    for how in ("cancelled", "locked", "left out"):
        place = folder / how.replace(" ", "-")
        painted = painted_job(place)
        with Farm(programs, place / "farm") as farm:
            ident = begin(farm, place)
            frame(place, 2).write_bytes(painted)
            farm.baton("job", "cancel", ident)
            farm.baton("job", "submit", place / "job.json", "--restart")
            if how == "cancelled":
                farm.baton("job", "cancel", ident)
            elif how == "left out":
                for changes in ({"frames": "1"}, {}):
                    make(place, **changes)
                    farm.baton("job", "submit", place / "job.json", expect=IO if not changes else OK)
            else:
                farm.baton("job", "lock", ident, "--frames", "2")
                finish(farm, ident)
                farm.baton("job", "lock", ident, "--frames", "2", "--off")
            check_says(farm.baton("job", "submit", place / "job.json", expect=IO).stderr, "frame.0002.exr is not what a job has written")
            check_equal(frame(place, 2).read_bytes(), painted, f"the painted frame, {how}")


def a_job_that_failed_for_frames_is_done_once_they_are_locked(programs, folder):
    programs.render(make(folder / "other", seed=77), folder / "other/work", threads=2)
    painted = frame(folder / "other", 2).read_bytes()
    with Farm(programs, folder / "farm") as farm:
        ident = begin(farm, folder, num_done=3)
        for number in (2, 3):
            frame(folder, number).write_bytes(painted)
        finish(farm, ident, expect=IO)
        shown = json.loads(farm.baton("job", "lock", ident, "--frames", "2", "--json").stdout)
        wait_until(lambda: "frame.0002" not in farm.show(ident).get("waits", "frame.0002"), f"only frame 3 is named, not {shown}")
        check_says(farm.show(ident)["waits"], "frame.0003.exr is not what a job has written")
        farm.baton("job", "lock", ident, "--frames", "3")
        farm.wait_for(ident)
    for number in (2, 3):
        check_equal(frame(folder, number).read_bytes(), painted, f"frame {number}")


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


if __name__ == "__main__":
    run_tests()

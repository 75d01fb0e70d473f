#!/usr/bin/env python3
"""Pictures that come back: of older versions of a job, of other coordinators, from behind a lock."""

from farm import IO, Farm, check, check_equal, check_says, run_tests, wait_until
from interrupted import FRAMES, frame, make


def a_picture_of_an_older_version_that_is_put_back_is_kept(programs, folder):
    """By whoever, before the next submission or while the job runs; the older version itself takes it up again."""
    backup = {}
    with Farm(programs, folder / "farm", workers=1) as farm:
        def is_done(ident, aovs, *says):
            said = farm.baton("job", "submit", make(folder, output={"aovs": aovs}))
            farm.wait_for(ident)
            check_says(said.stderr + said.stdout, *says)
            return said.stderr + said.stdout

        ident = farm.submit(make(folder, output={"aovs": ["depth"]}))
        farm.wait_for(ident)
        backup.update({n: frame(folder, n).read_bytes() for n in range(1, FRAMES + 1)})
        is_done(ident, ["normal"], "frames are written anew: output.aovs has changed")
        newer = frame(folder, 3).read_bytes()
        frame(folder, 3).write_bytes(backup[3])
        check_says(farm.baton("job", "submit", make(folder, output={"aovs": ["normal"]}), expect=IO).stderr, "frame.0003.exr is not what a job has written")
        check_equal(frame(folder, 3).read_bytes(), backup[3], "the older frame")
        farm.baton("job", "submit", folder / "job.json", "--restart")
        farm.wait_for(ident)
        check_equal(frame(folder, 3).read_bytes(), newer, "the frame of the version that was begun again")

        # Back and forth, each change says what it does, and what has not changed is not said to be gone.
        said = is_done(ident, ["depth"], "frames are written anew: output.aovs has changed")
        check("is gone" not in said, said)
        check_equal(frame(folder, 3).read_bytes(), backup[3], "the frame of the older version, rendered again")
        frame(folder, 4).unlink()
        said = is_done(ident, ["depth"], "frame.0004.exr is gone")
        check("written anew" not in said, said)


def what_no_worker_was_granted_nobody_here_has_written(programs, folder):
    """A picture of a version of which nothing was rendered here, or nothing of that frame since it was begun again, is
    another coordinator's, or was put back; it is no late worker's."""
    first, edited = {"output": {"aovs": ["depth"]}}, {"output": {"aovs": ["normal"]}}
    with Farm(programs, folder / "farm") as farm:
        ident = farm.submit(make(folder, **first))
        farm.baton("job", "cancel", ident)
        programs.render(make(folder, **first), folder / "work", threads=2)
        frames = {n: frame(folder, n).read_bytes() for n in range(1, FRAMES + 1)}
        farm.start_worker()
        check_says(farm.baton("job", "submit", make(folder, **edited), expect=IO).stderr, "frame.0001.exr", "not what a job has written")
        check_equal({n: frame(folder, n).read_bytes() for n in frames}, frames, "frames of another coordinator")
        farm.baton("job", "submit", make(folder, **edited), "--restart")
        farm.wait_for(ident)

        # Begun again as it was before, and ended before anything was rendered.
        farm.workers[0].terminate()
        farm.workers[0].wait()
        farm.submit(make(folder, **first))
        farm.baton("job", "cancel", ident)
        farm.start_worker()
        farm.submit(make(folder, **edited))
        farm.wait_for(ident)
        frame(folder, 3).write_bytes(frames[3])
        check_says(farm.baton("job", "submit", folder / "job.json", expect=IO).stderr, "frame.0003.exr is not what a job has written")
        check_equal(frame(folder, 3).read_bytes(), frames[3], "the frame that was put back")


def what_stands_in_a_frames_place_pauses_a_job_that_begins_again(programs, folder):
    """A folder where a frame was, and --restart: it does not go away by waiting."""
    with Farm(programs, folder / "farm", workers=1) as farm:
        ident = farm.submit(make(folder))
        farm.wait_for(ident)
        frame(folder, 2).unlink()
        frame(folder, 2).mkdir()
        farm.baton("job", "submit", folder / "job.json", "--restart", expect=None)
        wait_until(lambda: farm.show(ident)["status"] == "paused", "the job is paused")
        check_says(farm.show(ident)["waits"], "frame.0002.exr: is a folder")
        frame(folder, 2).rmdir()
        farm.baton("job", "resume", ident)
        farm.wait_for(ident)


def what_a_lock_has_hidden_is_told_once_it_is_off(programs, folder):
    """A frame of the picture before, which was locked while the others were begun again."""
    with Farm(programs, folder / "farm", workers=1) as farm:
        ident = farm.submit(make(folder))
        farm.wait_for(ident)
        older = frame(folder, 2).read_bytes()
        farm.baton("job", "lock", ident, "--frames", "2")
        farm.baton("job", "submit", make(folder, seed=12), "--restart")
        farm.wait_for(ident)
        check_equal(frame(folder, 2).read_bytes(), older, "the locked frame")
        farm.baton("job", "lock", ident, "--frames", "2", "--off")
        shown = farm.baton("job", "wait", ident, expect=IO).stdout
        check_says(shown, "would replace 1 of the", "what differs: $.seed")
        check_equal(frame(folder, 2).read_bytes(), older, "the frame that was unlocked")
        farm.baton("job", "submit", folder / "job.json", "--restart")
        farm.wait_for(ident)
    check(frame(folder, 2).read_bytes() != older, "the frame is of the picture before")


if __name__ == "__main__":
    run_tests()

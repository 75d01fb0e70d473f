#!/usr/bin/env python3
"""Machines that are not alike: frames of one job are by one instruction set, or it is said."""

import re
import time

from farm import BAD_INPUT, IO, OK, USAGE, Farm, Process, check, check_equal, check_says, run_tests, wait_until
from jobs import make_job, write_job

FRAMES = 6


def make(folder, **changes):
    return write_job(folder / "job.json", make_job(folder, **{"frames": f"1-{FRAMES}", "image": {"tileSize": 32}, **changes}))


def sets_of(programs):
    """The instruction sets that workers of this machine and build have."""
    found = []
    for name in ("sse4", "avx2", "avx512"):
        done = programs.run("baton-worker", "--isa", name, "--coordinator", "tcp://127.0.0.1:1", "--give-up-s", "1", expect=None)
        if done.returncode != USAGE:
            found.append(name)
    return found


def renderer_of(frame):
    """As its header says."""
    return re.search(rb"baton:renderer\0string\0....([ -~]*\))", frame.read_bytes(), re.DOTALL)[1]


def another_instruction_set_does_not_go_on(programs, folder):
    sets = sets_of(programs)
    if len(sets) < 2:
        print("one instruction set: nothing to see")
        return
    best, least = sets[-1], sets[0]
    witness = folder / "witness"
    programs.render(make(witness), witness / "work", extra=("--isa", least))
    path = make(folder)
    with Farm(programs, folder / "farm") as farm:
        worker = farm.start_worker(extra=("--isa", best))
        ident = farm.submit(path)
        wait_until(lambda: farm.show(ident)["framesDone"] >= 2, "two frames are done")
        worker.terminate()
        worker.wait()
        check(farm.show(ident)["framesDone"] < FRAMES, "all was done too soon")

        # Nobody mixes them, not after a restart of the coordinator either.
        farm.coordinator.kill()
        farm.start_coordinator()
        farm.start_worker(extra=("--isa", least))
        shown = wait_until(lambda: (lambda s: s if s.get("waits") else None)(farm.show(ident)), "it waits")
        check_says(shown["waits"], "a worker that renders as what is done was rendered", "--restart", "--from-frame", "--isa")
        done = shown["framesDone"]
        time.sleep(0.5)
        check_equal(farm.show(ident)["framesDone"], done, "frames that another instruction set made")

        # All again with the other one.
        farm.baton("job", "submit", path, "--restart")
        farm.wait_for(ident)
    check_equal(programs.pixels(folder / "frames"), programs.pixels(witness / "frames"), "pixels")


def who_can_go_on_is_let_in(programs, folder):
    """Though others are there, which have nothing to do."""
    sets = sets_of(programs)
    if len(sets) < 2:
        return
    best, least = sets[-1], sets[0]
    path = make(folder, sampling={"numCandidates": 512, "numDistributions": 48})
    with Farm(programs, folder / "farm") as farm:
        worker = farm.start_worker(extra=("--isa", best))
        ident = farm.submit(path)
        wait_until(lambda: farm.show(ident)["framesDone"] >= 1, "a frame is done")
        worker.kill()
        wait_until(lambda: "is silent" in farm.coordinator.log(), "it is missed")
        farm.start_worker(extra=("--isa", least))
        wait_until(lambda: farm.show(ident).get("waits"), "it waits")
        again = farm.start_worker(extra=("--isa", best))
        farm.wait_for(ident)
        check(again.alive(), "it was let in")
    makers = {renderer_of(frame) for frame in (folder / "frames").glob("*.exr")}
    check_equal(len(makers), 1, f"renderers of the frames, {makers}")


def who_comes_before_a_dead_one_is_missed_is_let_in(programs, folder):
    sets = sets_of(programs)
    if len(sets) < 2:
        return
    with Farm(programs, folder / "farm") as farm:
        farm.start_worker(extra=("--isa", sets[-1]))
        wait_until(lambda: "joined" in farm.coordinator.log(), "it is there")
        farm.workers[0].kill()
        other = farm.start_worker(extra=("--isa", sets[0]))
        ident = farm.submit(make(folder))
        farm.wait_for(ident)
        check(other.alive(), "it was let in")


def give_way(farm, worker, isa):
    """The worker ends, and one of another set takes its place."""
    joined = farm.coordinator.log().count("joined")
    worker.terminate()
    worker.wait()
    farm.start_worker(extra=("--isa", isa))
    wait_until(lambda: farm.coordinator.log().count("joined") > joined, "it is there")


def what_is_kept_is_by_one(programs, folder):
    """Versions of a job by two instruction sets: the next one goes on from the newest that has frames, with its set."""
    sets = sets_of(programs)
    if len(sets) < 2:
        return
    best, least = sets[-1], sets[0]
    small = {"image": {"tileSize": 64}, "sampling": {"numCandidates": 128}}
    for name, first, second, third in (
            ("frames", {"frames": "1-4"}, {"frames": "1-2"}, {"frames": "1-6"}),
            ("sweeps", *({"state": {"carry": False}, "quality": {"sweeps": sweeps, "refinable": True}} for sweeps in (2, 1, 3)))):
        place = folder / name
        witness = place / "witness"
        expected = programs.rendered(witness, make_job(witness, **{**small, "frames": f"1-{FRAMES}", **third}), extra=("--isa", least))
        with Farm(programs, place / "farm") as farm:
            worker = farm.start_worker(extra=("--isa", best))
            ident = farm.submit(make(place, **{**small, **first}))
            farm.wait_for(ident)
            give_way(farm, worker, least)
            farm.baton("job", "submit", make(place, **{**small, **second}), "--restart")
            farm.wait_for(ident)
            refused = farm.baton("job", "submit", make(place, **{**small, **third}), expect=None)
            if name == "frames":  # of the first version two are there
                check_equal(refused.returncode, BAD_INPUT, "exit code")
                check_says(refused.stderr, "frames 3-4 in", "--restart renders all frames again, --from-frame N those from N on")
                refused = farm.baton("job", "submit", place / "job.json", "--restart")
            check_says(refused.stderr + refused.stdout, "nothing is kept of these that was rendered with")
            farm.wait_for(ident)
        check_equal(programs.pixels(place / "frames"), expected, f"pixels, {name}")


def frames_before_another_set_took_over_stay(programs, folder):
    """Nothing is carried: the plain command keeps both parts, or says that it cannot."""
    sets = sets_of(programs)
    if len(sets) < 2:
        return
    path = make(folder, sampling={"method": "mis"}, state={"carry": False})
    programs.render(path, folder / "work", extra=("--isa", sets[-1]))
    programs.render(path, folder / "work", extra=("--isa", sets[0], "--from-frame", "3"))
    both = {frame.name: frame.read_bytes() for frame in (folder / "frames").glob("*.exr")}
    for isa in sets[0], sets[-1]:
        refused = programs.render(path, folder / "work", extra=("--isa", isa), expect=BAD_INPUT)
        check_says(refused.stderr, "frames 1-2 in", "were rendered with", "--restart renders all frames again")
        check_equal({frame.name: frame.read_bytes() for frame in (folder / "frames").glob("*.exr")}, both, "frames")
    programs.render(path, folder / "work", extra=("--isa", sets[0], "--from-frame", "3"))
    programs.render(path, folder / "work", extra=("--isa", sets[0], "--restart"))
    makers = {renderer_of(frame) for frame in (folder / "frames").glob("*.exr")}
    check_equal(len(makers), 1, "renderers")


def what_begins_again_may_be_edited(programs, folder):
    """Frames of its former life are its own, by whichever set they are."""
    sets = sets_of(programs)
    if len(sets) < 2:
        return
    with Farm(programs, folder / "farm") as farm:
        worker = farm.start_worker(extra=("--isa", sets[-1]))
        ident = farm.submit(make(folder))
        wait_until((folder / "frames/frame.0001.exr").exists, "the first frame is written")
        give_way(farm, worker, sets[0])
        farm.baton("job", "submit", folder / "job.json", "--restart")
        farm.baton("job", "submit", make(folder, frames="1-2"))
        farm.wait_for(ident)
        makers = {renderer_of(frame) for frame in (folder / "frames").glob("*.exr")}
        check_equal(len(makers), 1, "renderers")


def frames_of_another_coordinators_set_stay(programs, folder):
    """The same document, rendered there with another instruction set: only --restart replaces them."""
    sets = sets_of(programs)
    if len(sets) < 2:
        return
    path = make(folder)
    programs.render(path, folder / "first", extra=("--isa", sets[-1]))
    theirs = programs.pixels(folder / "frames")
    refused = programs.render(path, folder / "second", extra=("--isa", sets[0]), expect=IO)
    check_says(refused.stderr, "frame.0001.exr", "are not what a job has written here", "--restart")
    check_equal(programs.pixels(folder / "frames"), theirs, "frames of the other one")
    programs.render(path, folder / "third", extra=("--isa", sets[-1]))
    check_equal(programs.pixels(folder / "frames"), theirs, "frames of a third one with the same set")
    for work in ("second", "fourth"):
        programs.render(path, folder / work, extra=("--isa", sets[0], "--restart"))
        check(all(theirs[name] != pixels for name, pixels in programs.pixels(folder / "frames").items()), f"--restart, {work}")
        programs.render(path, folder / "third", extra=("--isa", sets[-1], "--restart"))
        check_equal(programs.pixels(folder / "frames"), theirs, "frames of the third one anew")


def with_mixed_builds_a_frame_is_by_one(programs, folder):
    """Two machines that are not alike: who began goes on while it is there; then the other makes the frames that are not
    done, whole, and their headers name it."""
    sets = sets_of(programs)
    if len(sets) < 2:
        return
    best, least = sets[-1], sets[0]
    loose = {"state": {"carry": False}, "sampling": {"numCandidates": 128}, "image": {"tileSize": 16}}
    by = {}
    for isa in (best, least):
        witness = folder / isa
        programs.render(make(witness, **loose), witness / "work", extra=("--isa", isa))
        by[isa] = programs.pixels(witness / "frames")
    check(all(by[best][frame] != by[least][frame] for frame in by[best]), "the two sets make the same pixels: nothing to see")
    with Farm(programs, folder / "farm", workers=None) as farm:
        farm.start_coordinator(extra=("--mixed-builds",))
        first = farm.start_worker(extra=("--isa", best))
        ident = farm.submit(make(folder, **loose))
        wait_until(lambda: farm.show(ident)["framesDone"] >= 1, "a frame is done")
        farm.start_worker(extra=("--isa", least))
        wait_until(lambda: farm.show(ident)["framesDone"] >= 3, "three frames are done")
        first.kill()
        farm.wait_for(ident)
        check_says(farm.coordinator.log(), "tasks are done again, since who renders with")
    makers = {}
    for name, pixels in programs.pixels(folder / "frames").items():
        makers[name] = next((isa for isa in by if by[isa][name] == pixels), "both")
        check(makers[name] != "both", f"{name} is by both")
        check_equal(renderer_of(folder / "frames" / name), renderer_of(folder / makers[name] / "frames" / name), f"header of {name}")
    order = [makers[name] for name in sorted(makers)]
    check_equal(order, sorted(order, key=[best, least].index), "who made the frames, in order")
    check_equal(set(order), {best, least}, "who made the frames")


def what_unlike_renderers_made_is_not_compared(programs, folder):
    """Nobody is at fault. Once the farm has stopped to mix them, nobody goes on with it, and it is said how."""
    sets = sets_of(programs)
    if len(sets) < 2:
        return
    path = make(folder, sampling={"numCandidates": 128})
    with Farm(programs, folder / "farm", workers=None) as farm:
        farm.start_coordinator(extra=("--mixed-builds",))
        first = farm.start_worker(extra=("--isa", sets[-1]))
        ident = farm.submit(path)
        wait_until(lambda: farm.show(ident)["framesDone"] >= 2, "two frames are done")
        first.kill()
        farm.start_worker(extra=("--isa", sets[0]))
        farm.wait_for(ident)
        for mixes in (True, False):
            farm.coordinator.kill()
            farm.start_coordinator(extra=("--mixed-builds",) if mixes else ())
            wait_until(lambda: "joined" in farm.coordinator.log(), "the worker is back")
            (folder / "frames/frame.0001.exr").unlink()
            farm.submit(path)
            if mixes:
                farm.wait_for(ident)
                check("different bytes" not in farm.coordinator.log(), "they were compared")
        wait_until(lambda: farm.show(ident).get("waits"), "it waits")
        check_says(farm.show(ident)["waits"], "with several builds or instruction sets", "--mixed-builds goes on", "--restart", "--from-frame")
        farm.baton("job", "submit", path, "--restart")
        farm.wait_for(ident)
    check_equal(len({renderer_of(frame) for frame in (folder / "frames").glob("*.exr")}), 1, "renderers of the frames")


def what_one_renders_anew_is_mixed_no_more(programs, folder):
    sets = sets_of(programs)
    if len(sets) < 2:
        return
    small = {"sampling": {"numCandidates": 128}}
    with Farm(programs, folder / "farm", workers=None) as farm:
        farm.start_coordinator(extra=("--mixed-builds",))
        first = farm.start_worker(extra=("--isa", sets[-1]))
        ident = farm.submit(make(folder, **small))
        wait_until(lambda: farm.show(ident)["framesDone"] >= 2, "two frames are done")
        first.kill()
        farm.start_worker(extra=("--isa", sets[0]))
        farm.wait_for(ident)
        farm.coordinator.kill()
        farm.start_coordinator()
        anew = {**small, "output": {"aovs": ["normal"]}}
        check_says(farm.baton("job", "submit", make(folder, **anew)).stderr, "frames are written anew: output.aovs has changed")
        farm.wait_for(ident)
        farm.submit(make(folder, frames=f"1-{FRAMES + 2}", **anew))
        farm.wait_for(ident)
    check_equal(len({renderer_of(frame) for frame in (folder / "frames").glob("*.exr")}), 1, "renderers of the frames")


def the_one_command_says_so(programs, folder):
    sets = sets_of(programs)
    if len(sets) < 2:
        return
    path = make(folder, sampling={"numCandidates": 512, "numDistributions": 48})
    command = ["render", str(path), "--threads-per-worker", "1", "--work-dir", str(folder / "work"), "--isa"]
    running = Process([programs.path("baton"), *command, sets[-1]], folder / "render.log")
    wait_until((folder / "frames/frame.0001.exr").exists, "the first frame is written")
    time.sleep(0.3)
    running.terminate()
    running.wait()
    check(not (folder / f"frames/frame.{FRAMES:04d}.exr").exists(), "all was done too soon")
    done = programs.run("baton", *command, sets[0], expect=None)
    check(done.returncode not in (OK, IO), f"exit code {done.returncode}")
    check_says(done.stderr, "renders as what is done was rendered", "--restart", "`baton render --isa` goes on")
    programs.run("baton", *command, sets[-1])

    # With --restart it is all by the other one, whoever of worker and job comes first.
    (folder / "frames/frame.0002.exr").unlink()
    programs.run("baton", *command, sets[0], "--restart")
    witness = folder / "witness"
    programs.render(make(witness, sampling={"numCandidates": 512, "numDistributions": 48}), witness / "work",
                    extra=("--isa", sets[0]))
    check_equal(programs.pixels(folder / "frames"), programs.pixels(witness / "frames"), "pixels")

    # What is done is begun again as well.
    said = programs.run("baton", *command, sets[-1], "--restart")
    check_says(said.stderr, "nothing is kept of these that was rendered with")
    makers = {renderer_of(frame) for frame in (folder / "frames").glob("*.exr")}
    check(makers == {renderer_of(folder / "frames/frame.0001.exr")} != {renderer_of(witness / "frames/frame.0001.exr")}, f"renderers {makers}")


def a_locked_frame_holds_a_job_to_no_renderer(programs, folder):
    sets = sets_of(programs)
    if len(sets) < 2:
        return
    with Farm(programs, folder / "farm") as farm:
        worker = farm.start_worker(extra=("--isa", sets[-1]))
        ident = farm.submit(make(folder))
        farm.wait_for(ident)
        farm.baton("job", "lock", ident, "--frames", "3")
        locked = (folder / "frames/frame.0003.exr").read_bytes()
        give_way(farm, worker, sets[0])
        check_says(farm.baton("job", "submit", folder / "job.json", "--restart").stderr, "nothing is kept of these that was rendered with")
        farm.wait_for(ident)
        check_equal((folder / "frames/frame.0003.exr").read_bytes(), locked, "the locked frame")
        check(renderer_of(folder / "frames/frame.0001.exr") != renderer_of(folder / "frames/frame.0003.exr"), "frame 1 is of before")


def a_set_that_is_not_there_is_said(programs, folder):
    done = programs.run("baton-worker", "--isa", "avx1024", "--coordinator", "tcp://127.0.0.1:1", expect=USAGE)
    check_says(done.stderr + done.stdout, "--isa avx1024: expected auto, sse4, avx2 or avx512")


if __name__ == "__main__":
    run_tests()

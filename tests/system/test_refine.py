#!/usr/bin/env python3
"""A finished job is refined: more sweeps over its frames give the bytes of as many sweeps at once, however the work is
split, whoever dies, and whatever was kept. `baton render` adds sweeps by itself until its frames are clean enough."""

import json

from farm import BAD_INPUT, USAGE, Farm, Process, check, check_equal, run_tests, wait_until
from jobs import make_job, write_job
from test_motion import moving_job

POOL = {"method": "pool", "numParticles": 8, "numCandidates": 32}


def still(folder, **quality):
    return make_job(folder, frames="3", image={"width": 96, "height": 56, "tileSize": 32, "sites": 4}, sampling=POOL, quality=quality,
                    state={"keep": "last"}, output={"aovs": ["normal", "depth", "variance", "unshadowed", "blocked"]})


def turning(folder, **quality):
    return {**still(folder, **quality), "frames": "1-5"}


def moving(folder, **quality):
    job = moving_job(folder, image={"width": 96, "height": 56, "tileSize": 32, "sites": 4}, sampling=POOL, quality=quality, state={"keep": "last"})
    job["output"]["aovs"] = ["normal", "depth", "variance", "unshadowed", "blocked"]
    return job


def refined(programs, folder, job, times, workers, kill_at=None):
    """The pixels of a job that is refined so many times; a worker dies in the refinement number kill_at."""
    with Farm(programs, folder / "farm") as farm:
        hands = [farm.start_worker() for _ in range(workers)]
        done = farm.submit(write_job(folder / "job.json", job))
        farm.wait_for(done)
        for time in range(times):
            before = farm.show(done)
            done = farm.baton("job", "refine", done).stdout.strip()
            if time == kill_at:
                wait_until(lambda: farm.show(done)["tasksDone"] > before["tasksDone"], "a task of the new sweep is done")
                hands.pop().kill()
                farm.start_worker()
            farm.wait_for(done)
        return programs.pixels(folder / "frames")


def a_still_in_four_steps(programs, folder):
    """64 rounds at once, and 16 refined three times, on 1 to 3 workers with a kill."""
    expected = programs.rendered(folder / "whole", still(folder / "whole", rounds=16, sweeps=4))
    for workers in (1, 2, 3):
        place = folder / f"refined-{workers}"
        got = refined(programs, place, still(place, rounds=16, refinable=True), 3, workers,
                      kill_at=1 if workers > 1 else None)
        check_equal(got, expected, f"pixels with {workers} workers")


def sequences_at_rest_and_in_motion(programs, folder):
    for make in (turning, moving):
        name = make.__name__
        expected = programs.rendered(folder / f"{name}-whole", make(folder / f"{name}-whole", rounds=2, sweeps=3))
        got = refined(programs, folder / name, make(folder / name, rounds=2, refinable=True), 2, 2, kill_at=0)
        check_equal(got, expected, f"pixels of {name} refined")

        # What was not kept is made again.
        place = folder / f"{name}-afresh"
        got = refined(programs, place, make(place, rounds=2), 2, 2)
        check_equal(got, expected, f"pixels of {name} whose films were gone")


def only_new_sweeps_are_rendered(programs, folder):
    """One tile: its first sweep is done before anybody works at the others."""
    job = still(folder, rounds=2, refinable=True)
    job["image"]["tileSize"] = 96
    with Farm(programs, folder / "farm") as farm:
        worker = farm.start_worker()
        first = farm.submit(write_job(folder / "job.json", job))
        farm.wait_for(first)
        once = farm.show(first)["stats"]["pixels"]
        worker.terminate()
        second = farm.baton("job", "refine", first, "--rounds", "4").stdout.strip()
        check_equal(farm.show(second)["tasksDone"], 1, "tasks that are done before anybody works")
        farm.start_worker()
        farm.wait_for(second)
        check_equal(farm.show(second)["stats"]["pixels"], 3 * once, "pixels rendered, those of the first sweep included")
        # Fewer sweeps would make the frame worse; a number of rounds that no sweep has is refused.
        told = farm.baton("job", "submit", folder / "job.json", expect=BAD_INPUT).stderr
        check("what differs: $.quality.sweeps" in told, told)
        told = farm.baton("job", "refine", second, "--rounds", "3", expect=USAGE).stderr
        check("--rounds: expected a multiple of the job's quality.rounds, 2, got 3" in told, told)


def render_adds_sweeps(programs, folder):
    """Until a noise is reached, or so many rounds are; a second call has nothing to do."""
    job = turning(folder, rounds=4, noiseThreshold=0.02, maxRounds=64)
    told = programs.render_in(folder, job).stderr
    lines = [line for line in told.splitlines() if "as Cycles measures it" in line]
    noises = [float(line.split("noise ")[1].split()[0]) for line in lines]
    check(len(lines) > 1 and lines[0].startswith("4 rounds: "), told)
    check(noises == sorted(noises, reverse=True), f"the noise does not fall: {noises}")
    rounds = int(lines[-1].split()[0])
    check(noises[-1] <= 0.02 or rounds == 64, f"ended at {lines[-1]}")
    pixels = programs.pixels(folder / "frames")
    again = programs.render_in(folder, job).stderr
    check(f"{rounds} rounds: noise" in again and "more" not in again, again)
    check_equal(programs.pixels(folder / "frames"), pixels, "pixels after a second call")

    # The same at once.
    check(rounds % 4 == 0, lines[-1])
    expected = programs.rendered(folder / "whole", turning(folder / "whole", rounds=4, sweeps=rounds // 4))
    check_equal(pixels, expected, "pixels beside those at once")

    # With a limit of rounds the last step is shorter.
    job = still(folder / "most", rounds=2, maxRounds=10)
    told = programs.render_in(folder / "most", job, extra=["--json"])
    check_equal([line.split()[0] for line in told.stderr.splitlines() if "as Cycles" in line], ["2", "4", "8", "10"],
                "rounds after each step")
    check_equal(json.loads(told.stdout)["status"], "done", "the one result of --json")

    # No time: one sweep.
    job = still(folder / "hurry", rounds=2, timeLimit=0.001)
    told = programs.render_in(folder / "hurry", job).stderr
    check("2 rounds: noise" in told and "more" not in told, told)


def the_farm_adds_sweeps(programs, folder):
    """A job that was submitted grows, whether or not somebody waits for it, as `baton render` would have it: nobody opens a
    frame for that."""
    quality = {"rounds": 4, "noiseThreshold": 0.02, "maxRounds": 64}
    expected = programs.rendered(folder / "rendered", turning(folder / "rendered", **quality))
    path = write_job(folder / "farm/job.json", turning(folder / "farm", **quality))
    with Farm(programs, folder / "work", workers=1) as farm:
        said = farm.baton("job", "submit", path)
        check("rounds are added until quality.noiseThreshold ends it" in said.stderr, said.stderr)
        ident = said.stdout.strip()
        wait_until(lambda: farm.show(ident)["status"] == "done", "it is done, and nobody has waited")
        check_equal(programs.pixels(folder / "farm/frames"), expected, "pixels beside those of render")
        told = farm.baton("job", "wait", ident).stderr
        check("rounds: noise" in told and "more" not in told, told)
        growth = farm.show(ident)["growth"]
        check(len(growth) > 1 and all(line.endswith("more") for line in growth[:-1]), growth)

        # The same document again has nothing to add, and a lower threshold some more.
        check_equal(farm.submit(path), ident, "ID")
        farm.wait_for(ident)
        check_equal(farm.show(ident)["growth"], growth[-1:], "rounds that the same job adds")
        write_job(path, turning(folder / "farm", **{**quality, "noiseThreshold": 0.001}))
        check_equal(farm.submit(path), ident, "ID")
        farm.wait_for(ident)
        check(farm.show(ident)["growth"][-1].startswith("64 rounds: noise"), farm.show(ident)["growth"])


def frames_of_several_sweeps_are_those_of_the_job(programs, folder):
    """Where samples are carried from the last frame to the next sweep, other frames are another picture, and that is said."""
    def several(place, frames):
        return {**turning(place, rounds=2, sweeps=2), "frames": frames, "sampling": {"method": "sequential"}}

    programs.render_in(folder, several(folder, "1-3"))
    for frames in ("1-5", "1-2"):
        path = write_job(folder / "job.json", several(folder, frames))
        programs.refuses("render", path, "--work-dir", folder / "work",
                         says=["$.frames (samples are carried from the last frame to the first of the next sweep)", "--restart"])
    programs.run("baton", "render", write_job(folder / "job.json", several(folder, "1-5")), "--work-dir", folder / "work", "--restart")
    expected = programs.rendered(folder / "whole", several(folder / "whole", "1-5"))
    check_equal(programs.pixels(folder / "frames"), expected, "pixels of all frames anew")


def a_growing_job_outlives_those_who_wait_and_the_coordinator(programs, folder):
    """Waiters and coordinators are killed whenever rounds were added: the same rounds in the end."""
    quality = {"rounds": 4, "noiseThreshold": 0.02, "maxRounds": 64}
    expected = programs.rendered(folder / "rendered", turning(folder / "rendered", **quality))
    path = write_job(folder / "farm/job.json", turning(folder / "farm", **quality))
    with Farm(programs, folder / "work", workers=1) as farm:
        ident = farm.submit(path)
        command = [programs.path("baton"), "job", "wait", ident, "--coordinator", farm.endpoint]
        kills = 0
        while (shown := farm.show(ident))["status"] == "running":
            waiting = Process(command, folder / f"wait{kills}.log")
            grown = len(shown.get("growth", []))
            wait_until(lambda: len(farm.show(ident).get("growth", [])) > grown or not waiting.alive(), "it grows or ends")
            waiting.kill()
            farm.coordinator.kill()
            farm.start_coordinator()
            kills += 1
        check(kills > 1, "nobody was ever killed")
        check_equal((farm.show(ident)["id"], farm.show(ident)["status"]), (ident, "done"), "the job")
    check_equal(programs.pixels(folder / "farm/frames"), expected, "pixels beside those of render")


if __name__ == "__main__":
    run_tests()

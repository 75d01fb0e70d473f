#!/usr/bin/env python3
"""A stranger asks a farm, one command each: what does it do, who works on what, why does this one wait, this one first, stop."""

import json

from farm import BAD_INPUT, OK, USAGE, Farm, check, check_equal, check_says, run_tests, wait_until
from jobs import make_job, write_job

SLOW = {"method": "sequential", "numParticles": 16, "numCandidates": 512, "numDistributions": 48}


def submit(farm, folder, name, slow=False, **changes):
    """A job of its own folder; returns its ID. slow: its tasks take a second or so."""
    job = make_job(folder / name, **{"frames": "1-2", "name": name, **changes})
    if slow:
        job["sampling"] = SLOW
        job["image"] = {"width": 320, "height": 192, "tileSize": 64}
    return farm.submit(write_job(folder / name / "job.json", job))


def ask(farm, *words, expect=OK):
    """The answer of a command as JSON."""
    return json.loads(farm.baton(*words, "--json", expect=expect).stdout)


def listed(farm, ident, *words):
    """A job as `job list` has it."""
    return next(job for job in ask(farm, "job", "list", "--all", *words)["jobs"] if job["id"] == ident)


def kinds(chain):
    return [reason["kind"] for reason in chain]


def why_a_job_waits_and_what_it_does(programs, folder):
    with Farm(programs, folder / "farm") as farm:
        first = submit(farm, folder, "first", slow=True)
        job = listed(farm, first)
        check_equal((job["status"], job["activity"], job["reason"]), ("running", "waiting", "no worker is connected"), "the job")
        check_says(farm.baton("job", "list").stdout, "waiting", "[no worker is connected]")
        check_says(farm.baton("job", "why", "first").stdout, "frame 1 waits for its tile 0", "  <- no worker is connected, since 2")
        check_equal(kinds(ask(farm, "job", "why", first)), ["input", "no worker"], "causes")

        # One worker, two jobs: the second waits for its turn, and says whose it is.
        farm.start_worker()
        wait_until(lambda: listed(farm, first)["activity"] == "rendering", "the first job is rendered")
        second = submit(farm, folder, "second", slow=True)
        job = listed(farm, second)
        check_equal(job["activity"], "queued", "the second job")
        check_says(job["reason"], f"the only worker that could do it has tasks of job {first[:8]}")
        chain = ask(farm, "job", "why", second)
        check_equal(kinds(chain), ["input", "busy", "running"], "causes")
        check_equal((chain[-1]["job"], chain[-1]["workers"]), (first, ["worker0"]), "the last cause")
        check_equal(kinds(ask(farm, "worker", "why", "worker0"))[0], "running", "what the worker does")
        text = farm.baton("job", "why", first, "--frame", 2, "--tile", 0).stdout
        check_says(text, "tile 0")
        farm.baton("job", "why", first, "--frame", 9, expect=BAD_INPUT)
        farm.baton("job", "why", first, "--tile", 1, expect=USAGE)
        farm.baton("worker", "why", "nobody", expect=BAD_INPUT)

        # Paused, then cancelled.
        farm.baton("job", "pause", second)
        check_equal((listed(farm, second)["activity"], listed(farm, second)["reason"]), ("paused", "by a person"), "the second job")
        check_says(farm.baton("job", "why", second).stdout, "paused by a person, since 2")
        farm.baton("job", "cancel", second)
        check_says(farm.baton("job", "why", second).stdout, "the job is cancelled")
        farm.wait_for(first)
        check_equal(listed(farm, first)["activity"], "done", "the first job")
        check_equal([job["id"] for job in ask(farm, "job", "list", "--status", "done", "--since", "1h")["jobs"]], [first], "jobs that are done")
        check_equal(ask(farm, "job", "list", "--all", "--owner", "anna")["jobs"], [], "jobs of anna")
        farm.baton("job", "list", "--status", "asleep", expect=USAGE)
        farm.baton("job", "list", "--since", "yesterday", expect=USAGE)


def this_one_first(programs, folder):
    """The place in the queue changes; ID, version and document stay, through a restart, too."""
    with Farm(programs, folder / "farm") as farm:
        first, second = submit(farm, folder, "first"), submit(farm, folder, "second")
        check_says(farm.baton("job", "set", second, "priority=90").stdout, "priority   90")
        order = [job["id"] for job in ask(farm, "job", "list", "--sort", "priority")["jobs"]]
        check_equal(order, [second, first], "jobs by priority")
        for wrong in ("priority=101", "priority=", "priority=x", "speed=3", "priority"):
            check_says(farm.baton("job", "set", first, wrong, expect=USAGE).stderr, wrong, "expected priority=N")
        check_says(farm.baton("farm", "events", "--job", second).stdout, "priority changed", "90, it was 50")
        farm.coordinator.kill()
        farm.start_coordinator()
        shown = farm.show(second)
        check_equal((shown["priority"], shown["version"]), (90, 1), "priority and version after a restart")
        farm.start_worker()
        farm.wait_for(second)
        farm.wait_for(first)
        ends = {job["id"]: job["ended"] for job in ask(farm, "job", "list", "--all")["jobs"]}
        check(ends[second] <= ends[first], f"the second job was to be done first: {ends}")
        check_says(farm.baton("job", "set", first, "priority=1", expect=USAGE).stderr, "has ended")


def who_works_on_what_and_who_is_gone(programs, folder):
    with Farm(programs, folder / "farm") as farm:
        blind = farm.start_worker(name="blind", extra=["--map", f"{folder}/shot/frames={folder}/nowhere"])
        shot = submit(farm, folder, "shot", slow=True)
        worker = wait_until(lambda: next((w for w in ask(farm, "worker", "list") if w["blindTo"] and w["activity"] == "idle"), None),
                            "a worker is blind, and has given back what it had")
        check_equal(worker["id"], "blind", "the blind worker")
        check_equal(worker["blindTo"][0]["job"], shot, "blind to")
        check_says(listed(farm, shot)["reason"], "worker blind does not see", str(folder))
        check_equal(kinds(ask(farm, "worker", "why", "blind")), ["blind"], "why it does nothing")

        farm.start_worker(name="sees")
        wait_until(lambda: listed(farm, shot)["tasksDone"] >= 2, "tasks are done")
        sees = next(w for w in ask(farm, "worker", "list") if w["id"] == "sees")
        check_equal(sees["activity"], "rendering", "the other worker")
        check(sees["tasks"] and sees["tasks"][0]["usual"]["tasks"] >= 1, f"no usual time: {sees}")
        check(sees["build"].startswith("baton ") and sees["renderer"], f"no build: {sees}")
        tasks = ask(farm, "job", "tasks", shot, "--running")
        check(tasks and all(t["worker"] == "sees" and t["job"] == shot for t in tasks), f"tasks: {tasks}")
        check_says(farm.baton("job", "tasks").stdout, "running", "(usual ")
        check_equal(ask(farm, "job", "tasks", "--failed"), [], "failed tasks")
        screen = farm.baton("top").stdout
        check_says(screen, "1 jobs, 1 rendering", "blind", "sees", "does not see")
        check_equal(len(farm.baton("top", "--json", "--count", 2, "--interval", .1).stdout.splitlines()), 2, "lines of JSON")

        # Killed, it is listed as lost, and nobody blames it.
        blind.kill()
        lost = wait_until(lambda: next((w for w in ask(farm, "worker", "list") if w["activity"] == "lost"), None), "it is lost")
        check_equal(lost["id"], "blind", "the lost worker")
        check_says(farm.baton("worker", "list").stdout, "lost", "1 workers, 1 lost in a day")
        check_equal(kinds(ask(farm, "worker", "why", "blind")), ["gone"], "why the lost worker does nothing")
        check("blind" not in farm.baton("job", "why", shot).stdout, "who has left is blamed")
        farm.wait_for(shot)


def a_farm_is_stopped_by_command(programs, folder):
    with Farm(programs, folder / "farm", workers=1) as farm:
        job = submit(farm, folder, "shot", slow=True)
        wait_until(lambda: listed(farm, job)["activity"] == "rendering", "the job is rendered")
        status = ask(farm, "farm", "status")
        check_equal([(j["id"], j["activity"]) for j in status["jobs"]], [(job, "rendering")], "jobs")
        check_equal([w["id"] for w in status["workers"]], ["worker0"], "workers")
        check_equal(status["pilots"], [], "pilots")
        check_says(farm.baton("farm", "stop", expect=USAGE).stderr, "with 1 workers and 1 jobs", "say --yes")
        check(farm.coordinator.alive(), "nobody agreed")
        check_says(farm.baton("farm", "stop", "--yes").stdout, "1 jobs go on when it is started again")
        check_equal(farm.coordinator.wait(), OK, "exit code of the coordinator")
        farm.workers[0].wait()
        farm.start_coordinator()
        check_says(farm.baton("farm", "events").stdout, "coordinator stopped")
        farm.start_worker()
        farm.wait_for(job)


if __name__ == "__main__":
    run_tests()

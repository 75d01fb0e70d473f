#!/usr/bin/env python3
"""`baton render` that is killed in the middle goes on where it was when it is started again."""

import json
import re

from farm import Process, check, check_equal, make_job, run_tests, wait_until, write_job

SLOW = {"numParticles": 16, "numCandidates": 512, "numDistributions": 48}


def make(folder):
    return write_job(folder / "job.json", make_job(folder, image={"tileSize": 32}, sampling=SLOW))


def num_blobs(work_folder):
    return sum(1 for _ in work_folder.rglob("*.blob"))


def tasks_taken_over(work_folder):
    """How many tasks were done already when the coordinator last started, as its log says."""
    log = (work_folder / "coordinator.log").read_text(encoding="utf-8")
    found = re.findall(r"of the journal: (\d+) of \d+ tasks are done", log)
    check(found, f"the coordinator took no job from its journal:\n{log}")
    return int(found[-1])


def a_killed_render_goes_on(programs, folder):
    # The witness: the same job without any harm.
    witness = folder / "witness"
    programs.render(make(witness), witness / "work", workers=2)

    # Kill the whole process group once some work is durable.
    path, work = make(folder), folder / "work"
    command = [programs.path("baton"), "render", str(path), "--workers", "2", "--threads-per-worker", "1",
               "--work-dir", str(work)]
    render = Process(command, folder / "render.log")
    wait_until(lambda: num_blobs(work) >= 10, "the first results are in the store")
    check(render.alive(), f"the render ended too early:\n{render.log()}")
    render.kill()

    # Once more: it must take over what was done, and make the rest equal.
    summary = json.loads(programs.render(path, work, workers=2, extra=["--json"]).stdout)
    check_equal(summary["status"], "done", "status of the second run")
    taken_over = tasks_taken_over(work)
    check(0 < taken_over < summary["tasksTotal"],
          f"the second run took over {taken_over} of {summary['tasksTotal']} tasks")
    check_equal(programs.pixels(folder / "frames"), programs.pixels(witness / "frames"), "pixels")
    check_equal(programs.states(work), programs.states(witness / "work"), "samples")


def a_finished_render_has_nothing_to_do(programs, folder):
    path = write_job(folder / "job.json", make_job(folder, frames="1-2"))
    programs.render(path, folder / "work")
    before = programs.pixels(folder / "frames")
    programs.render(path, folder / "work")
    check_equal(programs.pixels(folder / "frames"), before, "pixels after the second run")


if __name__ == "__main__":
    run_tests([a_killed_render_goes_on, a_finished_render_has_nothing_to_do])

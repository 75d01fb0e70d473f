#!/usr/bin/env python3
"""The picture and the samples are the same for any tiling, number of workers and threads, and death on the way."""

from farm import DEADLINE_S, Farm, check, check_equal, check_layouts, run_tests, wait_until
from jobs import camera_keys, make_job, write_job

NUM_FRAMES = 6
# Dear enough that a process can be killed while the job runs.
SLOW = {"numParticles": 16, "numCandidates": 512, "numDistributions": 48}


def result_of(programs, job_folder, work_folder):
    """Everything that must not change: decoded pixels of each frame, samples of each checkpoint."""
    pixels = programs.pixels(job_folder / "frames")
    check_equal(len(pixels), NUM_FRAMES, f"frames in {job_folder}")
    states = programs.states(work_folder)
    check_equal(len(states.splitlines()), NUM_FRAMES // 2, f"frames with states in {work_folder}")
    return pixels, states


FOUR_SITES = {"image": {"sites": 4}}
MOVING = camera_keys((1, [0, 1.2, 5], [0, 0.6, 0]), (4, [0.4, 1.3, 4.9], [0, 0.6, 0]))
POOL = {"method": "pool", "numParticles": 16, "numCandidates": 64}
RESTIR = {**POOL, "method": "restir", "numNeighbors": 1, "neighborRadius": 5}
BY_MATERIAL = {"method": "mis", "numParticles": 8, "byMaterial": {
    "chalk": {"method": "environment", "numParticles": 4},
    "lacquer": {"method": "bidirectional", "numParticles": 12, "numCandidates": 64}}}
# What no layout may show in: (changes of the small job, its sampling if not its own).
CASES = {
    "one site": ({}, None),
    "four sites": (FOUR_SITES, None),
    "a second pass, which reaches into other tiles": ({**FOUR_SITES, "visibility": {"correlated": True, "dilate": 1}}, None),
    "settings by material": (FOUR_SITES, BY_MATERIAL),
    "a sampler with a memory": (FOUR_SITES, POOL),
    "the same in motion": ({**FOUR_SITES, "camera": MOVING}, POOL),
    "one that asks neighbours": (FOUR_SITES, RESTIR),
    "it in motion": ({**FOUR_SITES, "camera": MOVING}, RESTIR),
}


def no_layout_shows(programs, folder):
    for name, (changes, sampling) in CASES.items():
        frames = 6 if not sampling and "visibility" not in changes else 4

        def job_of(place):
            job = make_job(place, frames=f"1-{frames}", **changes)
            return {**job, "sampling": sampling or job["sampling"]}
        pixels, states = check_layouts(programs, folder / name.replace(" ", "-"), job_of)
        check_equal(len(pixels), frames, f"{name}: frames")
        # Where pixels go on from others, a run is one frame long.
        with_states = frames if "camera" in changes or sampling == RESTIR else frames // 2
        with_states = 0 if sampling == BY_MATERIAL else with_states
        check_equal(len(states.splitlines()), with_states, f"{name}: frames with states")


def equal_jobs_make_equal_files(programs, folder):
    """Two runs of the same job file give the same bytes, headers included."""
    files = []
    for name in ["first", "second"]:
        path = write_job(folder / "job.json", make_job(folder, frames="1-2"))
        programs.render(path, folder / name, workers=2)
        files.append({file.name: file.read_bytes() for file in sorted((folder / "frames").glob("*.exr"))})
        for file in (folder / "frames").glob("*.exr"):
            file.unlink()
    check_equal(sorted(files[0]), ["frame.0001.exr", "frame.0002.exr"], "files")
    check(files[0] == files[1], "the files of two equal runs differ")


def tiles_that_look_alike(programs, folder):
    """Empty tiles have the same pixels in every frame; what one task no longer needs is never what another made."""
    job = make_job(folder, frames="1-8", image={"width": 256, "height": 256, "tileSize": 16},
                   camera={"verticalFovDeg": 80}, sampling={"method": "bidirectional"},
                   output={"background": "transparent"})
    del job["scene"]["ground"], job["sampling"]["numDistributions"]
    with Farm(programs, folder / "farm", workers=1, threads=2) as farm:
        ident = farm.submit(write_job(folder / "job.json", job))
        farm.wait_for(ident)
        check_equal(farm.show(ident)["attemptsLost"], 0, "attempts lost though nothing was disturbed")


def slow_job(folder):
    return write_job(folder / "job.json", make_job(folder, image={"tileSize": 32}, sampling=SLOW))


def _undisturbed(programs, folder):
    """The result of the slow job when nobody dies; rendered once for all tests."""
    folder = folder.parent / "undisturbed"
    if (folder / "work").exists():
        return result_of(programs, folder, folder / "work")
    programs.render(slow_job(folder), folder / "work", workers=2)
    return result_of(programs, folder, folder / "work")


def wait_for_progress(farm, job):
    """Waits until a part of the job is done; it must not be all of it."""
    def begun():
        summary = farm.show(job)
        check(summary["tasksDone"] < summary["tasksTotal"], "the job ended before anybody could be killed")
        return summary["tasksDone"] >= 3
    wait_until(begun, "the first tasks are done")


def a_killed_worker(programs, folder):
    expected = _undisturbed(programs, folder)
    with Farm(programs, folder / "farm") as farm:
        first, _ = farm.start_worker(), farm.start_worker()
        job = farm.submit(slow_job(folder))
        wait_for_progress(farm, job)
        first.kill()
        farm.wait_for(job)
        check(farm.show(job)["attemptsLost"] >= 1, "the killed worker's task was not counted as lost")
        got = result_of(programs, folder, farm.work_folder)
    check_equal(got, expected, "result after the death of a worker")


def a_killed_coordinator(programs, folder):
    expected = _undisturbed(programs, folder)
    with Farm(programs, folder / "farm") as farm:
        workers = [farm.start_worker(), farm.start_worker()]
        job = farm.submit(slow_job(folder))
        wait_for_progress(farm, job)
        done_before = farm.show(job)["tasksDone"]
        farm.coordinator.kill()
        farm.start_coordinator()
        check(farm.show(job)["tasksDone"] >= done_before, "the restarted coordinator forgot what was done")
        farm.wait_for(job)
        check(all(worker.alive() for worker in workers), "a worker ended with its coordinator")
        got = result_of(programs, folder, farm.work_folder)
    check_equal(got, expected, "result after the death of the coordinator")


def a_terminated_worker_finishes_its_task(programs, folder):
    """SIGTERM drains: the worker reports what it runs and exits 0; the job goes on with another."""
    with Farm(programs, folder / "farm") as farm:
        worker = farm.start_worker()
        job = farm.submit(slow_job(folder))
        wait_for_progress(farm, job)
        worker.terminate()
        check_equal(worker.wait(DEADLINE_S), 0, "exit code of a drained worker")
        farm.start_worker()
        farm.wait_for(job)


if __name__ == "__main__":
    run_tests()

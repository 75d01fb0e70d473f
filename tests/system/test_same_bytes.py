#!/usr/bin/env python3
"""The picture and the samples are the same for any tiling, number of workers and threads, and death on the way."""

from farm import DEADLINE_S, Farm, check, check_equal, make_job, run_tests, wait_until, write_job

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


def rendered(programs, folder, name, workers, threads, tile_size, sites):
    """Renders the job with `baton render`; returns its result."""
    job = make_job(folder / name, image={"tileSize": tile_size, "sites": sites})
    path = write_job(folder / name / "job.json", job)
    programs.render(path, folder / name / "work", workers, threads)
    return result_of(programs, folder / name, folder / name / "work")


def compare_tilings(programs, folder, sites):
    """Tiles of 16, 64 and the whole image on 1 to 3 workers with 1 or 2 threads."""
    expected = rendered(programs, folder, "plain", workers=1, threads=1, tile_size=64, sites=sites)
    for name, workers, threads, tile_size in [
        ("small-tiles", 2, 1, 16),
        ("whole-image", 1, 2, 160),
        ("many-workers", 3, 1, 64),
    ]:
        got = rendered(programs, folder, name, workers, threads, tile_size, sites)
        check_equal(got[0], expected[0], f"pixels of {name}")
        check_equal(got[1], expected[1], f"samples of {name}")


def one_site(programs, folder):
    compare_tilings(programs, folder, sites=1)


def four_sites(programs, folder):
    compare_tilings(programs, folder, sites=4)


def correlated_visibility(programs, folder):
    """The second pass reaches into other tiles; no tiling shows."""
    changes = {"visibility": {"correlated": True, "dilate": 1}, "frames": "1-4"}
    expected = None
    for name, workers, threads, tile_size in [
        ("whole-image", 1, 1, 160),
        ("small-tiles", 2, 1, 16),
        ("tiles-of-64", 3, 1, 64),
    ]:
        job = make_job(folder / name, image={"tileSize": tile_size, "sites": 4}, **changes)
        path = write_job(folder / name / "job.json", job)
        programs.render(path, folder / name / "work", workers, threads)
        got = programs.pixels(folder / name / "frames")
        check_equal(len(got), 4, f"frames of {name}")
        expected = expected or got
        check_equal(got, expected, f"pixels of {name}")


def settings_by_material(programs, folder):
    """Methods and numbers of samples that differ by material."""
    sampling = {"method": "mis", "numParticles": 8, "byMaterial": {
        "chalk": {"method": "environment", "numParticles": 4},
        "lacquer": {"method": "bidirectional", "numParticles": 12, "numCandidates": 64}}}
    expected = None
    for name, workers, threads, tile_size in [("whole-image", 1, 2, 160), ("small-tiles", 2, 1, 16)]:
        place = folder / name
        job = make_job(place, frames="1-2", image={"tileSize": tile_size, "sites": 4})
        job["sampling"] = sampling
        programs.render(write_job(place / "job.json", job), place / "work", workers, threads)
        got = programs.pixels(place / "frames")
        check_equal(len(got), 2, f"frames of {name}")
        expected = expected or got
        check_equal(got, expected, f"pixels of {name}")


def carrying(programs, folder):
    """The sampler with a memory and the one that asks neighbours, still and with a camera that moves."""
    for sampling in [{"method": "pool"}, {"method": "restir", "numNeighbors": 1, "neighborRadius": 5}]:
        carrying_with(programs, folder / sampling["method"], sampling)


def carrying_with(programs, folder, sampling):
    keys = [{"frame": 1, "position": [0, 1.2, 5], "lookAt": [0, 0.6, 0]},
            {"frame": 4, "position": [0.4, 1.3, 4.9], "lookAt": [0, 0.6, 0]}]
    for motion in ["still", "moving"]:
        expected = None
        for name, workers, threads, tile_size in [("whole-image", 1, 2, 160), ("small-tiles", 2, 1, 16)]:
            place = folder / motion / name
            job = make_job(place, frames="1-4", image={"tileSize": tile_size, "sites": 4},
                           sampling=dict(sampling))
            del job["sampling"]["numDistributions"]
            if motion == "moving":
                job["camera"]["keys"] = keys
            programs.render(write_job(place / "job.json", job), place / "work", workers, threads)
            got = programs.pixels(place / "frames"), programs.states(place / "work")
            check_equal(len(got[0]), 4, f"frames of {motion} {name}")
            expected = expected or got
            check_equal(got, expected, f"pixels and samples of {motion} {name}")


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
    with Farm(programs, folder / "farm") as farm:
        farm.start_coordinator()
        farm.start_worker(threads=2)
        ident = farm.submit(write_job(folder / "job.json", job))
        farm.wait_for(ident)
        check_equal(farm.show(ident)["attemptsLost"], 0, "attempts lost though nothing was disturbed")


def slow_job(folder):
    return write_job(folder / "job.json", make_job(folder, image={"tileSize": 32}, sampling=SLOW))


def undisturbed(programs, folder):
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
    expected = undisturbed(programs, folder)
    with Farm(programs, folder / "farm") as farm:
        farm.start_coordinator()
        first, _ = farm.start_worker(), farm.start_worker()
        job = farm.submit(slow_job(folder))
        wait_for_progress(farm, job)
        first.kill()
        farm.wait_for(job)
        check(farm.show(job)["attemptsLost"] >= 1, "the killed worker's task was not counted as lost")
        got = result_of(programs, folder, farm.work_folder)
    check_equal(got, expected, "result after the death of a worker")


def a_killed_coordinator(programs, folder):
    expected = undisturbed(programs, folder)
    with Farm(programs, folder / "farm") as farm:
        farm.start_coordinator()
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
        farm.start_coordinator()
        worker = farm.start_worker()
        job = farm.submit(slow_job(folder))
        wait_for_progress(farm, job)
        worker.terminate()
        check_equal(worker.wait(DEADLINE_S), 0, "exit code of a drained worker")
        farm.start_worker()
        farm.wait_for(job)


if __name__ == "__main__":
    run_tests([
        one_site,
        four_sites,
        correlated_visibility,
        settings_by_material,
        carrying,
        equal_jobs_make_equal_files,
        tiles_that_look_alike,
        a_killed_worker,
        a_killed_coordinator,
        a_terminated_worker_finishes_its_task,
    ])

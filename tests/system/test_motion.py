#!/usr/bin/env python3
"""With camera and objects in motion a tile needs its neighbours: the picture and the samples still are the same for any
tiling, number of workers and death on the way."""


from farm import Farm, check, check_equal, check_layouts, run_tests, wait_until
from jobs import camera_keys, make_job, write_job

NUM_FRAMES = 5


def moving_job(folder, **changes):
    """The camera goes round the scene and one sphere rolls towards it."""
    job = make_job(folder, frames=f"1-{NUM_FRAMES}", **changes)
    job["camera"] |= camera_keys((1, [0, 1.2, 5], [0, 0.6, 0]), (3, [0.2, 1.25, 4.95], [0, 0.6, 0]),
                                 (6, [0.6, 1.3, 4.8], [0.05, 0.6, 0]))
    job["scene"]["objects"][1]["keys"] = [{"frame": 1}, {"frame": 6, "translate": [-0.3, 0, 0.4], "rotateDeg": [40, 0, 0]}]
    return job


def result_of(programs, job_folder, work_folder):
    """Decoded pixels of each frame, samples of each frame."""
    pixels = programs.pixels(job_folder / "frames")
    check_equal(len(pixels), NUM_FRAMES, f"frames in {job_folder}")
    states = programs.states(work_folder)
    check_equal(len(states.splitlines()), NUM_FRAMES, f"frames with states in {work_folder}")
    return pixels, states


def any_tiling_and_workers(programs, folder):
    def job_of(place):
        return moving_job(place, image={"sites": 4})
    pixels, states = check_layouts(programs, folder, job_of)
    check_equal((len(pixels), len(states.splitlines())), (NUM_FRAMES, NUM_FRAMES), "frames, and those with states")
    told = programs.render_in(folder / "told", job_of(folder / "told")).stdout
    check("\nafresh " in told and "nothing to go on from" in told, f"what came into view is not told\n{told}")


def a_killed_worker(programs, folder):
    """A worker dies with what it had in hand; others decode the states that it left."""
    slow = {"numParticles": 16, "numCandidates": 512, "numDistributions": 48}
    image = {"tileSize": 32, "sites": 4}
    path = write_job(folder / "quiet" / "job.json", moving_job(folder / "quiet", image=image, sampling=slow))
    programs.render(path, folder / "quiet" / "work", workers=2)
    expected = result_of(programs, folder / "quiet", folder / "quiet" / "work")

    path = write_job(folder / "job.json", moving_job(folder, image=image, sampling=slow))
    with Farm(programs, folder / "farm") as farm:
        first, _ = farm.start_worker(), farm.start_worker()
        job = farm.submit(path)
        wait_until(lambda: farm.show(job)["tasksDone"] >= 20, "the first frame is done")
        check(farm.show(job)["status"] == "running", "the job ended before anybody could be killed")
        first.kill()
        farm.wait_for(job)
        got = result_of(programs, folder, farm.work_folder)
    check_equal(got, expected, "result after the death of a worker")


def held_states(programs, folder):
    """Between checkpoints states stay in the worker that made them. One that is drained publishes them, and nothing is
    done again; of one that dies they are made again; one that comes later is given what it needs. The frames are the same."""
    changes = {"image": {"tileSize": 32, "sites": 4}, "state": {"carry": True, "checkpointEvery": 12, "keep": "last"},
               "sampling": {"numParticles": 16, "numCandidates": 512, "numDistributions": 24}}

    def make(name):
        return write_job(folder / name / "job.json", {**moving_job(folder / name, **changes), "frames": "1-10"})

    programs.render(make("quiet"), folder / "quiet" / "work")
    expected = programs.pixels(folder / "quiet" / "frames")
    for name, end in [("drained", "terminate"), ("killed", "kill"), ("joined", None)]:
        with Farm(programs, folder / name / "farm") as farm:
            first = farm.start_worker()
            job = farm.submit(make(name))
            wait_until(lambda: farm.show(job)["framesDone"] >= 2 and farm.show(job)["statesHeld"] > 0, "states are held")
            check(farm.show(job)["status"] == "running", "the job ended before anything could happen")
            if end:
                getattr(first, end)()
            if end == "terminate":
                first.wait()
                check_equal(farm.show(job)["statesHeld"], 0, "states that a drained worker holds")
            farm.start_worker()
            farm.wait_for(job)
            opened = "done again, since what worker" in farm.coordinator.log()
        check_equal(programs.pixels(folder / name / "frames"), expected, f"pixels where the first worker was {name}")
        check_equal(opened, end == "kill", f"tasks were opened again where the first worker was {name}")


def a_replay_makes_the_same_tile(programs, folder):
    """The command that replays a tile renders all of the past that the tile depends on."""
    programs.render_in(folder, moving_job(folder, image={"tileSize": 32}, output={"pixelType": "float"}), workers=2)
    programs.run("baton-worker", "replay", folder / "job.json", "--frame", 4, "--tile", 7, "--out", folder / "tile.exr")
    # Tile 7 of 5 columns: x in [64, 96), y in [32, 64).
    whole = programs.values(folder / "frames" / "frame.0004.exr", "R")
    tile = programs.values(folder / "tile.exr", "R")
    check_equal(tile, [whole[y * 160 + x] for y in range(32, 64) for x in range(64, 96)], "pixels of the replay")


def the_range_of_motion_is_measured(programs, folder):
    """`baton check` tells how far history is followed; a glTF file that is not there is named."""
    path = write_job(folder / "job.json", moving_job(folder))
    checked = programs.checked(path)
    check(2 <= checked["motionMaxPx"] <= 12, f"measured {checked['motionMaxPx']} pixels")

    job = moving_job(folder)
    job["camera"] = {"gltf": {"file": "/nowhere.glb", "node": "eye"}}
    programs.refuses("check", write_job(folder / "bad.json", job), says="/nowhere.glb: missing")


if __name__ == "__main__":
    run_tests()

#!/usr/bin/env python3
"""Machines that have the farm's folders elsewhere, or not at all."""

from farm import IO, Farm, check, check_equal, run_tests, wait_until
from jobs import make_job, write_job

UNSEEN = "not the folder that the coordinator sees"


def contents(frames):
    """File name -> bytes."""
    return {path.name: path.read_bytes() for path in sorted(frames.glob("*.exr"))}


def folders_may_lie_elsewhere(programs, folder):
    """One worker has the shows under another path, one has nothing there."""
    shows = folder / "studio" / "shows"
    job = make_job(shows, frames="1-4", image={"tileSize": 80})
    path = write_job(shows / "job.json", job)
    programs.render(path, folder / "alone")
    alone = contents(shows / "frames")
    for frame in (shows / "frames").glob("*.exr"):
        frame.unlink()
    (folder / "empty").mkdir()
    (folder / "mnt").symlink_to(folder / "studio")

    with Farm(programs, folder) as farm:
        blind = farm.start_worker(name="blind", extra=["--map", f"{folder}/studio={folder}/empty"])
        job = farm.submit(path)
        waits = wait_until(lambda: farm.show(job).get("waits"), "the job waits")
        check(waits.startswith(f"a worker that sees {folder}/empty/shows/frames: {UNSEEN}"), waits)

        farm.start_worker(name="sees", extra=["--map", f"{folder}/studio={folder}/mnt"])
        farm.wait_for(job)
        shown = farm.show(job)
        check_equal(shown["attemptsLost"], 0, "attempts lost or failed")
        check_equal(contents(shows / "frames"), alone, "files of the frames")
        check(blind.alive(), "the worker stays for other jobs")
        check_equal(blind.log().count(UNSEEN), 1, f"lines of the worker that does not see the job\n{blind.log()}")
        check_equal(farm.coordinator.log().count(f"worker blind takes no tasks of job {job[:8]}"), 1,
                    f"lines of the coordinator\n{farm.coordinator.log()}")
        check(not list((folder / "empty").rglob("*")), "nothing was written where nobody looks")
        check(not list((shows / "frames").glob(".baton-*")), "the mark goes when the job ends")


def a_worker_without_the_store_ends(programs, folder):
    with Farm(programs, folder) as farm:
        (folder / "empty").mkdir()
        worker = farm.start_worker(extra=["--map", f"{farm.work_folder}={folder}/empty"])
        check_equal(worker.wait(), IO, "exit code")
        check_equal(worker.log().count(UNSEEN), 1, worker.log())
        check(not list((folder / "empty").iterdir()), "no second store is made")
        wait_until(lambda: farm.coordinator.log().count(" left") == 1, "it says goodbye")


if __name__ == "__main__":
    run_tests()

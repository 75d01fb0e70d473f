#!/usr/bin/env python3
"""Errors of the moment are neither bad input nor absence: they are waited for. Files that another machine sees late, inputs
that change while a job runs, and a coordinator with few file descriptors."""

import os
import resource
import shutil
from pathlib import Path

from assets import write_map
from farm import IO, OK, Farm, Process, check, check_equal, check_says, run_tests, wait_until
from jobs import camera_keys, make_job, write_job


def library(programs):
    path = Path(programs.path("libfile_faults.so"))
    return path if path.exists() else None  # sanitizers load no library before theirs


def moving(folder, **changes):
    return make_job(folder, **{"frames": "1-4", "image": {"tileSize": 32}, "sampling": {"method": "pool", "numParticles": 8,
                                                                                       "numCandidates": 32},
                               "camera": camera_keys((1, [0, 1.2, 5], [0, 0.6, 0]), (4, [0.3, 1.2, 4.8], [0, 0.6, 0])), **changes})


def farm_on_bad_disk(programs, folder, **environment):
    farm = Farm(programs, folder / "farm", workers=None)
    farm.environment = {"LD_PRELOAD": str(library(programs)), **environment}
    farm.start_coordinator()
    for _ in range(2):
        farm.start_worker()
    return farm


def errors_of_the_moment_end_no_job(programs, folder):
    """Some of the looks at meshes, maps, blobs and frames fail."""
    if not library(programs):
        return
    expected = programs.rendered(folder / "witness", moving(folder / "witness"))
    for name, rate, place in (("sphere.off", 3, "mesh"), ("lamp.hdr", 3, "map"), (".blob", 60, "blobs"), (".exr", 20, "frames"),
                              (".baton-", 6, "mark"), ("store/token", 6, "token")):
        place = folder / place
        with farm_on_bad_disk(programs, place, BATON_FILE_FAULTS=f"{rate}:{name}") as farm:
            ident = farm.submit(write_job(place / "job.json", moving(place)))
            farm.wait_for(ident)
            shown = farm.show(ident)
            check_equal((shown["status"], shown["failures"]), ("done", []), f"job with errors of {name}")
            logs = farm.coordinator.log() + "".join(worker.log() for worker in farm.workers)
            check("no plain file" not in logs and "missing" not in logs, logs)
        check_equal(programs.pixels(place / "frames"), expected, f"pixels with errors of {name}")


def a_picture_that_cannot_be_seen_well_is_kept(programs, folder):
    """Of one in the place of a frame that is to be made every second look fails, or the worker sees it later than others."""
    if not library(programs):
        return
    programs.render(write_job(folder / "other/job.json", moving(folder / "other", seed=77)), folder / "other/work")
    painted = (folder / "other/frames/frame.0003.exr").read_bytes()
    for name, environment in (("errors", {"BATON_FILE_FAULTS": "2:/frame.0003.exr"}), ("late", {"BATON_FILES_LATE": "20000:/frame.0003.exr"})):
        place = folder / name
        with Farm(programs, place / "farm") as farm:
            ident = farm.submit(write_job(place / "job.json", moving(place)))
            (place / "frames").mkdir(exist_ok=True)
            (place / "frames/frame.0003.exr").write_bytes(painted)
            farm.environment = {"LD_PRELOAD": str(library(programs)), **environment}
            worker = farm.start_worker()
            wait_until(lambda: "frame.0003.exr" in farm.show(ident).get("waits", ""), f"{name}: the picture is told of")
            worker.terminate()
            worker.wait()
            farm.environment = {}
            farm.start_worker()
            check_says(farm.baton("job", "wait", ident, expect=IO).stdout, "frame.0003.exr is not what a job has written")
        check_equal((place / "frames/frame.0003.exr").read_bytes(), painted, f"the painted frame, {name}")


def what_is_seen_late_is_not_made_again(programs, folder):
    if not library(programs):
        return
    expected = programs.rendered(folder / "witness", moving(folder / "witness"))
    with farm_on_bad_disk(programs, folder, BATON_FILES_LATE="300:.blob") as farm:
        ident = farm.submit(write_job(folder / "job.json", moving(folder)))
        farm.wait_for(ident)
        log = farm.coordinator.log()
        check("done again" not in log and "failed:" not in log, log)
        check_equal(farm.show(ident)["attemptsLost"], 0, "attempts that were lost")
    check_equal(programs.pixels(folder / "frames"), expected, "pixels")


def a_file_in_place_of_the_store_is_waited_for(programs, folder):
    expected = programs.rendered(folder / "witness", moving(folder / "witness"))
    with Farm(programs, folder / "farm", workers=1) as farm:
        ident = farm.submit(write_job(folder / "job.json", moving(folder)))
        wait_until(lambda: farm.show(ident)["framesDone"] >= 1, "a frame is done")
        store = farm.work_folder / "store"
        away = store.rename(store.with_name("away"))
        store.write_text("no folder", encoding="ascii")
        wait_until(lambda: "a folder in the place of" in farm.show(ident).get("waits", ""), "it waits")
        store.unlink()
        away.rename(store)
        farm.start_worker()
        farm.wait_for(ident)
        check_equal(farm.show(ident)["failures"], [], "failures")
    check_equal(programs.pixels(folder / "frames"), expected, "pixels")


def a_file_in_place_of_a_folder_of_the_store_is_waited_for(programs, folder):
    expected = programs.rendered(folder / "witness", moving(folder / "witness"))
    for number, names in enumerate((["jobs"], [f"{first:02x}" for first in range(256)])):
        with Farm(programs, folder / f"farm{number}") as farm:
            shutil.rmtree(folder / "frames", ignore_errors=True)
            ident = farm.submit(write_job(folder / "job.json", moving(folder)))
            places = [farm.work_folder / "store" / name for name in names]
            for place in places:
                place.write_text("no folder", encoding="ascii")
            farm.start_worker()
            wait_until(lambda: "a folder in the place of" in farm.show(ident).get("waits", ""), "it waits")
            for place in places:
                place.unlink()
            farm.wait_for(ident)
            check_equal(farm.show(ident)["failures"], [], "failures")
        check_equal(programs.pixels(folder / "frames"), expected, "pixels")


def an_input_that_changes_reaches_no_frame_in_silence(programs, folder):
    """A plate and a map are read when a frame needs them, by a worker that has loaded the job before. By then they may be
    others than those that were submitted."""
    for what in ("plate", "map"):
        place = folder / what
        job = make_job(place, frames="1-8", image={"tileSize": 64}, state={"carry": False},
                       sampling={"method": "sequential", "numCandidates": 4096, "numDistributions": 48})
        path = place / "late.hdr"
        size = (job["image"]["width"], job["image"]["height"]) if what == "plate" else (32, 16)  # that of lamp.hdr
        write_map(path, *size)
        if what == "plate":
            job["output"].update(background="plate", plate=str(path))
        else:
            lamp = str(place / "lamp.hdr")
            job["environment"]["keys"] = [{"frame": 1, "map": lamp}, {"frame": 6, "map": lamp}, {"frame": 8, "map": str(path)}]
        with Farm(programs, place / "farm") as farm:
            ident = farm.submit(write_job(place / "job.json", job))
            farm.start_worker()
            other = place / "other.hdr"
            write_map(other, *size, lambda *_: (9, 9, 9))
            wait_until(lambda: farm.show(ident)["tasksDone"] >= 1, "a task is done")
            os.replace(other, path)
            said = farm.baton("job", "wait", ident, expect=None)
            check(said.returncode != OK, f"{what}: done all the same")
            check_says(said.stdout, "late.hdr: changed since the job was submitted")
            check(farm.show(ident)["framesDone"] < 8, "frames")


def few_file_descriptors(programs, folder):
    """The soft limit is raised; where that is no help workers are refused, with a line, and clients are answered."""
    folder.mkdir(parents=True)
    command = [programs.path("baton-coordinator"), "--listen", "tcp://127.0.0.1:*", "--work-dir", str(folder / "work"),
               "--endpoint-file", str(folder / "endpoint")]
    for hard, says in ((4096, None), (64, "workers are refused: 64 file descriptors")):
        (folder / "endpoint").unlink(missing_ok=True)
        before = resource.getrlimit(resource.RLIMIT_NOFILE)
        coordinator = Process(["bash", "-c", f"ulimit -Sn 64; ulimit -Hn {hard}; exec \"$@\"", "-", *command], folder / f"log{hard}")
        workers = []
        try:
            wait_until((folder / "endpoint").exists, "it listens")
            endpoint = (folder / "endpoint").read_text(encoding="ascii").strip()
            workers = [Process([programs.path("baton-worker"), "--coordinator", endpoint, "--threads", "1", "--name", f"w{i}"],
                               folder / f"worker{hard}-{i}.log") for i in range(49)]
            if says:
                wait_until(lambda: says in coordinator.log(), "it says what it lacks")
                wait_until(lambda: any("the coordinator says: " in w.log() for w in workers), "a worker is refused")
                check(all(w.alive() for w in workers), "those without room ask again")
            else:
                wait_until(lambda: coordinator.log().count("joined") == 49, "all workers are there")
            check_equal(programs.run("baton", "job", "list", "--coordinator", endpoint).returncode, OK, "answer to a client")
        finally:
            for process in (*workers, coordinator):
                process.kill()
        check_equal(resource.getrlimit(resource.RLIMIT_NOFILE), before, "the limit of the test")


if __name__ == "__main__":
    run_tests()

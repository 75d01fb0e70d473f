#!/usr/bin/env python3
"""`baton render` that is killed in the middle goes on where it was when it is started again."""

import shlex
import json
import re
from pathlib import Path

from farm import BAD_INPUT, OK, Farm, Process, check, check_equal, run_tests, wait_until
from jobs import make_job, write_job

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

    # Kill the whole process group once some work is durable: what a frame is made of is journalled before it is put together.
    path, work = make(folder), folder / "work"
    command = [programs.path("baton"), "render", str(path), "--workers", "2", "--threads-per-worker", "1",
               "--work-dir", str(work)]
    render = Process(command, folder / "render.log")
    wait_until(lambda: any((folder / "frames").glob("frame.*.exr")), "the first frame is written")
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
    job = make_job(folder, frames="1-2")
    before = programs.rendered(folder, job)
    check_equal(programs.rendered(folder, job), before, "pixels after the second run")


def two_farms_of_one_machine_never_meet(programs, folder):
    """A port of the system's choice goes to another farm while a coordinator that died is started again."""
    path = make(folder)
    addresses = []
    for _ in range(2):
        programs.render(path, folder / "work")
        addresses.append((folder / "work/endpoint").read_text(encoding="utf-8"))
    check(all(address.startswith("ipc:///") for address in addresses), f"listens at {addresses}")
    check(addresses[0] != addresses[1], f"both listen at {addresses[0]}")


def nobody_else_reaches_a_render(programs, folder):
    """Its socket lies in a folder of this user; one that is killed leaves it to the next to remove."""
    path = make(folder)
    command = [programs.path("baton"), "render", str(path), "--work-dir", str(folder / "work")]
    endpoint = folder / "work/endpoint"
    running = Process(command, folder / "render.log")
    wait_until(endpoint.exists, "it listens")
    place = Path(endpoint.read_text(encoding="utf-8").strip().removeprefix("ipc://")).parent
    check_equal(oct(place.stat().st_mode & 0o777), "0o700", "rights of the folder")
    running.kill()
    running.wait()
    check(place.exists(), "who is killed removes nothing")
    wait_until(lambda: programs.run("baton", *command[1:], expect=None).returncode == OK, "it goes on")
    after = Path(endpoint.read_text(encoding="utf-8").strip().removeprefix("ipc://")).parent
    check(not place.exists() and not after.exists(), f"left: {place}, {after}")


def a_long_log_is_put_aside(programs, folder):
    """Once; and through no link that somebody has laid into the folder."""
    path, work, secret = make(folder), folder / "work", folder / "secret"
    work.mkdir()
    secret.write_text("kept", encoding="ascii")
    log, aside = work / "coordinator.log", work / "coordinator.log.1"
    log.write_text("an old line\n" * (3 << 20), encoding="ascii")
    aside.symlink_to(secret)
    programs.render(path, work)
    check_equal(secret.read_text(encoding="ascii"), "kept", "what the link led to")
    check(not aside.is_symlink() and aside.read_text(encoding="ascii").startswith("an old line"), "the old log is beside it")
    check_equal(oct(aside.stat().st_mode & 0o777), "0o600", "rights of the old log")
    check(log.stat().st_size < 1 << 20 and "old line" not in log.read_text(encoding="ascii"), "the log goes on empty")


def an_edited_job_does_not_mix_with_the_one_before(programs, folder):
    """Rendered, edited and rendered, edited back and rendered: each time the frames are the job's own, or it is refused."""
    first = write_job(folder / "job.json", make_job(folder, frames="1-4"))
    edited = write_job(folder / "edited.json", make_job(folder, frames="1-4", seed=8))
    programs.render(first, folder / "work")
    expected = programs.pixels(folder / "frames")
    refused = programs.render(edited, folder / "work", expect=BAD_INPUT)
    check("what differs: $.seed" in refused.stderr and "--restart" in refused.stderr, refused.stderr)
    check_equal(programs.pixels(folder / "frames"), expected, "frames after a refusal")
    programs.render(edited, folder / "work", extra=["--restart"])
    check(programs.pixels(folder / "frames") != expected, "the edited job did not replace the frames")
    programs.render(first, folder / "work", expect=BAD_INPUT)
    programs.render(first, folder / "work", extra=["--restart"])
    check_equal(programs.pixels(folder / "frames"), expected, "frames of the first job, rendered again")

    # Another setting is no other picture.
    tiles = write_job(folder / "tiles.json", make_job(folder, frames="1-4", image={"tileSize": 16}, name="tiles"))
    programs.render(tiles, folder / "work")
    check_equal(programs.pixels(folder / "frames"), expected, "frames in other tiles")


def an_interrupted_render_goes_on_under_another_name(programs, folder):
    """Nobody else waits for it in a farm of its own, whatever its name, frames and files are now."""
    job = make_job(folder, frames="1-12")
    words = [programs.path("baton"), "render", "--isa", "sse4", "--restart", write_job(folder / "job.json", job), "--set", "seed=7",
             "--work-dir", folder / "work dir", "--threads-per-worker", "1"]
    first = Process([str(word) for word in words], folder / "first.log")
    wait_until(lambda: (folder / "frames/frame.0002.exr").exists(), "two frames are done")
    first.terminate()
    check(first.wait() != OK, "it was done too soon")
    again = [str(word) for word in words[2:] if word != "--restart"]
    check(f"to go on: baton render {shlex.join(again)}\n" in first.log(), first.log())
    renamed = write_job(folder / "z.json", {**job, "name": "z", "frames": "1-3", "output": {**job["output"], "pattern": "s.####.exr"}})
    done = programs.render(renamed, folder / "work dir", extra=["--isa", "sse4"])
    check("which was interrupted, makes way" in done.stderr, done.stderr)
    check_equal(sorted(file.name for file in (folder / "frames").glob("s.*.exr")), [f"s.000{n}.exr" for n in (1, 2, 3)], "frames")


def what_is_gone_is_made_again_and_only_that(programs, folder):
    """A frame, a state and a film that are gone or damaged, in jobs that are done, running and failed."""
    changes = {"frames": "1-6", "sampling": {"method": "bidirectional"}, "state": {"carry": False, "keep": "last"}}
    for name, extra in {"plain": {}, "correlated": {"visibility": {"correlated": True}}}.items():
        place = folder / name
        job = make_job(place, **changes, **extra)
        del job["sampling"]["numDistributions"]
        path = write_job(place / "job.json", job)
        with Farm(programs, place / "farm", workers=1, threads=2) as farm:
            ident = farm.submit(path)
            farm.wait_for(ident)
            expected = programs.pixels(place / "frames")
            written = {file.name: file.stat().st_mtime_ns for file in (place / "frames").glob("*.exr")}

            # One frame is gone: one frame is written.
            (place / "frames/frame.0004.exr").unlink()
            farm.submit(path)
            farm.wait_for(ident)
            check_equal(programs.pixels(place / "frames"), expected, f"frames of {name} after one was gone")
            again = [n for n, time in written.items() if (place / "frames" / n).stat().st_mtime_ns != time]
            check_equal(again, ["frame.0004.exr"], "frames that were written again")


def damaged_blobs_are_made_again(programs, folder):
    """One byte of every blob is changed while no worker is there: nothing fails, every frame is right."""
    path = make(folder)
    witness = folder / "witness"
    programs.render(make(witness), witness / "work", workers=2)
    with Farm(programs, folder / "farm") as farm:
        worker = farm.start_worker()
        ident = farm.submit(path)
        wait_until(lambda: num_blobs(farm.work_folder) >= 12, "the first results are in the store")
        worker.kill()
        damaged = 0
        for number, blob in enumerate(sorted(farm.work_folder.rglob("*.blob"))):
            content = bytearray(blob.read_bytes())
            content[len(content) // 2] ^= 0x10
            blob.write_bytes(bytes(content[:-1] if number % 2 else content))
            damaged += 1
        check(damaged >= 12, f"only {damaged} blobs were there to be damaged")
        farm.start_worker()
        farm.wait_for(ident)
        check_equal(farm.show(ident)["status"], "done", "status")
    check_equal(programs.pixels(folder / "frames"), programs.pixels(witness / "frames"), "pixels")


def a_killed_coordinator_goes_on_with_a_second_pass(programs, folder):
    """Every kind of task comes back from the journal as it was."""
    for method in ["sequential", "bidirectional"]:
        place = folder / method
        sampling = {**SLOW, "method": method}
        if method != "sequential":
            del sampling["numDistributions"]
            sampling["numCandidates"] = 4096
        changes = {"frames": "1-4", "image": {"tileSize": 32}, "visibility": {"correlated": True}}
        job = make_job(place, **changes)
        job["sampling"] = sampling
        path = write_job(place / "job.json", job)
        with Farm(programs, place / "farm") as farm:
            worker = farm.start_worker()
            ident = farm.submit(path)
            wait_until(lambda: farm.show(ident)["framesDone"] >= 1, "a frame is done")
            before = farm.show(ident)
            farm.coordinator.kill()
            farm.start_coordinator()
            after = farm.show(ident)
            check(after["tasksDone"] >= before["tasksDone"], f"forgot tasks: {before['tasksDone']}, {after['tasksDone']}")
            farm.wait_for(ident)
            check_equal(farm.show(ident)["status"], "done", f"status of {method}")
            check(worker.alive(), "the worker ended with its coordinator")


if __name__ == "__main__":
    run_tests()

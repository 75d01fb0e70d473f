#!/usr/bin/env python3
"""`baton job submit|list|show|wait|cancel` against a live coordinator, and what they say when there is none."""

import json
import re
import time

from farm import BAD_INPUT, FAILED, IO, OK, PATIENCE, UNAVAILABLE, Farm, Process, check, check_equal, free_port, run_tests, wait_until
from jobs import make_job, write_job

TIMEOUT, CANCELLED, USAGE = 1, 3, 64


def small_job(folder, **changes):
    return write_job(folder / "job.json", make_job(folder, **{"frames": "1-2", **changes}))


def saved_jobs(farm):
    """The documents that workers saved for replays."""
    return sorted((farm.work_folder / "store/jobs").glob("*.json"))


def listed_workers(farm):
    return json.loads(farm.baton("worker", "list", "--json").stdout)


def nobody_listens(programs, folder):
    """Found out in about two seconds, not after the patience for a busy coordinator."""
    endpoint = f"tcp://127.0.0.1:{free_port()}"
    for words in [["list"], ["show", "ab"], ["wait", "ab"], ["cancel", "ab"]]:
        start = time.monotonic()
        programs.refuses("job", *words, "--coordinator", endpoint, expect=UNAVAILABLE,
                         says=f"{endpoint}: no coordinator listens there")
        check(time.monotonic() - start < 9 * PATIENCE, f"{words[0]} took {time.monotonic() - start:.1f} s")


def a_job_from_submission_to_its_end(programs, folder):
    with Farm(programs, folder / "farm") as farm:
        path = small_job(folder)
        job = farm.submit(path)

        # Nobody works yet.
        listed = json.loads(farm.baton("job", "list", "--json").stdout)
        check_equal([(j["id"], j["status"]) for j in listed["jobs"]], [(job, "running")], "jobs")
        check_equal(listed["workers"], [], "workers")
        farm.baton("job", "wait", job, "--timeout", "0.1", expect=TIMEOUT)

        # Now somebody does; a beginning of the ID is enough.
        farm.start_worker()
        check("done" in farm.baton("job", "wait", job[:6]).stdout, "wait does not say how it ended")
        shown = farm.show(job[:6])
        check_equal((shown["id"], shown["status"], shown["framesDoneNumbers"]), (job, "done", [1, 2]), "show")
        text = farm.baton("job", "list").stdout
        check("0 jobs, 1 workers; --all shows 1 that have ended" in text and job[:6] not in text, text)
        check(job[:6] in farm.baton("job", "list", "--all").stdout, "the job is not listed with --all")
        for since, is_listed in ("10m", True), ("2200-01-01T00:00:00Z", False):
            lines = farm.baton("job", "list", "--all", "--since", since).stdout
            check((job[:6] in lines) == is_listed, f"--since {since} looks at when a job ended: {lines}")
        check_equal(saved_jobs(farm), [], "documents of a job that is done")

        # The same job again is no new job.
        again = json.loads(farm.baton("job", "submit", path, "--json").stdout)
        check_equal(again, {"id": job, "version": 1, "alreadyThere": True, "plan": "frames 1-2 are kept\n"}, "second submission")

        # Deleted, it is known no longer; its frames stay.
        farm.baton("job", "delete", expect=USAGE)
        check("1 jobs are deleted" in farm.baton("job", "delete", "--ended").stdout, "no word of what was deleted")
        check("0 jobs" in farm.baton("job", "list", "--all").stdout, "the job is still there")
        farm.baton("job", "show", job, expect=BAD_INPUT)
        check(list(folder.glob("**/frame.0001.exr")), "the frames are gone")


def unknown_and_ambiguous_ids(programs, folder):
    with Farm(programs, folder / "farm") as farm:
        for i in range(17):
            farm.submit(small_job(folder / str(i), seed=i))
        jobs = [job["id"] for job in json.loads(farm.baton("job", "list", "--json").stdout)["jobs"]]
        check_equal(len(set(jobs)), 17, "jobs")

        # Seventeen IDs begin with sixteen digits.
        digit = next(d for d in "0123456789abcdef" if sum(job.startswith(d) for job in jobs) > 1)
        for name, words in {digit: "jobs have IDs that begin so", "xyz": "no job has this name or ID"}.items():
            for command in ["show", "wait", "cancel"]:
                done = farm.baton("job", command, name, expect=BAD_INPUT)
                check(f"job '{name}'" in done.stderr and words in done.stderr, done.stderr)


def names_of_jobs(programs, folder):
    """A name is as good as an ID; where two jobs have it, both are listed."""
    with Farm(programs, folder / "farm") as farm:
        first = farm.submit(small_job(folder / "a", name="old oak"))
        second = farm.submit(small_job(folder / "b", name="new oak", seed=2))
        check_equal(farm.show("old oak")["id"], first, "job of this name")
        farm.baton("job", "pause", "new oak")
        check_equal(farm.show(second)["status"], "paused", "status")
        third = farm.submit(small_job(folder / "c", name="new oak", seed=3))
        for command in ["show", "wait", "pause", "resume", "cancel", "retry", "delete"]:
            done = farm.baton("job", command, "new oak", expect=BAD_INPUT)
            check("job 'new oak': 2 jobs have this name:" in done.stderr, done.stderr)
            check(f"{second}  paused" in done.stderr and f"{third}  running" in done.stderr, done.stderr)

        # A name may be what is told of another job's ID.
        farm.submit(small_job(folder / "d", name=first[:8], seed=4))
        for command in ["lock", "pause", "cancel"]:
            done = farm.baton("job", command, first[:8], *(["--frames", "1"] if command == "lock" else []), expect=BAD_INPUT)
            check(f"a job has this name, and the ID {first} begins so" in done.stderr, done.stderr)
        check_equal(farm.show(first)["id"], first, "job of this ID")

        # Every command takes the name where it is one job's.
        for command, status in [("resume", "running"), ("pause", "paused"), ("cancel", "cancelled"), ("retry", "running"),
                                ("cancel", "cancelled")]:
            farm.baton("job", command, "old oak")
            check_equal(farm.show(first)["status"], status, f"status after {command}")
        farm.baton("job", "wait", "old oak", expect=CANCELLED)
        farm.baton("job", "delete", "old oak")
        check("no job has this name" in farm.baton("job", "show", "old oak", expect=BAD_INPUT).stderr, "still there")


def a_cancelled_job_goes_on_when_submitted_again(programs, folder):
    with Farm(programs, folder / "farm") as farm:
        path = small_job(folder)
        job = farm.submit(path)
        check("cancelled" in farm.baton("job", "cancel", job).stdout, "cancel does not say so")
        farm.baton("job", "wait", job, expect=CANCELLED)
        check_equal(farm.show(job)["status"], "cancelled", "status")
        check_equal(farm.submit(path), job, "ID")
        farm.start_worker()
        farm.baton("job", "wait", job)


def waiting_outlasts_a_restart_of_the_coordinator(programs, folder):
    with Farm(programs, folder / "farm") as farm:
        job = farm.submit(small_job(folder))
        command = [programs.path("baton"), "job", "wait", job, "--coordinator", farm.endpoint]
        waiting = Process(command, folder / "wait.log")
        try:
            # Long enough for its first question.
            time.sleep(1)
            farm.coordinator.kill()
            time.sleep(1)
            check(waiting.alive(), f"wait gave up:\n{waiting.log()}")
            farm.start_coordinator()
            farm.start_worker()
            check_equal(waiting.wait(), OK, "exit code of wait")
        finally:
            waiting.kill()


def a_paused_job_waits_until_it_is_resumed(programs, folder):
    with Farm(programs, folder / "farm") as farm:
        job = farm.submit(small_job(folder))
        check("paused" in farm.baton("job", "pause", job).stdout, "pause does not say so")
        farm.start_worker()
        farm.baton("job", "wait", job, "--timeout", "1", expect=TIMEOUT)
        check_equal(farm.show(job)["tasksDone"], 0, "tasks done while paused")
        farm.baton("job", "resume", job)
        farm.baton("job", "wait", job)


def a_drained_worker_ends_and_its_work_goes_on(programs, folder):
    with Farm(programs, folder / "farm") as farm:
        job = farm.submit(small_job(folder))
        first = farm.start_worker()
        wait_until(lambda: "worker0" in farm.baton("worker", "list").stdout, "the worker is listed")
        farm.baton("worker", "drain", "worker0")
        check_equal(first.wait(), OK, "exit code of the drained worker")
        wait_until(lambda: json.loads(farm.baton("worker", "list", "--json").stdout) == [], "the worker has left")
        check("no worker has this name" in farm.baton("worker", "drain", "worker0", expect=BAD_INPUT).stderr,
              "an unknown worker was drained")
        farm.start_worker()
        farm.baton("job", "wait", job)


def a_worker_that_was_told_by_a_signal_ends(programs, folder):
    with Farm(programs, folder / "farm") as farm:
        job = farm.submit(small_job(folder, sampling={"numCandidates": 8192, "numParticles": 64}, quality={"rounds": 8}))
        first = farm.start_worker()
        wait_until(lambda: listed_workers(farm) and listed_workers(farm)[0]["tasks"], "it has a task")
        wait_until(lambda: listed_workers(farm)[0]["memoryBytes"] > 1 << 20, "its memory is known")
        first.terminate()
        first.wait()
        farm.start_worker()
        farm.baton("job", "wait", job)


def a_held_worker_waits(programs, folder):
    """It stays, renders nothing new until it is let go, and whoever asks is told; a coordinator that comes later holds it, too."""
    with Farm(programs, folder / "farm", workers=1) as farm:
        wait_until(lambda: listed_workers(farm), "the worker is listed")
        farm.baton("worker", "hold", "worker0")
        job = farm.submit(small_job(folder))
        held = listed_workers(farm)[0]
        check_equal((held["activity"], held["held"], held["leases"]), ("held", True, 0), "the worker")
        check("is held, and takes nothing new" in farm.baton("worker", "why", "worker0").stdout, "it does not say why")
        check("is held" in farm.baton("job", "why", job).stdout, "the job does not say why")
        farm.coordinator.kill()
        farm.start_coordinator()
        wait_until(lambda: [worker["activity"] for worker in listed_workers(farm)] == ["held"], "it is held again")
        farm.baton("job", "wait", job, "--timeout", "1", expect=TIMEOUT)
        farm.baton("worker", "hold", "worker0", "--off")
        farm.wait_for(job)
        check(re.search(r"worker held .*\n(.*\n)*.*worker released", farm.baton("farm", "events").stdout), "events")


def what_workers_say_is_joined_with_what_happened(programs, folder):
    with Farm(programs, folder / "farm", workers=1) as farm:
        job = farm.submit(small_job(folder))
        follow = Process([farm.programs.path("baton"), "job", "log", job, "--follow", "--coordinator", farm.endpoint], folder / "follow.log")
        farm.wait_for(job)
        text = farm.baton("job", "log", job).stdout
        for part in ("  task done ", "  job done ", f"  worker0  debug: job {job[:8]}: ", ", attempt 1: done"):
            check(part in text, f"{part!r} is not in\n{text}")
        times = [line[:20] for line in text.splitlines()]
        check_equal(times, sorted(times), "times of lines")
        rows = [json.loads(line) for line in farm.baton("job", "log", job, "--json").stdout.splitlines()]
        said = [row["text"] for row in rows if "level" in row]
        check(len(said) > 4 and all(f"job {job[:8]}" in line for line in said), f"lines of workers: {said}")
        check_equal(len([row for row in rows if row.get("kind") == "task done"]), sum(line.endswith(": done") for line in said), "ends")
        wait_until(lambda: "job done" in follow.log() and ", attempt 1: done" in follow.log(), "it is followed")
        follow.kill()
        hidden = farm.baton("job", "log", job, "--logs", folder / "nowhere")
        check("not seen from here, so only the events are shown" in hidden.stderr and "job done" in hidden.stdout, hidden.stderr)
        check_equal(len(farm.baton("job", "log", job, "--last", "3").stdout.splitlines()), 3, "lines of --last 3")
        check_equal((farm.work_folder / "logs").stat().st_mode & 0o077, 0, "rights of others in the logs")


def workers_of_one_name_have_logs_of_their_own(programs, folder):
    with Farm(programs, folder / "farm", workers=0) as farm:
        for _ in range(2):
            farm.start_worker(name="w")
        wait_until(lambda: len(listed_workers(farm)) == 2, "both are there")
        job = farm.submit(small_job(folder))
        farm.wait_for(job)
        done = [row["worker"] for row in map(json.loads, farm.baton("job", "log", job, "--json").stdout.splitlines())
                if row.get("kind") == "task done"]
        said = [row["worker"] for row in map(json.loads, farm.baton("job", "log", job, "--json").stdout.splitlines())
                if "level" in row and row["text"].endswith(": done")]
        check_equal(sorted(said), sorted(done), "who says that it is done is who has done it")


def frames_are_rendered_once_more(programs, folder):
    """What it takes is said before, a person or --yes says so, and the frames are the same."""
    with Farm(programs, folder / "farm", workers=1) as farm:
        path = small_job(folder, frames="1-4")
        job = farm.submit(path)
        farm.wait_for(job)
        frames = programs.pixels(folder / "frames")
        times = {file: file.stat().st_mtime_ns for file in folder.glob("frames/*.exr")}
        check_equal(len(times), 4, "frames")
        told = json.loads(farm.baton("job", "requeue", job, "--frames", "2-3", "--dry-run", "--json").stdout)
        check("frames 2-3 are rendered again" in told["plan"] and told["tasks"] > 2 and told["cpuSeconds"] > 0 and not told["requeued"], told)
        for words, says in [(["--frames", "2-3"], "expected --yes, or --dry-run"), (["--frames", "2-9", "--yes"], "it has no frames 5-9")]:
            done = farm.baton("job", "requeue", job, *words, expect=USAGE if "--yes" not in words else BAD_INPUT)
            check(says in done.stderr, done.stderr)
        check_equal(farm.show(job)["status"], "done", "status")
        check("CPU time" in farm.baton("job", "requeue", job, "--frames", "2-3", "--yes").stdout, "cost")
        farm.wait_for(job)
        check_equal(programs.pixels(folder / "frames"), frames, "frames")
        newer = sorted(file.name for file, time_ns in times.items() if file.stat().st_mtime_ns > time_ns)
        check_equal(newer, ["frame.0002.exr", "frame.0003.exr"], "frames that were written again")
        # Locked meanwhile, and unlocked before its end or after: nobody has changed it, so it is the job's.
        third = folder / "frames/frame.0003.exr"
        for is_late in (False, True):
            before_ns = third.stat().st_mtime_ns
            farm.baton("worker", "hold", "worker0")
            farm.baton("job", "requeue", job, "--frames", "3", "--yes")
            farm.baton("job", "lock", job, "--frames", "3")
            if is_late:
                farm.baton("worker", "hold", "worker0", "--off")
                farm.wait_for(job)
            farm.baton("job", "lock", job, "--frames", "3", "--off")
            farm.baton("worker", "hold", "worker0", "--off")
            farm.wait_for(job)
            check_equal(programs.pixels(folder / "frames"), frames, "frames")
            check(third.stat().st_mtime_ns > before_ns, "it was not rendered")
        farm.baton("job", "lock", job, "--frames", "2")
        check("frame 2 is locked" in farm.baton("job", "requeue", job, "--frames", "1-2", "--yes", expect=USAGE).stderr, "locked")
        check("frames requeued" in farm.baton("farm", "events", "--job", job).stdout, "events")


def traces_say_where_the_time_went(programs, folder):
    with Farm(programs, folder / "farm", workers=1, threads=2) as farm:
        job = farm.submit(small_job(folder / "shot", sampling={"numCandidates": 2048, "numParticles": 64}))
        other = farm.submit(small_job(folder / "other", seed=9))
        farm.wait_for(job)
        farm.wait_for(other)
        trace = folder / "shot.json"
        told = json.loads(farm.baton("job", "trace", job, "--out", trace, "--json").stdout)
        events = json.loads(trace.read_text())
        tasks = [event for event in events if event.get("cat") == "task"]
        mine = [event for event in tasks if event.get("args", {}).get("id") == job]
        check_equal(len(mine), farm.show(job)["tasksDone"], "tasks of the job in its trace")
        check(other not in trace.read_text(), "another job's task is named")
        check({"frame", "make", "write"} <= {event.get("cat") for event in events}, "kinds of spans")
        check(any(event["name"].startswith("light of frame 1") for event in events), "light")
        check_equal(told["summary"]["threads"], 2, "threads")
        said = json.loads(programs.run("baton", "trace", trace, "--threads", "1,64", "--json").stdout)
        one, many = said["played"]
        check(one["seconds"] > many["seconds"] >= said["longestChain"]["seconds"] - 1e-6, f"played: {said['played']}")
        check(said["busy"] <= 2 and sum(said["waitedSeconds"].values()) < 2 * said["seconds"], str(said))
        hidden = farm.baton("job", "trace", job, "--logs", folder / "nowhere", expect=IO)
        check("no task of job" in hidden.stderr, hidden.stderr)
    rendered = folder / "render.json"
    programs.render(small_job(folder / "own"), folder / "work", extra=["--trace", str(rendered)])
    names = {event["name"] for event in json.loads(rendered.read_text())}
    check({"starting the farm", "contact sheet", "stopping the farm", "loading the job"} <= names, str(names))
    check("chain " in programs.run("baton", "trace", rendered).stdout, "the chain")
    programs.refuses("trace", small_job(folder / "no"), expect=BAD_INPUT, says="expected a trace")


def pictures_of_a_job(programs, folder):
    """The last frame as PNG; while one is in work, its tiles."""
    with Farm(programs, folder / "farm") as farm:
        job = farm.submit(small_job(folder, frames="1-30", image={"width": 96, "height": 64, "tileSize": 32}))
        nothing = farm.baton("job", "picture", job, "--out", folder / "none.png", expect=BAD_INPUT)
        check("no frame is written yet" in nothing.stderr and not (folder / "none.png").exists(), nothing.stderr)
        farm.start_worker()

        def partial():
            """Of the job while it stands still."""
            farm.baton("job", "pause", job)
            wait_until(lambda: not json.loads(farm.baton("job", "tasks", job, "--running", "--json").stdout), "nothing runs")
            shown = farm.baton("job", "picture", job, "--partial", "--json", "--out", folder / "part.png", expect=None)
            row = json.loads(shown.stdout) if shown.returncode == OK else {}
            farm.baton("job", "resume", job)
            return row if 0 < row.get("tiles", 0) < row.get("tilesTotal", 0) else None

        row = wait_until(partial, "some tiles of a frame")
        check_equal((row["written"], row["tilesTotal"]), (False, 6), "a frame in work")
        farm.wait_for(job)
        last = json.loads(farm.baton("job", "picture", job, "--json", "--out", folder / "last.png").stdout)
        check_equal((last["frame"], last["written"]), (30, True), "the last frame")
        programs.run("baton", "view", last["file"], "--out", folder / "view.png")
        check_equal((folder / "last.png").read_bytes(), (folder / "view.png").read_bytes(), "the picture")
        away = folder / "away"
        (folder / "frames").rename(away)
        check("frame.0030.exr" in farm.baton("job", "picture", job, "--out", folder / "x.png", expect=IO).stderr, "a folder that is not seen")


def a_failed_job_is_retried(programs, folder):
    """What was wrong is mended meanwhile: a mesh that was gone is back."""
    with Farm(programs, folder / "farm") as farm:
        job = farm.submit(small_job(folder, maxRetriesPerTask=0))
        mesh = folder / "sphere.off"
        mesh.rename(folder / "elsewhere.off")
        farm.start_worker()
        farm.baton("job", "wait", job, expect=FAILED)
        (folder / "elsewhere.off").rename(mesh)
        check_equal(json.loads(farm.baton("job", "retry", job, "--json").stdout)["status"], "running", "status after retry")
        farm.baton("job", "wait", job)


def a_map_that_is_away_is_waited_for(programs, folder):
    """Gone after the submission and back some seconds later: the job goes on by itself."""
    with Farm(programs, folder / "farm") as farm:
        job = farm.submit(small_job(folder))
        away = folder / "away.hdr"
        (folder / "lamp.hdr").rename(away)
        worker = farm.start_worker()
        wait_until(lambda: "lamp.hdr" in worker.log() and "waits 5 s" in worker.log(), "the worker misses the map")
        away.rename(folder / "lamp.hdr")
        farm.baton("job", "wait", job)
        check_equal(farm.show(job)["status"], "done", "status")


def a_task_that_takes_too_long_fails(programs, folder):
    """One second for billions of samples: the attempt is counted, the reason named, the job kept for a replay."""
    with Farm(programs, folder / "farm") as farm:
        endless = {"method": "reference", "referenceSamples": 1 << 24}
        job = farm.submit(small_job(folder, sampling=endless, state={"carry": False}, maxSecondsPerTask=1,
                                    maxRetriesPerTask=0))
        worker = farm.start_worker()
        farm.baton("job", "wait", job, expect=FAILED)
        shown = farm.show(job)
        check_equal((shown["tasksFailed"], shown["attemptsLost"]), (1, 1), "failures")
        words = "ran for longer than maxSecondsPerTask"
        check(words in shown["failures"][0] and words in farm.coordinator.log(), "the reason is not named")
        check(re.search(rf"job {job[:8]}: frames? [\d-]+, tile \d+, attempt \d+ failed: {words}", worker.log()), worker.log())
        wait_until(lambda: [file.stem for file in saved_jobs(farm)] == [shown["document"]], "the failed job's document stays")


if __name__ == "__main__":
    run_tests()

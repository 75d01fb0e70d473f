#!/usr/bin/env python3
"""What a farm says of who is not here, of names that no list can show, of what has failed, and of words that make no sense."""

import json
import os
import signal
import sqlite3
import time
from pathlib import Path

from farm import BAD_INPUT, OK, USAGE, Farm, check, check_equal, check_says, run_tests, wait_until
from jobs import make_job, write_job
from test_answers import ask, kinds, listed, submit

BAD_NAME = "bad\udcff\udcfe\x1b[31m\nforged"  # what the system makes of bytes that are no UTF-8
SHOWN_NAME = "bad\ufffd\ufffd\\x1b[31m\\nforged"


def ids(farm, activity):
    return [w["id"] for w in ask(farm, "worker", "list") if w["activity"] == activity]


def names_that_no_list_can_show(programs, folder):
    for name in (BAD_NAME, "two\nlines", "\x1b[2J", "\x85", "\u202e"):
        refused = programs.run("baton-worker", "--name", name, "--coordinator", "tcp://127.0.0.1:1", "--give-up-s", "1", expect=USAGE)
        check_says(refused.stderr, "--name: expected UTF-8 without line breaks")
    with Farm(programs, folder / "farm") as farm:
        farm.start_worker(name="wéü 名")
        first = submit(farm, folder, "first")
        farm.wait_for(first)
        check_says(farm.baton("worker", "list").stdout, "wéü 名")
        farm.coordinator.kill()
        # As a coordinator of before would have left it.
        with sqlite3.connect(farm.folder / "work/journal.sqlite") as journal:
            for kind in (17, 19):
                journal.execute("INSERT INTO events (time_ms, kind, actor, job, worker, reason, seconds) VALUES (?, ?, CAST(? AS TEXT), '', CAST(? AS TEXT), "
                                "CAST(? AS TEXT), 0)", (int(1000 * time.time()), kind, *3 * [os.fsencode(BAD_NAME)]))
        journal.close()
        farm.start_coordinator()
        for words in (("worker", "list"), ("farm", "status"), ("top",), ("farm", "events"), ("job", "list", "--all"), ("job", "tasks"), ("worker", "why", SHOWN_NAME)):
            text = farm.baton(*words).stdout
            check("\x1b" not in text and "\nforged" not in text, f"controls are shown: {text!r}")
            text = farm.baton(*words, "--json").stdout
            check(all(json.loads(line) for line in text.splitlines()) if words[0] in ("top",) or words[1] == "events" else json.loads(text) is not None, "no JSON")
        check(SHOWN_NAME in ids(farm, "lost"), "the worker of that name is not listed")
        job = make_job(folder / "lines", name="two\nlines \x1b[31m", frames="1")
        refused = farm.baton("job", "submit", write_job(folder / "lines/job.json", job), expect=BAD_INPUT)
        check_says(refused.stderr, "$.name: expected a text", "without control characters")


def what_has_failed_is_told_after_the_end(programs, folder):
    with Farm(programs, folder / "farm") as farm:
        job = make_job(folder / "shot", frames="1-2", name="shot")
        path = write_job(folder / "shot/job.json", job)
        meshes = [p for p in (folder / "shot").iterdir() if p.suffix in (".off", ".ply")]
        check(meshes, "the job has no mesh")
        shot = farm.submit(path)
        kept = {mesh: mesh.read_bytes() for mesh in meshes}
        for mesh in meshes:
            mesh.unlink()
        farm.start_worker(name="a")
        farm.baton("job", "wait", shot, expect=None)
        check_equal(farm.show(shot)["status"], "failed", "the job")
        failed = ask(farm, "job", "tasks", shot, "--failed")
        check(failed and all(t["worker"] == "a" and t["status"] == "failed" and meshes[0].name in t["message"] for t in failed), f"failed tasks: {failed}")
        check_says(farm.baton("job", "tasks", shot).stdout, "failed", "attempts failed so, this is the last", meshes[0].name)
        farm.coordinator.kill()
        farm.start_coordinator()
        check_equal(ask(farm, "job", "tasks", shot, "--failed"), failed, "failed tasks after a restart")
        for mesh, data in kept.items():
            mesh.write_bytes(data)
        farm.baton("job", "retry", shot)
        farm.wait_for(shot)
        check_equal(ask(farm, "job", "tasks", shot, "--failed"), [], "failed tasks once it was tried again")


def who_says_nothing_is_the_cause(programs, folder):
    with Farm(programs, folder / "farm", workers=None) as farm:
        farm.start_coordinator(("--heartbeat-ms", "2000"))
        shot = submit(farm, folder, "shot", slow=True, frames="1-50")
        worker = farm.start_worker(name="a")
        wait_until(lambda: listed(farm, shot)["activity"] == "rendering", "it is rendered")
        os.kill(worker.pid, signal.SIGSTOP)
        wait_until(lambda: ids(farm, "silent") == ["a"], "the worker is silent")
        text = farm.baton("job", "why", shot).stdout
        check_says(text, "is with worker a for", "  <- worker a has said nothing for ")
        check_equal(kinds(ask(farm, "job", "why", shot))[-2:], ["running", "silent"], "causes")
        check_equal(kinds(ask(farm, "worker", "why", "a"))[-1], "silent", "why the worker does nothing")
        os.kill(worker.pid, signal.SIGCONT)
        wait_until(lambda: kinds(ask(farm, "job", "why", shot))[-1] == "running", "it speaks again")


def who_was_turned_away_is_told_of(programs, folder):
    with Farm(programs, folder / "farm", workers=None) as farm:
        farm.start_coordinator(("--heartbeat-ms", "300"))
        best = farm.start_worker(name="best")
        wait_until(lambda: ids(farm, "idle") == ["best"], "the worker is there")
        least = farm.start_worker(name="least", extra=("--isa", "sse4"))
        check_equal(wait_until(lambda: ids(farm, "turned away"), "it is listed"), ["least"], "who was turned away")
        check_says(farm.baton("worker", "list").stdout, "turned away", "worker least renders with SSE4", "1 workers, 1 turned away")
        chain = ask(farm, "worker", "why", "least")
        check_equal(kinds(chain), ["turned away"], "why it does nothing")
        check_says(chain[0]["text"], "worker least is turned away: worker least renders with SSE4")
        best.kill()
        shot = submit(farm, folder, "shot")
        reason = wait_until(lambda: (lambda r: r if "no worker is connected" in r else None)(listed(farm, shot)["reason"]), "nobody is there")
        check_says(reason, "; worker least is there and turned away: worker least renders with SSE4")
        check_equal(ask(farm, "job", "why", shot)[-1]["workers"], ["least"], "who waits outside")
        # With nobody of another kind it comes in.
        farm.wait_for(shot)
        check_equal(ids(farm, "turned away"), [], "who is turned away once it is in")
        least.terminate()


def who_has_ended_in_order_is_not_lost(programs, folder):
    with Farm(programs, folder / "farm", workers=1) as farm:
        farm.start_worker(name="drained")
        wait_until(lambda: len(ids(farm, "idle")) == 2, "the workers are there")
        farm.baton("worker", "drain", "drained")
        farm.workers[1].wait()
        shot = submit(farm, folder, "shot", slow=True, frames="1-50")
        wait_until(lambda: listed(farm, shot)["activity"] == "rendering", "it is rendered")
        farm.baton("farm", "stop", "--yes")
        check_equal(farm.coordinator.wait(), OK, "exit code of the coordinator")
        farm.workers[0].wait()
        stopped = time.time()
        time.sleep(2)
        farm.start_coordinator()
        check_equal(ids(farm, "lost"), [], "lost workers")
        events = farm.baton("farm", "events").stdout
        check("worker lost" not in events and "task lost" not in events, events)
        check_says(events, "worker left", "the farm was stopped")
        check_says(farm.baton("worker", "why", "worker0").stdout, "worker worker0 has ended in order: the farm was stopped, since 2")
        check_says(farm.baton("worker", "why", "drained").stdout, "worker drained has ended in order: it was told to finish")
        since = ask(farm, "job", "why", shot)[-1]["since"]
        check(since < time.strftime("%Y-%m-%dT%H:%M:%S", time.gmtime(stopped + 1)), f"nobody is there since {since}")


def an_idle_worker_names_the_jobs_that_are_paused(programs, folder):
    with Farm(programs, folder / "farm", workers=None) as farm:
        farm.start_coordinator()
        jobs = [submit(farm, folder, name) for name in ("first", "second")]
        for job in jobs:
            farm.baton("job", "pause", job)
        farm.start_worker(name="a")
        wait_until(lambda: ids(farm, "idle") == ["a"], "the worker is there")
        check_says(farm.baton("worker", "why", "a").stdout, "no job that runs has a task left; 2 jobs are paused, job ", "for one: by a person")
        farm.baton("job", "cancel", jobs[1])
        check_says(farm.baton("worker", "why", "a").stdout, f"; job {jobs[0][:8]} is paused: by a person")
        check_equal(ask(farm, "worker", "why", "a")[0]["job"], jobs[0], "the paused job")


def a_file_that_is_submitted_says_the_priority(programs, folder):
    def events(farm, job):
        return farm.baton("farm", "events", "--job", job).stdout.splitlines()

    with Farm(programs, folder / "farm", workers=None) as farm:
        farm.start_coordinator()
        shot = submit(farm, folder, "shot", priority=20)
        path = folder / "shot/job.json"
        farm.baton("job", "set", shot, "priority=92")
        farm.submit(path)
        check_equal(farm.show(shot)["priority"], 20, "the priority of the same file")
        check_says(events(farm, shot)[-1], "priority changed", "20, it was 92: its file was submitted again")
        farm.baton("job", "set", shot, "priority=91")
        check_equal(submit(farm, folder, "shot", frames="1-3", priority=20), shot, "the job")
        check_equal(farm.show(shot)["priority"], 20, "the priority of a longer job")
        check_says(events(farm, shot)[-1], "job changed", "frames 1-3, it was 1-2; priority 20, it was 91")
        submit(farm, folder, "shot", frames="1-3", priority=20, metadata={"a": "b"}, image={"tileSize": 16})
        check(events(farm, shot)[-1].endswith("changed: $.image.tileSize, $.metadata.a"), events(farm, shot)[-1])
        log = farm.coordinator.log()
        check("frames of another job" not in log, log)
        check_says(log, "version 2 goes on in place of version 1")
        # What is no file leaves it as it was set, through a restart, too.
        farm.baton("job", "set", shot, "priority=90")
        farm.baton("job", "cancel", shot)
        farm.baton("job", "retry", shot)
        check_equal(farm.show(shot)["priority"], 90, "the priority after a retry")
        farm.coordinator.kill()
        farm.start_coordinator()
        check_equal(farm.show(shot)["priority"], 90, "the priority after a restart")
        farm.submit(path)
        farm.coordinator.kill()
        farm.start_coordinator()
        check_equal(farm.show(shot)["priority"], 20, "the priority of the file, after a restart")


def words_without_sense_are_refused(programs, _folder):
    """Nothing where a value belongs, days that do not exist, numbers that are none: one line names the option."""
    for words, name in (
        (("job", "why", ""), "ID"), (("job", "tasks", ""), "ID"), (("job", "list", "--since", ""), "--since"), (("job", "list", "--owner", ""), "--owner"),
        (("worker", "why", ""), "NAME"), (("farm", "events", "--job", ""), "--job"), (("job", "set", "", "priority=3"), "ID"), (("top", "--interval", "nan"), "--interval"),
        (("top", "--interval", "inf"), "--interval"), (("job", "wait", "x", "--timeout", "nan"), "--timeout"), (("job", "list", "--since", "2026-02-30T00:00:00"), "--since"),
        (("farm", "events", "--since", "2026-04-31"), "--since"), (("job", "list", "--since", "2026-13-01"), "--since"), (("job", "delete", ""), "ID"),
        (("job", "list", "--coordinator", ""), "--coordinator"), (("check", ""), "JOB"),
    ):
        command = words if "--coordinator" in words or words[0] == "check" else (*words, "--coordinator", "tcp://127.0.0.1:1")
        refused = programs.run("baton", *command, expect=USAGE, deadline_s=20)
        check_says(refused.stderr, name, "not in range" if "inf" in words else "expected")
    check_says(programs.run("baton-worker", "--coordinator", "", expect=USAGE).stderr, "--coordinator")
    check_says(programs.run("baton-coordinator", "--work-dir", "", expect=USAGE).stderr, "--work-dir")


def locks_go_where_they_were_put(programs, folder):
    def marked(place):
        files = Path(place).glob(".baton-locked/*")
        lines = ((file.name, line) for file in files for line in file.read_text(encoding="ascii").splitlines())
        return "".join(f"{name} {line}\n" for name, line in lines if not line.startswith("#"))

    def make(name, output):
        job = make_job(folder / name, frames="1-2", name=name)
        job["output"]["directory"] = str(output)
        return write_job(folder / name / "job.json", job)

    link, other = folder / "link", folder / "other"
    for place in (folder / "old", other):
        place.mkdir(parents=True)
    link.symlink_to(folder / "old")
    with Farm(programs, folder / "farm", workers=1) as farm:
        shot = farm.submit(make("shot", link))
        farm.wait_for(shot)
        farm.baton("job", "lock", shot, "--frames", "1-2")
        check_equal(marked(folder / "old").count("\n"), 2, "locks in the folder")
        link.unlink()
        link.symlink_to(other)
        farm.baton("job", "lock", shot, "--frames", "2", "--off", expect=None)
        check_says(marked(folder / "old"), f"{shot} frame.0001.exr")
        check("frame.0002" not in marked(folder / "old"), "the lock stays in the folder that the link led to")
        farm.coordinator.kill()
        farm.start_coordinator()
        farm.baton("job", "delete", shot)
        check_equal((marked(folder / "old"), marked(other)), ("", ""), "locks once the job is deleted")

        # A folder that was renamed: what is locked in it stays.
        plain = folder / "plain"
        second = farm.submit(make("second", plain))
        farm.wait_for(second)
        farm.baton("job", "lock", second, "--frames", "2")
        moved = plain.rename(folder / "moved")
        refused = farm.baton("job", "submit", make("third", moved), "--restart", expect=BAD_INPUT)
        check_says(refused.stderr, f"frames 2 in {moved} are locked in job {second[:8]}", "--off --frames")
        farm.baton("job", "lock", second, "--frames", "2", "--off", expect=None)
        farm.baton("job", "submit", folder / "third/job.json", "--restart")
        farm.wait_for("third")


if __name__ == "__main__":
    run_tests()

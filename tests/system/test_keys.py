#!/usr/bin/env python3
"""Who may do what: keys, roles, owners and roots, as people and logs see them."""

import json
import os
import re
import shutil
import time
from pathlib import Path

from farm import BAD_INPUT, DEADLINE_S, OK, STATE_FOLDER, UNAVAILABLE, USAGE, Farm, Process, check, check_equal, check_says, run_tests, wait_until
from jobs import make_job, write_job


class KeyedFarm(Farm):
    """A farm on loopback whose coordinator and workers have keys."""

    def __init__(self, programs, folder, coordinator_options=(), worker_options=()):
        super().__init__(programs, folder, workers=None)
        self.keys = self.folder / "keys"
        self.coordinator_options, self.worker_options = coordinator_options, worker_options
        programs.run("baton", "key", "create", self.keys)

    def key(self, name):
        return str(self.keys / f"{name}.key")

    def start_coordinator(self):
        self.endpoint = f"tcp://127.0.0.1:{self._port}"
        self.coordinator = Process([self.programs.path("baton-coordinator"), "--listen", self.endpoint, "--work-dir",
                                    str(self.work_folder), "--key", self.key("server"), *self.coordinator_options],
                                   self.folder / "coordinator.log")
        wait_until(lambda: self.speak("admin", "job", "list", expect=None).returncode == OK, "the coordinator answers")

    def start_worker(self, name="worker0", key="worker"):
        self.workers.append(Process([self.programs.path("baton-worker"), "--coordinator", self.endpoint, "--threads", "1",
                                     "--name", name, "--key", self.key(key), *self.worker_options],
                                    self.folder / f"{name}-{len(self.workers)}.log"))
        return self.workers[-1]

    def let_in(self, name):
        """Waits until the coordinator has read its list again, and knows the key."""
        wait_until(lambda: self.speak(name, "job", "list", expect=None).returncode == OK, f"{name} is let in")

    def shut_out(self, name):
        """Takes the key off the list, and waits until the coordinator knows it no more."""
        server = Path(self.key("server"))
        lines = server.read_text().splitlines(keepends=True)
        server.write_text("".join(line for line in lines if line.split()[2:3] != [name]))
        wait_until(lambda: re.search(rf"shut out:.* {name}", self.coordinator.log()), f"{name} is shut out")

    def speak(self, key, *words, **options):
        """The command line with one of the keys."""
        return self.baton(*words, "--key", self.key(key), **options)

    def refused(self, key, *words, says, expect=USAGE):
        """The command line gets one line, which says so."""
        answer = self.speak(key, *words, expect=expect)
        check(says in answer.stderr and len(answer.stderr.strip().splitlines()) == 1, f"{words}: {answer.stderr}")


def small(folder, frames="1-2", **changes):
    return write_job(folder / "job.json", make_job(folder, frames=frames, image={"tileSize": 80}, **changes))


def roles_decide_who_may_do_what(programs, folder):
    path = small(folder / "job")
    with KeyedFarm(programs, folder) as farm:
        programs.run("baton", "key", "add", farm.keys, "anna")
        farm.start_coordinator()
        farm.start_worker()
        job = json.loads(farm.speak("user", "job", "submit", path, "--json").stdout)["id"]
        farm.speak("user", "job", "wait", job)
        check_equal(json.loads(farm.speak("anna", "job", "show", job, "--json").stdout)["owner"], "user", "the owner")
        farm.speak("anna", "job", "wait", job)

        # A user's key stops nothing that is not its own; a worker's key asks for nothing.
        farm.refused("user", "worker", "drain", "worker0", says="user 'user' may not drain or hold workers")
        farm.refused("anna", "job", "cancel", job, says="belongs to 'user': user 'anna' may not change it")
        farm.refused("anna", "job", "delete", job, says="user 'anna' may not change it")
        farm.refused("anna", "job", "submit", small(folder / "job", seed=8), "--restart",
                     says="user 'anna' may not change it")
        # Nor do other settings of the same picture, in place of its frames or beside them.
        frames = lambda: {file.name: file.read_bytes() for file in (folder / "job/frames").glob("*.exr")}
        before = frames()
        for changes in ({"output": {"aovs": ["depth"]}}, {"name": "mine", "output": {"pixelType": "float"}}, {"frames": "1-3"}):
            farm.refused("anna", "job", "submit", small(folder / "job", **changes), says="belongs to 'user'")
        check(frames() == before, "frames of another user are others")
        farm.refused("anna", "job", "set", job, "priority=1", says="user 'anna' may not change it")
        farm.refused("user", "farm", "stop", "--yes", says="user 'user' may not stop the farm")
        check_says(farm.speak("anna", "job", "why", job).stdout, "the job is done")
        farm.refused("worker", "job", "list", says="worker 'worker' may not list jobs")
        stranger = farm.start_worker("stranger", key="user")
        check_equal(stranger.wait(), USAGE, "exit code of a worker with a user's key")
        check("user 'user' may not work" in stranger.log(), stranger.log())
        for line in ("refused: user 'user' may not drain or hold workers", "user 'anna' may not change it",
                     "refused: worker 'worker' may not list jobs", "refused: user 'user' may not work"):
            check(line in farm.coordinator.log(), f"not logged: {line}\n{farm.coordinator.log()}")

        # The owner outlasts the coordinator; an admin may do everything.
        farm.coordinator.kill()
        farm.start_coordinator()
        farm.refused("anna", "job", "delete", job, says="belongs to 'user'")
        farm.speak("admin", "job", "delete", job)
        # Until then it is listed, too: as lost.
        wait_until(lambda: [worker["activity"] for worker in json.loads(farm.speak("admin", "worker", "list", "--json").stdout)] == ["idle"],
                   "the worker is back")
        farm.speak("admin", "worker", "drain", "worker0")
        check_equal(farm.workers[0].wait(), OK, "exit code of the drained worker")

        # Who paused it is told: its owner, or another.
        job = json.loads(farm.speak("user", "job", "submit", small(folder / "again"), "--json").stdout)["id"]
        for who, told in (("user", "paused by its owner user, since 2"), ("admin", "paused by admin, since 2")):
            farm.speak(who, "job", "pause", job)
            check_says(farm.speak("anna", "job", "why", job).stdout, told)
            farm.speak(who, "job", "resume", job)
        farm.speak("admin", "farm", "stop", "--yes")
        check_equal(farm.coordinator.wait(), OK, "exit code of the stopped coordinator")


def a_folder_is_its_owners(programs, folder):
    """Whose job is known in a folder has it; without one, a user replaces nothing there that no job is known to have written."""
    with KeyedFarm(programs, folder) as farm:
        programs.run("baton", "key", "add", farm.keys, "anna")
        farm.start_coordinator()
        farm.start_worker()
        job = json.loads(farm.speak("user", "job", "submit", small(folder / "job"), "--json").stdout)["id"]
        farm.speak("user", "job", "wait", job)
        # An administrator changes it, and it stays the user's.
        refined = json.loads(farm.speak("admin", "job", "refine", job, "--json").stdout)["id"]
        check_equal(refined, job, "the job's ID")
        farm.speak("user", "job", "wait", job)
        check_equal(json.loads(farm.speak("user", "job", "show", job, "--json").stdout)["owner"], "user", "owner")
        farm.speak("user", "job", "requeue", job, "--frames", "1", "--yes")
        farm.speak("user", "job", "wait", job)
        farm.let_in("anna")
        files = lambda: {file.name: file.read_bytes() for file in (folder / "job/frames").iterdir() if file.is_file()}
        before = files()
        check("diagnostics.csv" in before, str(list(before)))
        beside = small(folder / "beside", output={"directory": str(folder / "job/frames"), "pattern": "mine.####.exr"})
        farm.refused("anna", "job", "submit", beside, says="belongs to 'user': user 'anna' may not change it")
        # Nor a folder in it, which could stand where frames and marks belong.
        for name in ("frame.0003.exr", "deep/er"):
            inside = small(folder / "inside", output={"directory": str(folder / "job/frames" / name)})
            farm.refused("anna", "job", "submit", inside, says="lies in the output folder of another job")
        for who, place, says in (("anna", folder / "job/frames/.baton-locked/x", "are reserved"), ("admin", folder / ".baton-1/x", "are reserved"),
                                 ("anna", farm.work_folder / "logs", "lies in the coordinator's work folder")):
            farm.refused(who, "job", "submit", small(folder / "odd", output={"directory": str(place)}), says=says)
        check(files() == before, "files of another user are others")
        farm.speak("admin", "job", "delete", job)
        for words in ([], ["--restart"]):
            answer = farm.speak("anna", "job", "submit", small(folder / "job", seed=8), *words, expect=None)
            says = "no job that is known here has written it: user 'anna' may not replace it" if words else "is kept"
            check(answer.returncode != OK and says in answer.stderr, answer.stderr)
        check(files() == before, "files of another user are others")

        # An admin may; what is no table of Baton's stays in any case.
        table = folder / "job/frames/diagnostics.csv"
        table.write_text("shot,notes\n")
        job = json.loads(farm.speak("admin", "job", "submit", small(folder / "job", seed=8), "--restart", "--json").stdout)["id"]
        farm.speak("admin", "job", "wait", job)
        check_equal(table.read_text(), "shot,notes\n", "somebody's table")
        wait_until(lambda: "is not by Baton and is kept" in farm.coordinator.log(), "that is told")
        check(files()["frame.0001.exr"] != before["frame.0001.exr"], "an admin's job has replaced the frame")


def without_the_right_key_nobody_comes_in(programs, folder):
    with KeyedFarm(programs, folder) as farm:
        farm.start_coordinator()
        programs.run("baton", "key", "create", folder / "other")
        for options in (["--key", folder / "other/admin.key"], []):
            answer = farm.baton("job", "list", *options, expect=UNAVAILABLE)
            check("either side may lack a key" in answer.stderr, answer.stderr)
        # One that is in no list; and one that is taken off it.
        programs.run("baton", "key", "add", farm.keys, "late", "--role", "admin")
        farm.let_in("late")
        farm.shut_out("late")
        farm.refused("late", "job", "list", says="the coordinator does not know this key")
        late = farm.start_worker("late", key="late")
        check_equal(late.wait(), USAGE, "exit code of a worker whose key is not known")
        check("does not know this key" in late.log(), late.log())
        for line in ("refused: a connection from 127.0.0.1: its key is not known here",
                     "refused: a connection: it has no key, or not one for this coordinator"):
            wait_until(lambda line=line: line in farm.coordinator.log(), f"the log has: {line}")


def a_key_that_is_shut_out_works_no_more(programs, folder):
    """Who is connected is shut out, too; what it had in hand others do. A list that cannot be read changes nothing."""
    with KeyedFarm(programs, folder) as farm:
        farm.start_coordinator()
        programs.run("baton", "key", "add", farm.keys, "node7", "--role", "worker")
        farm.let_in("admin")
        wait_until(lambda: "let in: node7" in farm.coordinator.log(), "the list was read again")
        lost = farm.start_worker("lost", key="node7")
        job = json.loads(farm.speak("user", "job", "submit", small(folder / "job", quality={"rounds": 40}), "--json").stdout)["id"]
        wait_until(lambda: '"leases": 1' in farm.speak("viewer", "worker", "list", "--json").stdout, "it has a task")
        farm.shut_out("node7")
        check_equal(lost.wait(), USAGE, "exit code of a worker whose key is shut out")
        check_says(lost.log(), "does not know this key any more")
        server = Path(farm.key("server"))
        good = server.read_text()
        server.write_text(good + "knows nobody\n")
        wait_until(lambda: "keys stay as they were" in farm.coordinator.log(), "the fault is told")
        farm.start_worker()
        farm.speak("user", "job", "wait", job)


def a_viewer_looks_and_changes_nothing(programs, folder):
    path = small(folder / "job")
    with KeyedFarm(programs, folder, ["--user-priority", "60"]) as farm:
        farm.start_coordinator()
        job = json.loads(farm.speak("user", "job", "submit", path, "--json").stdout)["id"]
        for words in (["job", "list"], ["job", "show", job], ["job", "why", job], ["job", "tasks", job], ["worker", "list"],
                      ["farm", "events"], ["top", "--count", "1"]):
            farm.speak("viewer", *words)
        for words, what in ((["job", "submit", path], "submit jobs"), (["job", "cancel", job], "cancel jobs"),
                            (["job", "pause", job], "pause jobs"), (["job", "set", job, "priority=1"], "set priorities"),
                            (["job", "delete", job], "delete jobs"), (["farm", "stop", "--yes"], "stop the farm")):
            farm.refused("viewer", *words, says=f"viewer 'viewer' may not {what}")
        check_equal(farm.start_worker("viewer", key="viewer").wait(), USAGE, "exit code of a worker with a viewer's key")

        # A user's priority has a limit, wherever it is said; an admin's has not.
        says = "priority: user 'user' may give at most 60 (--user-priority of the coordinator), got"
        farm.refused("user", "job", "set", job, "priority=61", says=says)
        farm.refused("user", "job", "submit", small(folder / "job", priority=100), says=says)
        farm.speak("user", "job", "set", job, "priority=60")
        farm.speak("admin", "job", "set", job, "priority=100")


def other_users_of_the_machine_have_no_key(programs, folder):
    """A coordinator on a loopback address makes keys, which programs of its user find, and nobody else."""
    path = small(folder / "job")
    with Farm(programs, folder / "farm", workers=None) as farm:
        # Before there is a coordinator; and through another one with other keys in its place.
        farm.endpoint = f"tcp://127.0.0.1:{farm._port}"
        early = farm.start_worker(name="early")
        farm.start_coordinator()
        key = farm.work_folder / "own-keys/admin.key"
        check_equal(key.stat().st_mode & 0o777, 0o600, "who may read the key")
        os.environ["XDG_STATE_HOME"] = str(folder / "another user")
        try:
            for words in (["job", "list"], ["farm", "stop", "--yes"], ["job", "submit", path]):
                check_says(farm.baton(*words, expect=UNAVAILABLE).stderr, "either side may lack a key")
            farm.baton("job", "list", "--key", key)  # who is given the key is let in
            for role, words in ("viewer", ["farm", "stop", "--yes"]), ("worker", ["job", "submit", path]), ("user", ["farm", "stop", "--yes"]):
                refused = farm.baton(*words, "--key", key.with_name(f"{role}.key"), expect=USAGE).stderr
                check_says(refused, role)
        finally:
            os.environ["XDG_STATE_HOME"] = STATE_FOLDER
        farm.wait_for(farm.submit(path))
        farm.coordinator.kill()
        shutil.rmtree(farm.work_folder / "own-keys")
        farm.start_coordinator()
        shutil.rmtree(folder / "job/frames")
        farm.wait_for(farm.submit(path))
        check(early.alive(), early.log())

        # Without keys for those who say so, and back.
        for insecure in (True, False):
            farm.coordinator.kill()
            farm.insecure = insecure
            farm.start_coordinator()
            shutil.rmtree(folder / "job/frames")
            farm.wait_for(farm.submit(path))


def other_machines_need_keys(programs, folder):
    folder.mkdir(parents=True)
    for program, *words in (("baton-coordinator", "--listen", "tcp://*:*", "--work-dir", folder / "work", "--root", "/"),
                            ("baton-worker", "--coordinator", "tcp://192.0.2.1:5570"),
                            ("baton", "job", "list", "--coordinator", "tcp://192.0.2.1:5570")):
        refused = programs.run(program, *words, expect=USAGE)
        check("other machines reach it, so it needs a key" in refused.stderr + refused.stdout, refused.stderr)
    refused = programs.run("baton-coordinator", "--listen", "tcp://*:*", "--work-dir", folder / "work", "--insecure", expect=USAGE)
    check_says(refused.stderr + refused.stdout, "other machines reach it: --root FOLDER says where jobs may read and write")
    coordinator = Process([programs.path("baton-coordinator"), "--listen", "tcp://*:*", "--work-dir", str(folder / "work"),
                           "--insecure", "--root", "/"], folder / "insecure.log")
    wait_until(lambda: "listening on" in coordinator.log(), "it listens all the same")
    coordinator.kill()
    check("INSECURE" in coordinator.log(), coordinator.log())

    # A key that others may read, and one of another kind.
    programs.run("baton", "key", "create", folder / "keys")
    keys = folder / "keys"
    os.chmod(keys / "user.key", 0o644)
    for words, says in [
            (["key", "create", keys], "a key is not replaced"),
            (["job", "list", "--key", keys / "server.key"], "is the key of a coordinator"),
            (["farm", "slurm", "--work-dir", folder / "slurm", "--coordinator", "tcp://192.0.2.1:5570", "--key",
              keys / "admin.key"], "a coordinator with keys needs both"),
            (["job", "list", "--key", keys / "user.key"], "chmod 600")]:
        programs.refuses(*words, says=says, expect=USAGE)

    # A key of the environment is not that of a farm of this machine alone.
    os.environ["BATON_KEY"] = str(folder / "keys/admin.key")
    try:
        programs.render(small(folder / "job"), folder / "render")
    finally:
        del os.environ["BATON_KEY"]


def jobs_stay_within_the_roots(programs, folder):
    shows, elsewhere = folder / "shows", folder / "elsewhere"
    elsewhere.mkdir(parents=True)
    inside = small(shows / "job")
    (shows / "way out").symlink_to(elsewhere)
    outside = elsewhere / "frames"
    with KeyedFarm(programs, folder / "farm", ["--root", str(shows)], ["--root", str(shows)]) as farm:
        farm.start_coordinator()
        worker = farm.start_worker()

        def refused(says, **changes):
            path = write_job(shows / "bad.json", make_job(shows / "job", frames="1-2", **changes))
            farm.refused("user", "job", "submit", path, says=says, expect=BAD_INPUT)
            check("refused: job 'system test'" in farm.coordinator.log(), "not logged")

        refused(f"output.directory {outside} lies outside what --root allows", output={"directory": str(outside)})
        refused(f"(which is {elsewhere})", output={"directory": str(shows / "way out")})
        make_job(elsewhere)
        refused(f"file {elsewhere / 'lamp.hdr'} lies outside",
                environment={"keys": [{"frame": 1, "map": str(elsewhere / "lamp.hdr")}]})
        check(not outside.exists(), "a frame was written outside")

        # A link that is made after the job was accepted: the worker does not follow it.
        job = json.loads(farm.speak("user", "job", "submit", inside, "--json").stdout)["id"]
        farm.speak("user", "job", "wait", job)
        frames = shows / "job/frames"
        check_equal(len(list(frames.glob("*.exr"))), 2, "frames within the roots")
        farm.coordinator.kill()
        worker.kill()
        for frame in frames.iterdir():
            frame.unlink()
        frames.rmdir()
        farm.start_coordinator()
        farm.speak("user", "job", "submit", inside)
        shutil.rmtree(frames)  # the coordinator has marked a new one
        frames.symlink_to(elsewhere)
        worker = farm.start_worker("second")
        wait_until(lambda: "lies outside" in worker.log() or "is gone from it" in farm.coordinator.log(), "worker or coordinator refuses")
        check(not list(elsewhere.glob("*.exr")), "a frame was written through a link")


def two_workers_of_one_name_work_side_by_side(programs, folder):
    path = write_job(folder / "job.json", make_job(folder, image={"tileSize": 16}))
    with Farm(programs, folder / "farm") as farm:
        for number in range(2):
            command = [programs.path("baton-worker"), "--coordinator", farm.endpoint, "--threads", "1", "--name", "twin"]
            farm.workers.append(Process(command, farm.folder / f"twin{number}.log"))

        def names():
            return [worker["id"] for worker in json.loads(farm.baton("worker", "list", "--json").stdout)]
        wait_until(lambda: len(names()) == 2, "both are there")
        first, second = sorted(names())
        check(first == "twin" and second.startswith("twin#"), f"names: {first}, {second}")
        job = farm.submit(path)
        seen = set()
        end = time.monotonic() + DEADLINE_S
        while farm.show(job)["status"] == "running" and time.monotonic() < end:
            listed = json.loads(farm.baton("worker", "list", "--json").stdout)
            seen |= {worker["id"] for worker in listed if worker["leases"] > 0}
        shown = farm.show(job)
        check_equal((shown["status"], shown["attemptsLost"]), ("done", 0), "the job")
        check_equal(len(seen), 2, f"workers that had leases: {seen}")


def a_worker_of_another_build_is_sent_away(programs, folder):
    path = small(folder / "job")
    build = re.search(rb"sources (\w+)", programs.run("baton-worker", "--version").stdout.encode())[1]
    other = folder / "baton-worker"
    program = Path(programs.path("baton-worker")).read_bytes()
    check(build in program, f"{build} is not in the program")
    other.write_bytes(program.replace(build, b"f" * len(build)))
    other.chmod(0o755)
    with Farm(programs, folder / "farm", workers=1) as farm:
        job = farm.submit(path)
        stranger = Process([str(other), "--coordinator", farm.endpoint, "--name", "stranger"], folder / "stranger.log",
                           {"LD_LIBRARY_PATH": str(programs.bin.resolve())})
        check_equal(stranger.wait(), BAD_INPUT, "exit code of the other build")
        line = f"worker stranger is baton 0.1.0 (sources {'f' * len(build)}"
        check(line in stranger.log() and "use one build on all machines" in stranger.log(), stranger.log())
        check_equal(farm.coordinator.log().count(f"refused: {line}"), 1, f"lines\n{farm.coordinator.log()}")
        farm.wait_for(job)
        check_equal(farm.show(job)["attemptsLost"], 0, "attempts lost or failed")


if __name__ == "__main__":
    run_tests()

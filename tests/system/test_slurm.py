#!/usr/bin/env python3
"""Pilots in a real Slurm: as many as there is work, replaced when they are lost, and the same bytes as without all that."""

import json
import os
import re
import shutil
import time
from pathlib import Path

from farm import OK, USAGE, Farm, Process, check, check_equal, check_says, run_tests, wait_until
from jobs import make_job, write_job
from slurm_cluster import Cluster

NUM_FRAMES = 12


class SlurmFarm:
    """`baton farm slurm` without a job of its own, and a job that is submitted to it again and again."""

    def __init__(self, programs, cluster, folder, nodes, time_limit="--time=10"):
        self.programs, self.cluster, self.folder = programs, cluster, folder
        self.job_path = write_job(folder / "job" / "job.json", make_job(
            folder / "job", frames=f"1-{NUM_FRAMES}", image={"tileSize": 32},
            sampling={"numParticles": 16, "numCandidates": 64}))
        programs.render(self.job_path, folder / "alone", 1, 2)
        self.expected = programs.pixels(self.frames)
        check_equal(len(self.expected), NUM_FRAMES, "frames of one machine")
        shutil.rmtree(self.frames)
        self.job, self.num_done, self.attempts_lost = None, 0, 0
        self.command = [programs.path("baton"), "farm", "slurm", "--work-dir", str(folder / "farm"), "--nodes", nodes,
                        time_limit, "--poll", "0.5", "--host", "127.0.0.1"]
        self.process = None

    @property
    def frames(self):
        return self.folder / "job" / "frames"

    def start(self):
        """Starts the command, or starts it again; waits until it has a pilot."""
        self.process = Process(self.command, self.folder / "farm.log", self.cluster.environment)
        wait_until(lambda: (self.folder / "farm" / "endpoint").exists(), "the coordinator listens")
        wait_until(self.workers, "the first pilot works")

    def log(self):
        return self.process.log()

    def num_arrays(self):
        """How often pilots were submitted."""
        return self.log().count("pilots are submitted")

    def link(self):
        """How `baton` reaches the coordinator."""
        endpoint = (self.folder / "farm" / "endpoint").read_text(encoding="ascii").strip()
        return ["--coordinator", endpoint.replace("0.0.0.0", "127.0.0.1"), "--key", self.folder / "farm" / "keys" / "admin.key"]

    def baton(self, *words, **options):
        return self.programs.run("baton", *words, *self.link(), **options)

    def workers(self):
        """The pilots that are connected, by their ids in Slurm."""
        answer = self.baton("worker", "list", "--json", expect=None)
        if answer.returncode != OK:
            return set()
        return {worker["id"].removeprefix("slurm-").partition("#")[0] for worker in json.loads(answer.stdout)
                if worker["activity"] != "lost"}

    def keep_busy(self):
        """Submits the job when it is not there, and again when it is done, after a look at what came of it."""
        if self.job is None:
            self.job = json.loads(self.baton("job", "submit", self.job_path, "--json").stdout)["id"]
        shown = json.loads(self.baton("job", "show", self.job, "--json").stdout)
        check(shown["status"] in ("running", "done"), f"the job is {shown['status']}\n{shown['failures']}\n{self.log()}")
        if shown["status"] == "done":
            check_equal(self.programs.pixels(self.frames), self.expected, "frames by pilots and alone")
            self.attempts_lost += shown["attemptsLost"]
            self.baton("job", "delete", self.job)
            shutil.rmtree(self.frames)
            self.job, self.num_done = None, self.num_done + 1

    def fill(self):
        """Submits a job that is never done, so that there is work for every pilot however slowly this test looks."""
        path = write_job(self.folder / "filler" / "job.json", make_job(
            self.folder / "filler", name="filler", frames="1-5000", priority=0, image={"tileSize": 32}))
        return json.loads(self.baton("job", "submit", path, "--json").stdout)["id"]

    def wait_while_busy(self, condition, what):
        """Polls like wait_until, with work all the time."""
        def turn():
            self.keep_busy()
            return condition()
        return wait_until(turn, f"{what}\n{self.log()}")

    def finish_job(self):
        done = self.num_done
        self.wait_while_busy(lambda: self.num_done > done, "the job is done")

    def wait_for_new(self, count, gone, what):
        """Until so many pilots work and those of `gone` do not."""
        return self.wait_while_busy(lambda: (w := self.workers()) and len(w - gone) >= count and w, what)

    def stop(self):
        """Ctrl-C: nothing is left of it in the queue, but what a dead node has not reported."""
        self.process.terminate()
        check_equal(self.process.wait(), OK, "exit code of the command")
        wait_until(lambda: all(state == "COMPLETING" for state, _ in self.cluster.pilots().values()), "the queue is empty")


def ends_of_pilots(cluster):
    """{name: when it must have ended}, in seconds since 1970, of all workers that run."""
    lines = cluster.command_lines("baton-worker")
    return {words[words.index("--name") + 1]: int(words[words.index("--end-at") + 1]) for words in lines}


def check_that_all_have_an_end(cluster):
    """Each was told when its ten minutes are over."""
    now, ends = time.time(), ends_of_pilots(cluster)
    check(all(now < end <= now + 600 for end in ends.values()), f"ends of pilots, at {now}: {ends}")


def pilots_follow_the_work_and_are_replaced(programs, folder):
    with Cluster(folder / "slurm") as cluster:
        farm = SlurmFarm(programs, cluster, folder, "1-3", "--sbatch-arg=--time=10")
        farm.start()
        check_equal(len(farm.workers()), 1, "pilots without work")
        check("to hand in a job: baton job submit JOB --coordinator tcp://127.0.0.1:" in farm.log(), farm.log())

        # The controller forgets what it took a moment ago, which may be running; the pilot of before goes on.
        num_arrays = farm.num_arrays()
        filler = farm.fill()
        farm.wait_while_busy(lambda: farm.num_arrays() > num_arrays, "two more are submitted")
        cluster.kill_controller()
        farm.keep_busy()
        cluster.start_controller()

        def agreed():
            """The pilots, when queue, coordinator and processes agree on them. Slurm may end one that it took up wrongly
            and start it again: what it says runs now has processes after that."""
            running, workers = set(cluster.running()), farm.workers()
            alive = {name.removeprefix("slurm-") for name in ends_of_pilots(cluster)}
            return alive if alive == workers == running else set()
        first = farm.wait_while_busy(lambda: len(pilots := agreed()) == 3 and pilots, "three pilots work and are known")

        status = cluster.run(programs.path("baton"), "farm", "status", *farm.link())
        for pilot in first:
            check(re.search(rf"^pilot {pilot} +RUNNING +n\d .* slurm-{pilot}\b", status, re.MULTILINE),
                  f"pilot {pilot} is not shown beside its worker:\n{status}")
        check_that_all_have_an_end(cluster)

        # Cancelled, or back in the queue: others come, and nothing that they held counts as lost or failed.
        farm.finish_job()
        lost = farm.attempts_lost
        cancelled, requeued = sorted(first)[:2]
        cluster.run("scancel", cancelled)
        cluster.run("scontrol", "requeue", requeued)
        second = farm.wait_for_new(3, {cancelled, requeued}, "two pilots are replaced")
        farm.finish_job()
        check_equal(farm.attempts_lost, lost, "attempts lost or failed by a drain")

        # A node dies: its tasks go to the others, long before Slurm hears of it.
        pilot, node = sorted((p, n) for p, n in cluster.running().items() if p in second)[0]
        cluster.kill_node(node)
        farm.wait_while_busy(lambda: pilot not in farm.workers(), "the pilot of the dead node is missed")
        farm.finish_job()

        # Without work the least stay.
        farm.baton("job", "cancel", filler)
        wait_until(lambda: len(farm.workers()) == 1, f"one pilot is left\n{farm.log()}")
        farm.stop()


def pilots_end_with_their_time(programs, folder, nodes, time_limit, generations):
    """So many pilots, one after the other on each node; Slurm, which counts whole minutes, has to end none of them."""
    with Cluster(folder / "slurm", nodes=nodes) as cluster:
        farm = SlurmFarm(programs, cluster, folder, str(nodes), f"--time={time_limit}")
        farm.start()
        seen = farm.workers()
        while len(seen) < nodes * generations:
            seen |= farm.wait_while_busy(lambda: farm.workers() - seen, "the next pilot")
        farm.finish_job()
        check_equal(farm.attempts_lost, 0, "attempts lost or failed when a pilot's time was up")
        logs = {log.stem: log.read_text(encoding="utf-8") for log in (folder / "farm" / "slurm").glob("*.log")}
        ended = [name for name, log in logs.items() if "its time is up" in log or "it has no time for a task" in log]
        check(len(ended) >= nodes * (generations - 1), f"pilots that ended with their time: {ended}\n{logs}")
        farm.stop()


def a_pilot_ends_with_its_time(programs, folder):
    pilots_end_with_their_time(programs, folder, 1, "0:06", 2)


def a_job_of_its_own_is_rendered_and_resumed(programs, folder):
    """As people use it: one command for one job, killed on the way."""
    with Cluster(folder / "slurm", nodes=2) as cluster:
        farm = SlurmFarm(programs, cluster, folder, "2")
        farm.command.insert(3, str(farm.job_path))
        farm.process = Process(farm.command, folder / "farm.log", cluster.environment)
        wait_until(lambda: list(farm.frames.glob("*.exr")), "the first frame")
        farm.process.kill()
        again = Process(farm.command, folder / "again.log", cluster.environment)
        check_equal(again.wait(), OK, "exit code")
        check_equal(programs.pixels(farm.frames), farm.expected, "frames by pilots and alone")
        check("keys/admin.key" in again.log(), "the command says how to look at the farm")


def pilots_that_cannot_work_are_told_of(programs, folder):
    """They end as soon as they begin. The command says why, and does not fill the queue with others."""
    with Cluster(folder / "slurm", nodes=1) as cluster:
        farm = SlurmFarm(programs, cluster, folder, "1")
        farm.process = Process([*farm.command, "--worker-arg=--map=nonsense"], folder / "farm.log", cluster.environment)
        wait_until(lambda: "no pilot of the last 2 arrays has reached the coordinator" in farm.log(), "the command tells")
        check("--map nonsense" in farm.log(), f"not told why\n{farm.log()}")
        time.sleep(3)  # some looks, and far from a minute
        check_equal(farm.num_arrays(), 2, f"arrays\n{farm.log()}")
        farm.stop()


def folders_have_any_name(programs, folder):
    """Also one that sbatch would read as a pattern; the pilots' logs are there. A backslash, at which sbatch reads no pattern,
    is refused at once."""
    with Cluster(folder / "slurm", nodes=1) as cluster:
        for number, name in enumerate(("take_%j, 100%", "%A_%a", "it's", "back\\slash")):
            place = folder / str(number) / name
            path = write_job(place / "job.json", make_job(place, frames="1-2", image={"width": 16, "height": 16}))
            command = [programs.path("baton"), "farm", "slurm", str(path), "--nodes", "1", "--time=5", "--poll", "0.5",
                       "--host", "127.0.0.1"]
            farm = Process(command, folder / f"{number}.log", cluster.environment)
            try:
                expected = USAGE if "\\" in name else OK
                check_equal(farm.wait(60), expected, f"exit code in {name}\n{farm.log()}")
            finally:
                farm.kill()
            if expected == USAGE:
                check_says(farm.log(), f"{name}/frames/.baton/slurm: expected a folder without a backslash")
                continue
            check_equal(len(list((place / "frames").glob("*.exr"))), 2, f"frames in {name}")
            logs = [log for log in (folder / str(number)).rglob("*.log") if re.fullmatch(r"\d+_1\.log", log.name)]
            check(logs and all("slurm" in log.parts for log in logs), f"logs of pilots in {name}: {logs}")


def the_recipes_do_without_the_command(programs, folder):
    """docker/slurm: a farm inside one allocation, and workers for a coordinator outside."""
    recipes = Path(__file__).resolve().parents[2] / "docker" / "slurm"
    with Cluster(folder / "slurm", nodes=2) as cluster:
        farm = SlurmFarm(programs, cluster, folder, "1")
        cluster.environment["PATH"] = f"{programs.bin.resolve()}:{os.environ['PATH']}"
        cluster.run("sbatch", "--nodes=2", "--time=10", f"--output={folder}/inside.log", recipes / "farm.sbatch",
                    farm.job_path, folder / "inside")
        wait_until(lambda: not cluster.pilots(), "the allocation has ended")
        log = (folder / "inside.log").read_text(encoding="utf-8")
        check_equal(programs.pixels(farm.frames), farm.expected, f"frames of a farm in one allocation\n{log}")
        check("done" in log and log.count("joined") == 2, log)

        shutil.rmtree(farm.frames)
        with Farm(programs, folder / "outside") as outside:
            cluster.environment["BATON_COORDINATOR"] = outside.endpoint
            cluster.run("sbatch", "--array=1-2", "--time=10", f"--output={folder}/worker-%a.log", recipes / "workers.sbatch")
            wait_until(lambda: len(ends_of_pilots(cluster)) == 2, "both workers run")
            check_that_all_have_an_end(cluster)
            outside.wait_for(outside.submit(farm.job_path))
            check_equal(programs.pixels(farm.frames), farm.expected, "frames by workers of the recipe")


# ---- long ---------------------------------------------------------------------------------------------------


def what_slurm_finds_out_late(programs, folder):
    """Suspended pilots, a dead node that Slurm believes in for a while, a controller that dies after a submission."""
    with Cluster(folder / "slurm") as cluster:
        farm = SlurmFarm(programs, cluster, folder, "1-2")
        farm.start()
        first = farm.wait_for_new(2, set(), "two pilots work")
        suspended = min(first)
        cluster.run("scontrol", "suspend", suspended)
        second = farm.wait_for_new(2, {suspended}, "a suspended pilot is replaced")
        cluster.run("scontrol", "resume", suspended)
        farm.wait_while_busy(lambda: len(farm.workers()) == 2, "one of three goes home")

        victim, node = sorted((p, n) for p, n in cluster.running().items() if p in second)[0]
        cluster.kill_node(node)
        farm.wait_for_new(2, {victim}, "the pilot of a dead node is replaced")
        cluster.start_node(node)
        for _ in range(5):
            farm.finish_job()

        # Two seconds after a submission.
        gone = min(farm.workers())
        cluster.run("scancel", gone)
        num_arrays = farm.num_arrays()
        farm.wait_while_busy(lambda: farm.num_arrays() > num_arrays, "one is submitted")
        time.sleep(2)
        cluster.kill_controller()
        time.sleep(5)
        cluster.start_controller()
        farm.wait_for_new(2, {gone}, "pilots that nobody knows are replaced")
        for _ in range(5):
            farm.finish_job()
        farm.stop()


def pilots_of_half_a_minute(programs, folder):
    pilots_end_with_their_time(programs, folder, 3, "0:30", 3)


if __name__ == "__main__":
    run_tests(long_tests=[what_slurm_finds_out_late, pilots_of_half_a_minute])

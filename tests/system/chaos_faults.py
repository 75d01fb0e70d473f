"""What chaos.py strikes a farm with: programs, messages, files, disks and jobs."""

import contextlib
import json
import os
import signal
import subprocess
import threading
import time
from collections import Counter
from pathlib import Path

from chaos_frames import NOTICED_S, FrameFaults, put_folder
from chaos_jobs import FOREIGN_ISA, KINDS, Job, edits_of
from chaos_witness import STATE, in_hand
from farm import BAD_INPUT, OK, PATIENCE, check, wait_until

NUM_WORKERS = 3
SUPERSEDED_S = 8 * PATIENCE  # so long after a worker fell silent its leases are another's, if there are any
SUPERSEDER_STOPS_S = 0.5
FOREIGN_S = 3 * PATIENCE  # a worker that is not refused in this time is not
STRIKE_S = 240 * PATIENCE  # what does not strike in this time never will
RECENT_LINES = 3000  # of the record: who has which lease

# That may be lost, come twice or late.
MESSAGES = ["WorkerHello", "WorkerWelcome", "LeaseRequest", "LeaseGrant", "LeaseRevoke", "Heartbeat", "TaskDone",
            "ReportReceived", "NoWork", "JobDocument"]
FREQUENT = ["TaskDone", "LeaseGrant", "ReportReceived", "LeaseRequest"]


class Chaos(FrameFaults):
    """Strikes a farm at random."""

    def __init__(self, farm, proxy, disk, power, rng, longest_freeze_s):
        self.farm, self.proxy, self.disk, self.power, self.rng = farm, proxy, disk, power, rng
        self.longest_freeze_s = longest_freeze_s
        self.jobs, self.struck, self.thaws = [], Counter(), {}
        self.num_harmed, self.num_lost_in_cuts, self.healed_at, self.num_started = 0, 0, None, 0
        self.faults = [self.kill_worker, self.kill_coordinator, self.freeze_worker, self.freeze_coordinator,
                       self.supersede_worker, self.end_worker, self.end_coordinator, self.flip_byte, self.cut_blob,
                       self.remove_blob, self.block_blob, self.remove_frame, self.cut_frame, self.damage_frame,
                       self.block_frame, self.rename_folder, self.lose_token, self.submit_again, self.edit_settings,
                       self.edit_picture, self.drop_message, self.double_message, self.delay_message, self.start_foreign_worker,
                       self.kill_waiter]
        if disk:
            self.faults += [self.fill_disk, self.make_read_only]
        if power:
            self.faults.append(self.cut_power)
        self.deck = []

    def strike(self):
        """One fault that really struck."""
        deadline = time.monotonic() + STRIKE_S
        while True:
            if not self.deck:
                self.deck = self.rng.sample(self.faults, len(self.faults))
            fault = self.deck.pop()
            if fault():
                return
            self.deck.insert(self.rng.randrange(len(self.deck) + 1), fault)
            check(time.monotonic() < deadline,
                  f"nothing has struck for {STRIKE_S} s, not even {', '.join(card.__name__ for card in self.deck)}")
            time.sleep(0.02)
            self.tend()
            self.renew()

    def tend(self):
        """Starts again what is gone, and heals a disk that has been harmed long enough."""
        if self.healed_at and time.monotonic() >= self.healed_at:
            self.disk.heal()
            self.healed_at = None
        if not self.farm.coordinator.alive():
            if self.healed_at:
                self.disk.heal()
            self.farm.start_coordinator()
        self.farm.workers = [worker for worker in self.farm.workers if worker.alive()]
        while len(self.farm.workers) < NUM_WORKERS:
            self.num_started += 1
            self.farm.start_worker(name=f"worker-{self.num_started}")

    def renew(self):
        """New jobs when all have ended."""
        if self.open_jobs():
            return
        number = len(self.jobs) // len(KINDS) + 1
        for kind in KINDS:
            job = Job(kind, number, self.farm.folder)
            self.jobs.append(job)
            check(self.submit(job) == OK, f"{job.path.stem} is refused")

    # ---- faults: each returns whether it struck ------------------------------------------------------------

    def kill_worker(self):
        return self.end(self.some_worker(), signal.SIGKILL, "worker killed")

    def kill_coordinator(self):
        return self.end(self.farm.coordinator, signal.SIGKILL, "coordinator killed")

    def supersede_worker(self):
        """Frozen until one of its leases has gone to another worker, which is given no time to do it: what the frozen one says
        of that lease is late."""
        worker = self.some_worker()
        if not self.farm.coordinator.alive() or self.is_frozen(self.farm.coordinator) or not self.stop(worker):
            return False
        others = [other for other in self.farm.workers
                  if other is not worker and other.alive() and not self.is_frozen(other)]
        since = len(self.proxy.lines())
        tasks = in_hand(self.proxy.seen(max(0, since - RECENT_LINES)))
        deadline = time.monotonic() + SUPERSEDED_S
        is_superseded = False
        while tasks and not is_superseded and time.monotonic() < deadline:
            time.sleep(0.001)
            is_superseded = any(seen.type == "LeaseGrant" and seen.task in tasks for seen in self.proxy.seen(since))
        for other in others:
            self.signal(other.pid, signal.SIGSTOP)
        self.signal(worker.pid, signal.SIGCONT)
        time.sleep(SUPERSEDER_STOPS_S)
        for other in others:
            self.signal(other.pid, signal.SIGCONT)
        return is_superseded and self.count("worker superseded")

    def end_worker(self):
        return self.end(self.some_worker(), signal.SIGTERM, "worker terminated")

    def end_coordinator(self):
        return self.end(self.farm.coordinator, signal.SIGTERM, "coordinator terminated")

    def freeze_worker(self):
        return self.freeze(self.some_worker(), "worker frozen")

    def freeze_coordinator(self):
        return self.freeze(self.farm.coordinator, "coordinator frozen")

    def flip_byte(self):
        def damage(path, content):
            at = self.rng.randrange(len(content))
            path.write_bytes(content[:at] + bytes([content[at] ^ 0x10]) + content[at + 1:])
        return self.harm_blob(damage, "byte of a blob changed")

    def cut_blob(self):
        return self.harm_blob(lambda path, content: path.write_bytes(content[:len(content) // 2]), "blob cut")

    def remove_blob(self):
        return self.harm_blob(lambda path, _: path.unlink(), "blob removed")

    def block_blob(self):
        """As if it could not be read: what has its name is a folder."""
        return self.harm_blob(lambda path, _: put_folder(path), "blob blocked")

    def lose_token(self):
        """Without the store's token no worker can join."""
        with contextlib.suppress(OSError):
            (self.farm.work_folder / "store/token").unlink()
            self.kill_worker()
            return self.count("token lost")
        return False

    def submit_again(self):
        job = self.some_job()
        return job is not None and self.submit(job) == OK and self.count("submitted again")

    def edit_settings(self):
        """What makes no other picture, one after the other: tiles and priority, names of files, fewer and more frames, AOVs,
        more sweeps."""
        job = self.some_job()
        if job is None:
            return False
        before, edits = job.id, dict(job.edits)
        what, settings = self.rng.choice(edits_of(job, self.rng))
        job.edit(**settings)
        if self.submit(job) != OK:
            job.undo(edits)
            return False
        check(job.id == before, f"{job.path.stem} has another ID after its {what} changed")
        return self.count(f"{what} edited")

    def edit_picture(self):
        """Another picture is refused, and changes nothing."""
        job = self.some_job()
        if job is None or not any(job.frame(number).exists() for number in job.numbers()):
            return False
        job.write(seed=self.rng.randrange(100, 1000))
        answer = self.farm.baton("job", "submit", job.path, expect=None)
        job.write()
        if answer.returncode not in (OK, BAD_INPUT):
            return False  # nobody has answered
        check(answer.returncode == BAD_INPUT and "$.seed" in answer.stderr,
              f"another picture in the folder of {job.path.stem}: {answer.stdout}{answer.stderr}")
        return self.count("picture edited")

    def start_foreign_worker(self):
        """A worker that renders with another instruction set is refused while others are there; where none is, it must not
        go on with what they have begun."""
        if not self.farm.coordinator.alive() or self.is_frozen(self.farm.coordinator):
            return False
        self.num_started += 1
        worker = self.farm.start_worker(name=f"foreign-{self.num_started}", extra=["--isa", FOREIGN_ISA])
        deadline = time.monotonic() + FOREIGN_S
        while worker.alive() and time.monotonic() < deadline:
            time.sleep(0.05)
        is_refused = not worker.alive()
        if worker.alive():
            self.signal(worker.pid, signal.SIGKILL)
            wait_until(lambda: not worker.alive(), "the foreign worker has ended")
        return self.count("foreign worker refused" if is_refused else "foreign worker killed")

    def kill_waiter(self):
        """Who waits for a job has no part in it."""
        job = self.some_job()
        if job is None:
            return False
        waiter = subprocess.Popen([self.farm.programs.path("baton"), "job", "wait", job.id, "--coordinator", self.farm.endpoint],
                                  stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        time.sleep(self.rng.uniform(0.1, 1))
        waiter.kill()
        waiter.wait()
        return self.count("waiter killed")

    def drop_message(self):
        return self.harm_message("drop", "message dropped")

    def double_message(self):
        return self.harm_message("double", "message doubled")

    def delay_message(self):
        return self.harm_message("delay", "message delayed")

    def fill_disk(self):
        def fill():
            self.disk.fill()
            return True
        return self.harm_disk(fill, "waits for space", "disk filled")

    def make_read_only(self):
        folder = self.rng.choice(self.disk.folders)
        return self.harm_disk(lambda: self.disk.make_read_only(folder), "a folder that can be written",
                              f"{folder.name} read-only")

    def cut_power(self):
        """All processes end, and the disk has what was waited for."""
        processes = [self.farm.coordinator, *self.farm.workers]
        if self.healed_at or not all(process.alive() for process in processes) or not self.power.at_risk():
            return False
        for process in processes:
            self.signal(process.pid, signal.SIGKILL)
        wait_until(lambda: not any(process.alive() for process in processes), "all processes have ended")
        # Their states are all checkpoints.
        at_rest = {version for job in self.jobs if job.kind == "rest" for version in job.versions}
        promised = {output.split(":")[2]: seen.ms
                    for seen in self.proxy.seen() if seen.type == "TaskDone" and seen.task[0] in at_rest
                    for output in seen.outputs if output.startswith(f"{STATE}:")}
        num_lost = self.power.strike(self.rng, promised)
        self.num_harmed += num_lost
        self.num_lost_in_cuts += num_lost
        return self.count("power cut")

    # ---- helpers -------------------------------------------------------------------------------------------

    def some_worker(self):
        alive = [worker for worker in self.farm.workers if worker.alive()]
        return self.rng.choice(alive) if alive else None

    def show(self, job):
        """What the farm says of a job; None when it does not answer."""
        shown = self.farm.baton("job", "show", job.id, "--json", expect=None)
        return json.loads(shown.stdout) if shown.returncode == OK else None

    def open_jobs(self):
        """Those of the jobs that are not known to be done; those that wait for somebody go on. A failed one ends the test."""
        left = []
        for job in self.jobs:
            shown = None if job.is_done else self.show(job)
            if shown is not None:
                status = shown["status"]
                check(status not in ("failed", "cancelled"), f"job {job.path.stem} is {status}: {shown}")
                job.is_done = status == "done"
                if status == "paused" and job.blocked:
                    self.mend(job)
                if status == "running" and "renders as what is done was rendered" in shown.get("waits", ""):
                    # A foreign worker was alone, and has begun it.
                    self.farm.baton("job", "submit", job.path, "--restart", expect=None)
            if not job.is_done:
                left.append(job)
        return left

    def some_job(self):
        return self.rng.choice(self.jobs) if self.jobs and self.farm.coordinator.alive() else None

    def submit(self, job):
        """Exit code; the job has its new ID."""
        answer = self.farm.baton("job", "submit", job.path, "--json", expect=None)
        job.is_done = False
        if answer.returncode == OK:
            accepted = json.loads(answer.stdout)
            job.id = accepted["id"]
            if accepted["version"] not in job.versions[-1:]:
                job.versions.append(accepted["version"])
        return answer.returncode

    def is_frozen(self, process):
        return process.pid in self.thaws and self.thaws[process.pid].is_alive()

    def end(self, process, number, what):
        if process is None or not process.alive() or self.is_frozen(process):
            return False
        self.signal(process.pid, number)
        wait_until(lambda: not process.alive(), f"{what}: it has ended")
        return self.count(what)

    def stop(self, process):
        if process is None or not process.alive() or self.is_frozen(process):
            return False
        self.signal(process.pid, signal.SIGSTOP)
        wait_until(lambda: state_of(process.pid) in ("T", "Z", None), f"{process.pid} is stopped")
        return True

    def freeze(self, process, what):
        if not self.stop(process):
            return False
        seconds = self.rng.uniform(0.2, self.longest_freeze_s)
        self.thaws[process.pid] = threading.Timer(seconds, self.signal, [process.pid, signal.SIGCONT])
        self.thaws[process.pid].start()
        return self.count(what)

    def harm_message(self, harm, what):
        kinds = [self.rng.choice(MESSAGES), self.rng.choice(FREQUENT)]
        delay_s = self.rng.uniform(0.1, 5)
        return any(self.proxy.strike(harm, kind, delay_s) for kind in kinds) and self.count(what)

    def harm_blob(self, harm, what):
        blobs = list(self.farm.work_folder.rglob("*.blob"))
        if not blobs:
            return False
        path = self.rng.choice(blobs)
        with contextlib.suppress(OSError):  # removed by the farm meanwhile, or read-only now
            content = path.read_bytes()
            if not content:
                return False
            harm(path, content)
            self.num_harmed += 1
            return self.count(what)
        return False

    def harm_disk(self, harm, noticed, what):
        """Strikes when the coordinator has logged `noticed`; healed some time after."""
        if self.healed_at or not self.farm.coordinator.alive() or self.is_frozen(self.farm.coordinator):
            return False
        before = self.farm.coordinator.log().count(noticed)
        if not harm():
            return False
        deadline = time.monotonic() + NOTICED_S
        while time.monotonic() < deadline:
            if self.farm.coordinator.log().count(noticed) > before:
                self.healed_at = time.monotonic() + self.rng.uniform(0, 2)
                return self.count(what)
            if not self.farm.coordinator.alive():
                break
            time.sleep(0.02)
        self.disk.heal()
        return False

    def count(self, what):
        self.struck[what] += 1
        with open(self.farm.folder / "faults", "a", encoding="ascii") as diary:
            diary.write(f"{time.monotonic():.3f} {what}\n")
        return True

    @staticmethod
    def signal(pid, number):
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, number)


def state_of(pid):
    """The letter of a process's state, None when it is gone."""
    try:
        return Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rsplit(")", 1)[1].split()[0]
    except FileNotFoundError:
        return None

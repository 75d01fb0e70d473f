"""What a proxy between workers and coordinator saw, what the coordinator logged, and whether that may be.

The proxy (tests/support/faulty_proxy.cpp) records every message about a lease before anything happens to it, so that what
is judged here does not depend on the programs that are tried.
"""

import datetime
import re
import subprocess
import time
from collections import Counter, namedtuple

from farm import PATIENCE, Fault, check, free_port, wait_until

RENDER, ASSEMBLE, SECOND_PASS = range(3)  # kinds of tasks on the wire
STATE, FILM, IMAGE, FIRST_PASS = range(4)  # kinds of blobs

# What one fault may cost: a worker of one thread has up to three leases in hand.
LEASES_OF_WORKER = 3
SILENCE_MS = 3900  # about when a coordinator gives a worker up
LOG_MS = 100  # between a line of the log and its time in the record

Seen = namedtuple("Seen", "ms worker type task attempt outputs")  # task: job, kind, step, tile; attempt: number, epoch


class Tail:
    """A file of lines that somebody else appends to."""

    def __init__(self, path):
        self._path, self._offset = path, 0

    def read(self):
        """The whole lines that have come since the last time."""
        with open(self._path, "rb") as file:
            file.seek(self._offset)
            content = file.read()
        whole = content[:content.rfind(b"\n") + 1]
        self._offset += len(whole)
        return whole.decode("ascii").splitlines()


class Proxy:
    """A faulty proxy and its record."""

    def __init__(self, programs, coordinator, folder):
        self.endpoint = f"tcp://127.0.0.1:{free_port()}"
        self._path = folder / "record"
        self._log = open(folder / "proxy.log", "ab")
        self._process = subprocess.Popen([programs.path("faulty_proxy"), self.endpoint, coordinator, str(self._path)],
                                         stdin=subprocess.PIPE, stderr=self._log, start_new_session=True)
        self._number = 0
        self._lines, self._tail = [], Tail(self._path)
        wait_until(lambda: self._path.exists() and self.lines(), "the proxy listens")

    def close(self):
        self._process.kill()
        self._process.wait()
        self._log.close()

    def strike(self, harm, kind, delay_s):
        """Harms the next message of a type; False when none comes soon."""
        self._number += 1
        self._say(f"{self._number} {harm} {kind} {int(1000 * delay_s)}")
        try:
            wait_until(self._has_struck, f"a {kind} to {harm}", 1 * PATIENCE)
        except Fault:
            self._say(f"{self._number} none")
            time.sleep(0.05)
        return self._has_struck()

    def _say(self, line):
        self._process.stdin.write((line + "\n").encode("ascii"))
        self._process.stdin.flush()

    def _has_struck(self):
        return any(words[1:] == ["struck", str(self._number)] for words in self.lines()[-2000:])

    def lines(self):
        """The words of every line so far."""
        self._lines += [line.split() for line in self._tail.read()]
        return self._lines

    def seen(self, since=0):
        """Every message about a lease, in order, from a line on."""
        result = []
        for words in self.lines()[since:]:
            if len(words) < 9:
                continue
            ms, worker, kind, job, *numbers = words[:9]
            task = (job, *map(int, numbers[:3]))
            outputs = tuple(words[9:])
            result.append(Seen(int(ms), int(worker), kind, task, (int(numbers[3]), int(numbers[4])), outputs))
        return result

    def returns(self):
        """(time, worker) of each word that came after a long silence."""
        return [(int(words[0]), int(words[1])) for words in self.lines()
                if len(words) == 4 and words[2] == "back" and int(words[3]) >= SILENCE_MS]

    def epochs(self):
        """(time, epoch) of each welcome of a coordinator."""
        return [(int(words[0]), int(words[3])) for words in self.lines() if len(words) == 4 and words[2] == "epoch"]

    def struck_ms(self):
        """When messages were struck, and when those went on that were delayed."""
        return [int(words[0]) for words in self.lines() if len(words) == 3 and words[1] == "struck"]

    def is_quiet(self, seconds):
        """Whether nobody reports anything for so long."""
        before = sum(1 for seen in self.seen() if seen.type in ("TaskDone", "TaskFailed"))
        time.sleep(seconds)
        return sum(1 for seen in self.seen() if seen.type in ("TaskDone", "TaskFailed")) == before


def in_hand(seen):
    """Task -> attempt, of those that workers have."""
    attempts = {}
    for message in seen:
        if message.type == "LeaseGrant":
            attempts[message.task] = message.attempt
        elif message.type in ("TaskDone", "TaskFailed", "LeaseRevoke") and attempts.get(message.task) == message.attempt:
            del attempts[message.task]
    return attempts


def check_one_result_a_task(seen):
    """No task was done under two digests, whoever did it and when. Held states are not among the outputs."""
    results = {}
    for report in seen:
        if report.type != "TaskDone":
            continue
        known = results.setdefault(report.task, {})
        for output in report.outputs:
            kind, frame, _ = output.split(":")
            first = known.setdefault((kind, frame), (output, report))
            check(first[0] == output, f"two results of one task: {first[1]} and {report}")
    return len(results)


def check_nothing_revoked(seen, returns, struck_ms, epochs, ends, ids):
    """The newest attempt of a task stays with its worker until it reports, and a report whose lease is revoked is confirmed
    in the end, unless the worker was silent, the coordinator has started anew, a message was struck, or the version of the
    job has ended. A report of an older attempt must not be taken for the newest. The confirmation may be lost with a
    connection: then the worker says hello and names the lease.

    epochs: (time, epoch) of each welcome: a coordinator that has started anew welcomes a worker before it takes a lease from
    it, and may not have granted any. ends: of versions (superseded()). ids: of each version that is known; the answer to a
    submission may be lost."""
    newest, reported, named_again, unconfirmed = {}, {}, set(), {}
    for message in seen:
        lease = (message.task, message.attempt)
        if message.type == "LeaseGrant":
            newest[message.task] = message
        elif message.type in ("TaskDone", "TaskFailed"):
            reported.setdefault(lease, message)
        elif message.type == "WorkerHello" and lease in reported:
            named_again.add(lease)
        elif message.type == "ReportReceived":
            unconfirmed[lease] = None
        elif message.type == "LeaseRevoke":
            since = reported.get(lease) or newest.get(message.task)
            if since is None or since.attempt != message.attempt:
                continue
            if any(epoch > message.attempt[1] and ms <= message.ms for ms, epoch in epochs):
                continue
            ident = ids.get(message.task[0])
            if any((ident is None or ident.startswith(job)) and since.ms - LOG_MS <= ms <= message.ms + LOG_MS
                   for job, ms in ends):
                continue
            if any(since.ms <= ms <= message.ms for ms in struck_ms):
                continue
            if any(worker == since.worker and since.ms <= ms <= message.ms for ms, worker in returns):
                continue
            if lease not in reported:
                raise Fault(f"taken from the worker that has it: {message}, granted {message.ms - since.ms} ms before")
            if lease not in named_again:
                unconfirmed.setdefault(lease, message)
    for message in filter(None, unconfirmed.values()):
        raise Fault(f"its report was never confirmed: {message}")


def reopened(log):
    """times_in() of what says that finished tasks of a job are done again."""
    return times_in(log, r"\d+ finished tasks? (?:is|are) done again")


def superseded(log):
    """times_in() of what says that another version of a job, another life of the same, or another job takes the place of
    one."""
    return times_in(log, r"(?:version \d+ goes on in place of version \d+|\S+ \w+ writes its frames from now on|it begins again)")


def times_in(log, words):
    """(job, time) of each line of the coordinator's log that says this of a job: the beginning of its ID, and the record's
    milliseconds. Fault: a line without a time as the log has them."""
    offset_s, times = time.time() - time.monotonic(), []
    for line in re.findall(rf"^.*\bjob \w+: {words}.*$", log, re.MULTILINE):
        dated = re.match(r"(\S+) baton-coordinator \w+: job (\w+): ", line)
        check(dated is not None, f"not as the log's lines are: {line}")
        at = datetime.datetime.fromisoformat(dated[1])
        times.append((dated[2], 1000 * (at.timestamp() - offset_s)))
    return times


def check_superseded_revoked(seen, struck_ms, reopenings, ids):
    """A worker that says hello with a lease that has gone to another one loses it: a stale attempt is not accepted.

    Its report is confirmed all the same, so the lease must be revoked before. That the other worker kept its newer attempt
    is known where it reported it and never lost it, and no task of the job was opened again since (reopened()): its attempt
    is the last. ids: of each version of a job. Returns how many such leases there were."""
    done = {(message.task, message.attempt) for message in seen if message.type == "TaskDone"}
    revoked = {(message.task, message.attempt) for message in seen if message.type == "LeaseRevoke"}
    last = {message.task: message.attempt for message in seen if message.type == "LeaseGrant"}
    newest, stale, num_stale = {}, {}, 0
    for message in seen:
        lease = (message.task, message.attempt)
        if message.type == "LeaseGrant":
            newest[message.task] = message
        elif message.type == "WorkerHello":
            other = newest.get(message.task)
            newer = other and (other.task, other.attempt)
            is_kept = newer in done and newer not in revoked and last[message.task] == other.attempt
            if is_kept and newer != lease and other.worker != message.worker:
                stale[(message.worker, lease)] = message
                num_stale += 1
        elif message.type == "LeaseRevoke":
            stale.pop((message.worker, lease), None)
        elif message.type == "ReportReceived":
            hello = stale.pop((message.worker, lease), None)
            is_open_again = any(ids.get(message.task[0], "").startswith(job) and newest[message.task].ms <= ms <= message.ms
                                for job, ms in reopenings)
            if hello and not is_open_again and not any(hello.ms <= ms <= message.ms for ms in struck_ms):
                raise Fault(f"a stale attempt was accepted: {message}, after {hello}")
    return num_stale


def count_repeated(seen):
    """Task -> how many attempts beyond the first reported it as done."""
    attempts = {}
    for report in seen:
        if report.type == "TaskDone":
            attempts.setdefault(report.task, set()).add(report.attempt)
    return {task: len(made) - 1 for task, made in attempts.items() if len(made) > 1}


def check_repeated(seen, log, struck, num_workers, num_jobs, num_harmed):
    """Nothing is done again that no fault explains. struck: how often each kind of fault struck; num_harmed: files that
    were harmed. Returns (how many tasks were done again, how many the faults explain)."""
    opened = re.findall(r"(\d+) finished tasks? (?:is|are) done again, since (what|something)", log)
    reopenings = [int(count) for count, _ in opened]
    files = sum(what == "something" for _, what in opened)
    # A new version may need what former ones did not keep.
    num_edits = sum(count for what, count in struck.items() if what.endswith("edited"))
    check(files <= num_harmed + num_edits, f"finished tasks were opened again {files} times, but only {num_harmed} files were "
          f"harmed, and settings edited {num_edits} times")
    of_workers = sum(count for what, count in struck.items() if "worker" in what or "message" in what)
    of_all = sum(count for what, count in struck.items() if "coordinator" in what or "power" in what)
    lost = of_workers + num_workers * of_all
    check(len(opened) - files <= num_jobs * lost,
          f"held states were lost {len(opened) - files} times, but only {lost} workers were")
    leases = LEASES_OF_WORKER * lost
    explained = (sum(reopenings) + log.count("the task is done again") + len(re.findall(r"attempt \d+ on \S+ failed", log))
                 + leases)
    repeated = count_repeated(seen)
    total = sum(repeated.values())
    worst = Counter(repeated).most_common(3)
    check(total <= explained, f"{total} tasks were done again, the faults explain {explained}; most often {worst}")
    return total, explained


class Unsynced:
    """Files that a power cut would take: published, but neither they nor their file system were waited for since."""

    def __init__(self, record):
        """record: what sync_witness.cpp writes."""
        self._tail, self._lost, self._synced = Tail(record), {}, set()

    def files(self):
        """Path -> when it was published, in the record's milliseconds."""
        for line in self._tail.read():
            what, *paths = line.split()
            if what == "sync":
                self._synced.add(paths[0])
                self._lost.pop(paths[0], None)
            elif what == "syncfs":
                self._lost.clear()
            elif what == "remove":
                self._lost.pop(paths[0], None)
            elif paths[0] in self._synced:
                self._lost.pop(paths[1], None)  # replaces one that may not have been
            else:
                self._lost[paths[1]] = int(paths[3])
        return self._lost

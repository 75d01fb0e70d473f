"""Starts the real programs on loopback, with deadlines, and looks at what they made. Standard library only."""

import argparse
import atexit
import contextlib
import inspect
import json
import os
import random
import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
import traceback
from pathlib import Path

from exr_frames import read_frame, values_by
from jobs import write_job
from png_files import leave_pictures

# Generous: a busy machine must not fail a test. Builds with sanitizers ask for more patience.
PATIENCE = int(os.environ.get("BATON_PATIENCE", "1"))
DEADLINE_S = 120 * PATIENCE

# Where the programs look for keys that a coordinator has made for itself: not among those of whoever runs the tests.
STATE_FOLDER = tempfile.mkdtemp(prefix="baton-state-")
os.environ["XDG_STATE_HOME"] = STATE_FOLDER
os.environ["BATON_CONFIG_DIR"] = ""  # nor their settings
atexit.register(shutil.rmtree, STATE_FOLDER, ignore_errors=True)

OK, FAILED, USAGE, BAD_INPUT, UNAVAILABLE, IO = 0, 2, 64, 65, 69, 74


class Fault(Exception):
    """What a test expected and did not find."""


def check(condition, message):
    """Ends the test with `message` unless the condition holds."""
    if not condition:
        raise Fault(message)


def check_equal(got, expected, what):
    """Ends the test unless both are equal, or all that two tuples hold. Of unequal frames pictures are left behind."""
    if isinstance(got, tuple) and isinstance(expected, tuple) and len(got) == len(expected):
        for one, other in zip(got, expected):
            check_equal(one, other, what)
    if isinstance(got, Frames) and isinstance(expected, Frames) and got != expected:
        raise Fault(f"{what}: {got.apart_from(expected)}")
    check(got == expected, f"{what}: got {got!r}, expected {expected!r}")


def check_says(text, *parts):
    """Ends the test unless every part is in what a program said."""
    for part in parts:
        check(part in text, f"expected {part!r} in:\n{text}")


def wait_until(condition, what, deadline_s=DEADLINE_S):
    """Polls until condition() is true; returns its value."""
    end = time.monotonic() + deadline_s
    while time.monotonic() < end:
        value = condition()
        if value:
            return value
        time.sleep(0.02)
    raise Fault(f"{what}: not within {deadline_s} s")


# ---- programs -----------------------------------------------------------------------------------------------


class Frames(dict):
    """File name -> digests of the decoded channels, for every EXR of a folder."""

    def __init__(self, programs, folder):
        self.folder, self.read_values = Path(folder), values_by(programs.path("exr_values"))
        files = sorted(self.folder.glob("*.exr"))
        super().__init__(zip((file.name for file in files), programs.run("exr_digest", *files).stdout.splitlines()))

    def apart_from(self, expected):
        """What differs, in words; the pictures of the first frame that does are left beside it."""
        if self.keys() != expected.keys():
            return f"got the frames {sorted(self)}, expected {sorted(expected)}"
        names = [name for name in self if self[name] != expected[name]]
        pictures = self.folder.parent / f"{self.folder.name}-{Path(names[0]).stem}-differs"
        with contextlib.suppress(OSError):  # where the frames have been replaced since, the digests must do
            leave_pictures(pictures, *(read_frame(frames.folder / names[0], self.read_values) for frames in (self, expected)))
        return f"{names} of {self.folder} differ from {expected.folder}; pictures are in {pictures}\n" \
               f"{self[names[0]]}\n{expected[names[0]]}"


class Programs:
    """The programs of one build."""

    def __init__(self, bin_folder):
        self.bin = Path(bin_folder)

    def path(self, name):
        return str(self.bin / name)

    def run(self, name, *args, expect=OK, deadline_s=DEADLINE_S):
        """Runs to the end; returns the finished process. expect: the exit code, or None for any."""
        command = [self.path(name), *map(str, args)]
        done = subprocess.run(command, capture_output=True, text=True, timeout=deadline_s, check=False)
        if expect is not None and done.returncode != expect:
            raise Fault(f"{' '.join(command)}: exit code {done.returncode}, expected {expect}\n"
                        f"{done.stdout}{done.stderr}")
        return done

    def pixels(self, frames_folder):
        """What the frames of a folder show."""
        return Frames(self, frames_folder)

    def values(self, file, channel):
        """All pixels of one channel."""
        return [float(value) for value in self.run("exr_values", file, channel).stdout.split()]

    def states(self, store_folder):
        """The digests of all states in a store, one line a frame."""
        return self.run("state_digest", store_folder).stdout

    def render(self, job_path, work_folder, workers=1, threads=1, extra=(), **options):
        """`baton render` of a whole job in one command. extra: more arguments."""
        return self.run("baton", "render", job_path, "--workers", workers, "--threads-per-worker", threads,
                        "--work-dir", work_folder, *extra, **options)

    def render_in(self, folder, job, *layout, **options):
        """The same of a job that is a dict, whose file and work are in `folder`."""
        return self.render(write_job(folder / "job.json", job), folder / "work", *layout, **options)

    def rendered(self, folder, job, *layout, **options):
        """The same; returns what its frames show."""
        self.render_in(folder, job, *layout, **options)
        return self.pixels(folder / "frames")

    def checked(self, job_path, *args):
        """`baton check` as a dict."""
        return json.loads(self.run("baton", "check", job_path, "--json", *args).stdout)

    def refuses(self, *command, says, expect=BAD_INPUT):
        """`baton` with these words says every part on stderr; returns all of that. expect: the exit code, None for any but 0."""
        done = self.run("baton", *command, expect=expect)
        check(done.returncode != OK, f"{command}: not refused")
        check_says(done.stderr, *([says] if isinstance(says, str) else says))
        return done.stderr


class Process:
    """A program in the background, with its log in a file."""

    def __init__(self, command, log_path, environment=None):
        """environment: variables beside those of this process."""
        self.log_path = Path(log_path)
        self._log = open(self.log_path, "ab")
        self._process = subprocess.Popen(command, stdout=self._log, stderr=self._log, start_new_session=True,
                                         env={**os.environ, **(environment or {})})

    @property
    def pid(self):
        return self._process.pid

    def alive(self):
        return self._process.poll() is None

    def log(self):
        return self.log_path.read_text(encoding="utf-8", errors="replace")

    def kill(self):
        """SIGKILL to the whole process group: no chance to clean up."""
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self._process.pid, signal.SIGKILL)
        self._process.wait()
        self._log.close()

    def terminate(self):
        """SIGTERM to the program."""
        self._process.send_signal(signal.SIGTERM)

    def wait(self, deadline_s=DEADLINE_S):
        """Exit code."""
        try:
            return self._process.wait(deadline_s)
        except subprocess.TimeoutExpired:
            raise Fault(f"{self.log_path.name}: still runs after {deadline_s} s\n{self.log()}") from None


class Farm:
    """A coordinator and its workers, which a `with` block starts and kills. workers: None where nothing is started at once."""

    def __init__(self, programs, folder, workers=0, threads=1):
        self.programs, self._at_once = programs, (workers, threads)
        self.folder = Path(folder)
        self.folder.mkdir(parents=True, exist_ok=True)
        self.work_folder = self.folder / "work"
        self.endpoint = None
        self.worker_endpoint = None  # where workers connect to, if not there
        self.insecure = False        # without keys: for proxies, and for who speaks the protocol by himself
        self.environment = {}        # of coordinator and workers
        self.coordinator = None
        self.workers = []
        self._port = free_port()

    def __enter__(self):
        workers, threads = self._at_once
        if workers is not None:
            self.start_coordinator()
            for _ in range(workers):
                self.start_worker(threads)
        return self

    def __exit__(self, kind, *_):
        processes = [p for p in [self.coordinator, *self.workers] if p]
        for process in processes:
            process.kill()
        if kind:
            for process in processes:
                print(f"---- {process.log_path.name} ----\n{process.log()[-4000:]}", file=sys.stderr)

    def start_coordinator(self, extra=()):
        """Starts it, or starts it again on the same port and folder. extra: more arguments."""
        self.endpoint = f"tcp://127.0.0.1:{self._port}"
        command = [self.programs.path("baton-coordinator"), "--listen", self.endpoint,
                   "--work-dir", str(self.work_folder), *(["--insecure"] if self.insecure else []), *map(str, extra)]
        self.coordinator = Process(command, self.folder / "coordinator.log", self.environment)
        wait_until(lambda: self.baton("job", "list", expect=None, deadline_s=20).returncode == OK,
                   "the coordinator answers")

    def start_worker(self, threads=1, name=None, extra=()):
        """Starts one more worker; returns it. extra: more arguments."""
        name = name or f"worker{len(self.workers)}"
        command = [self.programs.path("baton-worker"), "--coordinator", self.worker_endpoint or self.endpoint,
                   "--threads", str(threads), "--name", name, *map(str, extra)]
        self.workers.append(Process(command, self.folder / f"{name}.log", self.environment))
        return self.workers[-1]

    def baton(self, *args, **options):
        """Runs the command line against this coordinator."""
        return self.programs.run("baton", *args, "--coordinator", self.endpoint, **options)

    def submit(self, job_path):
        """Submits a job; returns its digest."""
        answer = json.loads(self.baton("job", "submit", job_path, "--json").stdout)
        return answer["id"]

    def show(self, job):
        """`baton job show` as a dict."""
        return json.loads(self.baton("job", "show", job, "--json").stdout)

    def wait_for(self, job):
        """Waits until the job is done."""
        self.baton("job", "wait", job)


def free_port():
    """A TCP port that nobody listens on at this moment, and that the system gives to nobody by itself.

    A coordinator that was killed and comes back would otherwise find another test's in its place.
    """
    while True:
        port = random.SystemRandom().randrange(10000, 32000)
        with socket.socket() as probe, contextlib.suppress(OSError):
            probe.bind(("127.0.0.1", port))
            return port


# ---- what several scripts check -------------------------------------------------------------------------------

# No picture may depend on these: workers, threads of each, size of tiles.
LAYOUTS = {"whole image": (1, 2, 160), "small tiles": (2, 1, 16), "many workers": (3, 1, 64)}


def check_layouts(programs, folder, job_of, layouts=LAYOUTS, states=True):
    """Every layout gives the pixels of the first one, and leaves its samples. job_of: of a folder. Returns both of the
    first."""
    first = None
    for name, (workers, threads, tile_size) in layouts.items():
        place = folder / name.replace(" ", "-")
        job = job_of(place)
        job["image"]["tileSize"] = tile_size
        pixels = programs.rendered(place, job, workers, threads)
        got = pixels, programs.states(place / "work") if states else ""
        first = first or got
        check_equal(got, first, f"pixels and samples, {name}")
    check(first[0], f"no frames in {folder}")
    return first


# ---- a test script ------------------------------------------------------------------------------------------


def tests_of(module):
    """Its functions of (programs, folder), or of (_programs, _folder), in order; those that begin with _ are for others."""
    functions = [value for name, value in vars(module).items() if inspect.isfunction(value) and not name.startswith("_")]
    return [function for function in functions if function.__module__ == module.__name__
            and [name.strip("_") for name in inspect.signature(function).parameters] == ["programs", "folder"]]


def run_tests(long_tests=()):
    """Main of a test script: --bin and --source, then each of its tests with its own folder. Exits 1 when one fails.
    long_tests: run with --long alone."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--bin", required=True, help="folder of the programs")
    parser.add_argument("--source", required=True, help="root of the project")
    parser.add_argument("--only", default="", help="regular expression: run only the tests whose name matches")
    parser.add_argument("--long", action="store_true", help="also the tests that take minutes")
    parser.add_argument("--keep", action="store_true", help="leave the files of the tests")
    options = parser.parse_args()

    programs = Programs(options.bin)
    root = Path(tempfile.mkdtemp(prefix="baton-system-"))
    failures = 0
    for test in tests_of(sys.modules["__main__"]):
        if not re.search(options.only, test.__name__) or (test in long_tests and not options.long):
            continue
        start = time.monotonic()
        try:
            test(programs, root / test.__name__)
            verdict = "ok"
        except Exception as fault:  # so that the other tests run
            failures += 1
            expected = isinstance(fault, (Fault, subprocess.TimeoutExpired))
            verdict = f"FAILED: {fault if expected else traceback.format_exc()}"
        print(f"{test.__name__}: {verdict} ({time.monotonic() - start:.1f} s)", flush=True)
    if failures == 0 and not options.keep:
        shutil.rmtree(root, ignore_errors=True)
    else:
        print(f"files are in {root}")
    sys.exit(1 if failures else 0)

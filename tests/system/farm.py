"""Starts the real programs on loopback, with deadlines, and looks at what they made. Standard library only."""

import argparse
import contextlib
import json
import math
import os
import random
import re
import shutil
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import time
from pathlib import Path

# Generous: a busy machine must not fail a test. Builds with sanitizers ask for more patience.
PATIENCE = int(os.environ.get("BATON_PATIENCE", "1"))
DEADLINE_S = 120 * PATIENCE

OK, FAILED, USAGE, BAD_INPUT, UNAVAILABLE, IO = 0, 2, 64, 65, 69, 74


class Fault(Exception):
    """What a test expected and did not find."""


def check(condition, message):
    """Ends the test with `message` unless the condition holds."""
    if not condition:
        raise Fault(message)


def check_equal(got, expected, what):
    """Ends the test unless both are equal."""
    check(got == expected, f"{what}: got {got!r}, expected {expected!r}")


def wait_until(condition, what, deadline_s=DEADLINE_S):
    """Polls until condition() is true; returns its value."""
    end = time.monotonic() + deadline_s
    while time.monotonic() < end:
        value = condition()
        if value:
            return value
        time.sleep(0.02)
    raise Fault(f"{what}: not within {deadline_s} s")


# ---- inputs -------------------------------------------------------------------------------------------------


def write_sphere(path, rings=8, segments=12):
    """A unit sphere of triangles as OFF."""
    vertices = [(0.0, 1.0, 0.0)]
    for ring in range(1, rings):
        theta = math.pi * ring / rings
        for segment in range(segments):
            phi = 2 * math.pi * segment / segments
            vertices.append((math.sin(theta) * math.cos(phi), math.cos(theta), math.sin(theta) * math.sin(phi)))
    vertices.append((0.0, -1.0, 0.0))

    def index(ring, segment):
        return 1 + (ring - 1) * segments + segment % segments

    triangles = []
    for segment in range(segments):
        triangles.append((0, index(1, segment + 1), index(1, segment)))
        for ring in range(1, rings - 1):
            a, b = index(ring, segment), index(ring, segment + 1)
            c, d = index(ring + 1, segment), index(ring + 1, segment + 1)
            triangles += [(a, b, c), (b, d, c)]
        triangles.append((len(vertices) - 1, index(rings - 1, segment), index(rings - 1, segment + 1)))
    lines = ["OFF", f"{len(vertices)} {len(triangles)} 0"]
    lines += [" ".join(f"{x:.6f}" for x in vertex) for vertex in vertices]
    lines += ["3 " + " ".join(str(i) for i in triangle) for triangle in triangles]
    path.write_text("\n".join(lines) + "\n", encoding="ascii")


def lamp(x, y, width, height):
    """Colour of a texel: a gradient sky, a dark floor and one small bright lamp."""
    if abs(x - width // 4) <= 1 and abs(y - height // 4) <= 1:
        return (40.0, 36.0, 30.0)
    sky = 0.2 + 0.8 * (height - y) / height if y < height / 2 else 0.05
    return (sky * 0.7, sky * 0.8, sky)


def write_map(path, width=32, height=16, colour=lamp):
    """A lat-long Radiance HDR map of colour(x, y, width, height), no texel of it black."""
    rows = bytearray()
    for y in range(height):
        for x in range(width):
            rgb = colour(x, y, width, height)
            mantissa, exponent = math.frexp(max(rgb))
            scale = mantissa * 256.0 / max(rgb)
            rows += struct.pack("4B", *(int(c * scale) for c in rgb), exponent + 128)
    header = f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n"
    path.write_bytes(header.encode("ascii") + bytes(rows))


def make_job(folder, **changes):
    """A small job as a dict; its assets are written to `folder`. changes: top-level keys, merged one level deep."""
    folder.mkdir(parents=True, exist_ok=True)
    write_sphere(folder / "sphere.off")
    write_map(folder / "lamp.hdr")
    job = {
        "specificationVersion": 1,
        "name": "system test",
        "frames": "1-6",
        "seed": 7,
        "image": {"width": 160, "height": 96, "sites": 1, "tileSize": 64},
        "camera": {"position": [0, 1.2, 5], "lookAt": [0, 0.6, 0], "verticalFovDeg": 35},
        "scene": {
            "materials": {
                "chalk": {"type": "diffuse", "color": [0.7, 0.7, 0.65]},
                "lacquer": {"type": "phong", "color": [0.6, 0.1, 0.1], "kd": 0.5, "ks": 0.4, "exponent": 50},
            },
            "meshes": {"sphere": str(folder / "sphere.off")},
            "objects": [
                {"mesh": "sphere", "material": "lacquer", "translate": [-0.9, 0.8, 0], "scale": [0.8, 0.8, 0.8]},
                {"mesh": "sphere", "material": "chalk", "translate": [0.9, 0.6, 0.3], "scale": [0.6, 0.6, 0.6]},
            ],
            "ground": {"material": "chalk", "height": 0, "size": 20},
        },
        "environment": {
            "keys": [{"frame": 1, "map": str(folder / "lamp.hdr")}],
            "rotation": {"axis": [0, 1, 0], "startDeg": 0, "degPerFrame": 1.5},
        },
        "sampling": {"method": "sequential", "numParticles": 16, "numCandidates": 64, "numDistributions": 3},
        "output": {
            "directory": str(folder / "frames"),
            "aovs": ["lns", "visibility", "ess", "acceptance", "source", "normal", "depth"],
        },
        "state": {"carry": True, "checkpointEvery": 2, "keep": "all"},
    }
    for key, value in changes.items():
        if isinstance(value, dict):
            job[key] = {**job.get(key, {}), **value}
        else:
            job[key] = value
    return job


def write_job(path, job):
    """Writes the job file; returns its path."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(job, indent=2), encoding="utf-8")
    return path


# ---- programs -----------------------------------------------------------------------------------------------


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
        """File name -> digests of the decoded channels, for every EXR of the folder."""
        files = sorted(Path(frames_folder).glob("*.exr"))
        lines = self.run("exr_digest", *files).stdout.splitlines()
        return {file.name: line for file, line in zip(files, lines)}

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
    """A coordinator and its workers; everything is killed on leaving the `with` block."""

    def __init__(self, programs, folder):
        self.programs = programs
        self.folder = Path(folder)
        self.folder.mkdir(parents=True, exist_ok=True)
        self.work_folder = self.folder / "work"
        self.endpoint = None
        self.worker_endpoint = None  # where workers connect to, if not there
        self.environment = {}        # of coordinator and workers
        self.coordinator = None
        self.workers = []
        self._port = free_port()

    def __enter__(self):
        return self

    def __exit__(self, kind, *_):
        processes = [p for p in [self.coordinator, *self.workers] if p]
        for process in processes:
            process.kill()
        if kind:
            for process in processes:
                print(f"---- {process.log_path.name} ----\n{process.log()[-4000:]}", file=sys.stderr)

    def start_coordinator(self):
        """Starts it, or starts it again on the same port and folder."""
        self.endpoint = f"tcp://127.0.0.1:{self._port}"
        command = [self.programs.path("baton-coordinator"), "--listen", self.endpoint,
                   "--work-dir", str(self.work_folder)]
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


# ---- a test script ------------------------------------------------------------------------------------------


def run_tests(tests, long_tests=()):
    """Main of a test script: --bin and --source, then each test with its own folder. Exits 1 when one fails.
    long_tests: run with --long, too."""
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
    for test in [*tests, *(long_tests if options.long else [])]:
        if not re.search(options.only, test.__name__):
            continue
        start = time.monotonic()
        try:
            test(programs, root / test.__name__)
            verdict = "ok"
        except (Fault, subprocess.TimeoutExpired) as fault:
            failures += 1
            verdict = f"FAILED: {fault}"
        print(f"{test.__name__}: {verdict} ({time.monotonic() - start:.1f} s)", flush=True)
    if failures == 0 and not options.keep:
        shutil.rmtree(root, ignore_errors=True)
    else:
        print(f"files are in {root}")
    sys.exit(1 if failures else 0)

"""Renders one random job twice, split in two ways, and judges what came of it. Standard library only."""

import contextlib
import copy
import json
import math
import os
import re
import shutil
import signal
import subprocess
import threading
from pathlib import Path

from exr_frames import read_frame, values_by
from farm import BAD_INPUT, DEADLINE_S, IO, OK, PATIENCE
from random_job_files import raw_state_bytes, write_file
from random_job_means import judge_means

# A job this small that takes longer hangs; one of `auto` renders pilots first.
JOB_DEADLINE_S = min(DEADLINE_S, 60 * PATIENCE)
AUTO_DEADLINE_S = 10 * JOB_DEADLINE_S
# Exit code of a `baton render` that was asked to stop.
CANCELLED = 3
BLOCK = 4  # side of the blocks of pixels that have a memory in common
# What a worker says that has too little memory for a job, rather than for what it would keep.
NO_ROOM = "does not fit into memory"
# How each fault of a job or of its files begins.
FAULT_LINE = re.compile(r"\S.*: .")


class Wrong(Exception):
    """What is wrong with a job. kind: a word that stays the same while the job is made smaller."""

    def __init__(self, kind, detail):
        super().__init__(f"{kind}: {detail}")
        self.kind = kind


class Refused(Exception):
    """`baton check` did not take the job, with good messages."""


def require(condition, kind, detail):
    """Raises Wrong unless the condition holds."""
    if not condition:
        raise Wrong(kind, detail)


class Judge:
    """Judges cases. shared: a folder for the large files of all of them."""

    def __init__(self, programs, shared):
        self.programs = programs
        self.shared = Path(shared)
        self.values = values_by(programs.path("exr_values"))
        self.num_scarce = 0  # renderings that got by with little memory, about

    def judge(self, case, folder):
        """Renders and compares; the folder must not exist. Raises Wrong or Refused."""
        folder = Path(folder)
        folder.mkdir(parents=True)
        for name, recipe in case["files"].items():
            write_file(folder / name, recipe, self.shared)
        predicted = self.checked(case, folder)
        first = self.rendered(case, case["first"], folder, "first", predicted)
        second = self.rendered(case, case["second"], folder, "second", predicted)
        compare(first, second)
        if "means" in case:
            found = judge_means(case, lambda of, seed: self.rendered_once(of, seed, folder))
            require(found is None, "biased", found)

    # ---- programs -------------------------------------------------------------------------------------------

    def run(self, command, interruption=None, deadline_s=JOB_DEADLINE_S):
        """(exit code, standard output, standard error); somebody is killed on the way if an interruption says so."""
        process = subprocess.Popen([self.programs.path(command[0]), *map(str, command[1:])], stdout=subprocess.PIPE,
                                   stderr=subprocess.PIPE, start_new_session=True)
        timer = None
        if interruption:
            timer = threading.Timer(interruption["after"], interrupt, (process, interruption["who"]))
            timer.start()
        try:
            output, errors = process.communicate(timeout=deadline_s)
        except subprocess.TimeoutExpired:
            process.kill()
            output, errors = process.communicate()
            errors += b"\n" + self.logs(command)
            raise Wrong("no end", f"{command[1]}: runs after {deadline_s} s\n{text_of(errors)[-3000:]}") from None
        finally:
            if timer:
                timer.cancel()
                timer.join()
        return process.returncode, text_of(output), text_of(errors)

    @staticmethod
    def logs(command):
        """The last of what coordinator and workers wrote, where the command has a work folder."""
        if "--work-dir" not in command:
            return b""
        folder = Path(command[command.index("--work-dir") + 1])
        return b"\n".join(log.read_bytes()[-1500:] for log in sorted(folder.glob("*.log")))

    def checked(self, case, folder):
        """What `baton check` predicts of the job."""
        code, output, errors = self.run(["baton", "check", write_job(case, case["first"], folder, "first"), "--json"])
        if code == BAD_INPUT:
            lines = errors.strip().split("\n")
            bad = [line for line in lines if not FAULT_LINE.match(line)]
            require(not bad and lines != [""] and len(lines) < 200, "bad message", errors[:1000])
            raise Refused(errors.strip())
        require(code == OK, "check failed", f"exit code {code}\n{errors[-2000:]}")
        return json.loads(output)

    def rendered(self, case, split, folder, name, predicted):
        """Renders the job to its end, through the interruption if there is one; returns the decoded frames."""
        work = folder / f"{name}-work"
        interruption = split.get("interruption")
        command = ["baton", "render", write_job(case, split, folder, name), "--workers", split["workers"],
                   "--threads-per-worker", split["threads"], "--work-dir", work, "--json"]
        deadline_s = AUTO_DEADLINE_S if is_auto(case["job"]) else JOB_DEADLINE_S
        scarce = ["--memory", split["memory"]] if "memory" in split else []

        def render(interruption=None):
            """With little memory, unless it is refused as too little."""
            result = self.run(command + scarce, interruption, deadline_s)
            if not scarce or NO_ROOM not in result[2]:
                return result
            scarce.clear()
            remove(work)
            return self.run([*command, "--restart"], interruption, deadline_s)

        code, output, errors = render(interruption)
        if interruption:
            # A coordinator that dies before it listens has not started.
            none = "did not start" in errors
            allowed = {"render": (OK, CANCELLED, -signal.SIGINT), "all": (OK, -signal.SIGKILL),
                       "coordinator": (OK, IO) if none else (OK,)}.get(interruption["who"], (OK,))
            require(code in allowed, "interrupted render failed", f"exit code {code}\n{errors[-3000:]}")
            if interruption["who"] in ("render", "all") or none:
                # Once more, at times with other tiles: that is another job, which must not mind what lies there.
                tile_size = interruption.get("tileSize") or split["tileSize"]
                split = {**split, "tileSize": tile_size}
                write_job(case, split, folder, name)
                code, output, errors = render()  # it may be refused now only, the interruption having come before
        self.num_scarce += 1 if scarce else 0
        log = text_of(self.logs(command))
        require(code == OK, "render failed", f"exit code {code}\n{errors[-2000:]}\n{log}")
        summary = json.loads(output)
        require(summary["status"] == "done" and summary["framesDone"] == summary["framesTotal"] == predicted["frames"],
                "not done", f"{summary['status']}, {summary['framesDone']} of {predicted['frames']} frames")
        if not interruption:
            require(summary["attemptsLost"] == 0 and "ended (" not in errors, "lost attempts",
                    f"{summary['attemptsLost']} attempts lost\n{errors[-1500:]}\n{log}")
            if name == "first" and not is_auto(case["job"]):
                compare_prediction(predicted, summary, case["job"])
        frames = {path.name: read_frame(path, self.values) for path in sorted((folder / name).glob("*.exr"))}
        require(len(frames) == predicted["frames"], "frames", f"{len(frames)} files, expected {predicted['frames']}")
        judge_frames(frames, case["job"], predicted)
        if name == "first" and not is_auto(case["job"]):
            side = -(-int(json.loads(command[2].read_text(encoding="utf-8"))["image"]["tileSize"]) // BLOCK) * BLOCK
            judge_states(work, [min(side, length) for length in rendered_size(case["job"]["image"])], predicted)
        return frames


    def rendered_once(self, case, seed, folder):
        """The folder of the frames of the job with that seed."""
        of_seed = {**case, "job": {**case["job"], "seed": seed}}
        name = f"seed{seed}-{case['job']['sampling']['method']}"
        path = write_job(of_seed, case["first"], folder, name)
        code, _, errors = self.run(["baton", "render", path, "--workers", 1, "--threads-per-worker", 1])
        require(code == OK, "render failed", f"exit code {code}\n{errors[-2000:]}")
        return folder / name


def is_auto(job):
    """Whether a pilot chooses the method, of which `baton check` cannot tell what it will take."""
    return job.get("sampling", {}).get("method") == "auto"


def text_of(output):
    return output.decode("utf-8", errors="replace")


def write_job(case, split, folder, name):
    """The job, split so; returns its path."""
    job = copy.deepcopy(case["job"])
    changes = [("image", "tileSize", split["tileSize"]), ("state", "checkpointEvery", split["checkpointEvery"]),
               ("output", "directory", name), ("output", "compression", split.get("compression")),
               ("state", "keep", "all" if name == "first" else None)]
    for section, key, value in changes:
        # What was made wrong on purpose stays so.
        place = job.setdefault(section, {})
        if value is not None and isinstance(place, dict) and not ("spoiled" in case and key in place):
            place[key] = value
    path = folder / f"{name}.json"
    path.write_text(json.dumps(job, indent=1), encoding="utf-8")
    return path


# ---- interruptions ------------------------------------------------------------------------------------------


def interrupt(process, who):
    """SIGINT for `baton render` itself, SIGKILL for a program that it has started, or for all at once."""
    with contextlib.suppress(ProcessLookupError, OSError):
        if who == "render":
            process.send_signal(signal.SIGINT)
        elif who == "all":
            process.kill()  # the others die with it
        else:
            for child in children_of(process.pid):
                command = Path(f"/proc/{child}/cmdline").read_bytes().split(b"\0")[0]
                if command.endswith(b"baton-" + who.encode()):
                    os.kill(child, signal.SIGKILL)
                    return


def children_of(pid):
    """Process ids; which thread started them does not count."""
    children = []
    for task in Path(f"/proc/{pid}/task").glob("*/children"):
        children += map(int, task.read_text(encoding="ascii").split())
    return children


# ---- judgements ---------------------------------------------------------------------------------------------


def judge_frames(frames, job, predicted):
    """All numbers are finite, and the frames have the size that was predicted."""
    for name, frame in frames.items():
        for channel, values in frame.channels.items():
            # A sum of finite floats is finite in double precision.
            if not math.isfinite(math.fsum(values) if all(map(math.isfinite, values)) else math.nan):
                places = [i for i, value in enumerate(values) if not math.isfinite(value)]
                raise Wrong("not finite", f"{name}: {channel}: {len(places)} of {len(values)}, first at "
                            f"({places[0] % frame.width}, {places[0] // frame.width}): {values[places[0]]}")
        # Colours past a half float make R, G and B of a frame float32.
        is_bright = any(abs(value) > 65504 for c in "RGB" for value in frame.channels.get(c, ()))
        is_half = job.get("output", {}).get("pixelType", "half") == "half"
        wider = 6 * frame.width * frame.height if is_bright and is_half else 0
        require(frame.sample_bytes == predicted["frameBytes"] + wider, "frame bytes",
                f"{name}: {frame.sample_bytes} bytes of samples, predicted {predicted['frameBytes']} + {wider}")
        windows = windows_of(job.get("image", {}))
        require((frame.display, frame.window) == windows, "size",
                f"{name}: shows {frame.display} of {frame.window}, expected {windows}")


def windows_of(image):
    """Display and data window of the frames, half-open: the whole picture, and its region with overscan around it."""
    scale, around = image.get("scale", 1), image.get("overscan", 0)
    left, top, right, bottom = (math.ceil(side * scale) for side in (around if isinstance(around, list) else 4 * [around]))
    x0, y0, x1, y1 = shown_part(image)
    return (0, 0, *whole_size(image)), (x0 - left, y0 - top, x1 + right, y1 + bottom)


def rendered_size(image):
    """Width and height of the data window."""
    x0, y0, x1, y1 = windows_of(image)[1]
    return x1 - x0, y1 - y0


def whole_size(image):
    """Width and height of the picture. Halves are rounded up, as in C."""
    return [max(1, math.floor(image.get(key, side) * image.get("scale", 1) + 0.5)) for key, side in (("width", 640), ("height", 360))]


def shown_part(image):
    """What is shown, half-open: the region, each edge scaled and moved out to a whole pixel."""
    scale, whole = image.get("scale", 1), whole_size(image)
    if "region" not in image:
        return (0, 0, *whole)
    x, y, width, height = image["region"]
    return (*(min(math.floor(low * scale), limit - 1) for low, limit in zip((x, y), whole)),
            *(min(math.ceil(high * scale), limit) for high, limit in zip((x + width, y + height), whole)))


def compare(first, second):
    """Both renderings show the same, bit by bit."""
    require(first.keys() == second.keys(), "frames", f"{sorted(first)} and {sorted(second)}")
    for name in first:
        a, b = first[name], second[name]
        require(a.channels.keys() == b.channels.keys(), "channels", name)
        differ = {channel: [i for i, (x, y) in enumerate(zip(a.channels[channel], b.channels[channel])) if x != y]
                  for channel in a.channels if a.channels[channel].tobytes() != b.channels[channel].tobytes()}
        if differ:
            channel, places = next(iter(differ.items()))
            place = places[0] if places else 0  # none where signs of zero differ
            x, y = a.channels[channel][place], b.channels[channel][place]
            raise Wrong("split shows", f"{name}: {', '.join(differ)}: {len(places)} of {a.width * a.height} pixels of "
                        f"{channel}, first at ({place % a.width}, {place // a.width}): {x!r} and {y!r}")


def compare_prediction(predicted, summary, job):
    """Tasks and rays are as `baton check` said."""
    stats = summary["stats"]
    tasks = predicted["renderTasks"] + predicted["secondPassTasks"] + predicted["assembleTasks"]
    require(summary["tasksTotal"] == tasks, "predicted tasks", f"{summary['tasksTotal']}, predicted {tasks}")
    pixels = math.prod(rendered_size(job.get("image", {})))
    second_pass = predicted["secondPassTasks"] > 0
    sweeps = job.get("quality", {}).get("sweeps", 1)
    steps = predicted["frames"] * sweeps
    require(stats["pixels"] == pixels * steps, "predicted pixels", f"{stats['pixels']}, predicted {pixels * steps}")

    # A run traces its surfaces once where pixels take history from themselves alone, else in each frame; old surfaces
    # and those of the second pass, whose tiles overlap, are traced again.
    sampling = job.get("sampling", {})
    asks = sampling.get("numNeighbors", 0) if sampling.get("method") == "restir" else 0
    shares = asks > 0 or predicted["motionMaxPx"] > 0
    of_step = pixels * predicted["primaryRaysPerPixel"] // sweeps
    least = of_step * (steps if shares else predicted["runs"])
    most = least * (2 + asks if shares else 1) + (9 * of_step * steps if second_pass else 0)
    image = job.get("image", {})
    sites = image.get("sites", 1)
    if image.get("maxSites", sites) > sites:  # of a round as few as `sites`
        least = least * sites // (image["maxSites"] + 4)
    if "adaptiveThreshold" in job.get("quality", {}):  # three rounds at least
        least = least * 3 // job["quality"]["rounds"]
    require(least <= stats["raysPrimary"] <= most, "predicted primary rays",
            f"{stats['raysPrimary']}, predicted {least} to {most}")
    unseen = predicted.get("prerollRounds", 0) / predicted.get("rounds", 1)
    shadow = pixels * (predicted["frames"] + unseen) * predicted["shadowRaysPerPixel"]
    require(stats["raysShadow"] <= shadow, "predicted shadow rays",
            f"{stats['raysShadow']}, predicted at most {shadow}")


def judge_states(work, sides, predicted):
    """What states hold is at most what was predicted. sides: of the largest tile."""
    states = [size for size in map(raw_state_bytes, work.rglob("*.blob")) if size is not None]
    tile_pixels = sides[0] * sides[1]
    blocks = ((sides[0] + 2 * BLOCK - 2) // BLOCK) * ((sides[1] + 2 * BLOCK - 2) // BLOCK)
    most = tile_pixels * predicted["stateBytesPerPixel"] + blocks * predicted["stateBytesPerBlock"] + 4
    require(not states or max(states) <= most, "predicted state bytes",
            f"{max(states, default=0)} bytes in a tile of at most {tile_pixels} pixels, predicted {most}")


def remove(folder):
    shutil.rmtree(folder, ignore_errors=True)


"""The jobs of chaos.py and edits.py, what may be changed of them, and what their frames must show in the end."""

import functools
import json

from farm import Fault
from jobs import camera_keys, make_job, merged, write_job

FOREIGN_ISA = "sse4"  # of workers that render other last bits than those of this machine

KINDS = {
    "rest": {"frames": "1-8", "sampling": {"method": "sequential", "numCandidates": 256, "numDistributions": 12}},
    "motion": {"frames": "1-6", "light": {"bounces": 2}, "sampling": {"method": "pool", "numParticles": 32, "numCandidates": 512},
               "camera": camera_keys((1, [0, 1.2, 5], [0, 0.6, 0]), (6, [0.5, 1.3, 4.6], [0, 0.6, 0]))},
    "second-pass": {"frames": "1-5", "sampling": {"method": "bidirectional", "numCandidates": 512},
                    "visibility": {"correlated": True}},
}


@functools.cache
def plain_job(folder):
    """What the kinds of jobs have in common. Its assets are written once: a worker might be reading them."""
    return make_job(folder)


class Job:
    """One submission of a kind of job."""

    def __init__(self, kind, number, folder):
        self.kind, self.frames, self.number = kind, folder / "frames" / f"{kind}{number}", number
        self.last = int(KINDS[kind]["frames"].split("-")[1])  # number of a frame
        self.path, self.edits = folder / f"{kind}{number}.json", {}
        self.id, self.versions, self.is_done = None, [], False
        self.written, self.blocked = [], []  # frames, and those in whose place there are folders
        self._plain = plain_job(folder / "assets")
        self.write()

    def write(self, **changes):
        """Writes the job file. changes: of settings, which stay, or of the picture."""
        changes = {**KINDS[self.kind], "name": f"{self.kind} {self.number}",
                   "image": {"tileSize": 16}, "state": {"keep": "last"}, **self.edits, **changes}
        changes["output"] = {**self.edits.get("output", {}), "directory": str(self.frames)}
        return write_job(self.path, merged(self._plain, changes))

    def edit(self, **settings):
        for key, value in settings.items():
            self.edits[key] = {**self.edits.get(key, {}), **value} if isinstance(value, dict) else value
        return self.write()

    def undo(self, edits):
        self.edits = edits
        self.write()

    def frame(self, number):
        pattern = self.edits.get("output", {}).get("pattern", "frame.####.exr")
        return self.frames / pattern.replace("####", f"{number:04d}")

    def numbers(self):
        """Of its frames."""
        return range(1, int(self.edits.get("frames", KINDS[self.kind]["frames"]).split("-")[1]) + 1)

    def picture(self):
        """The edits that decide what its frames show and have, as a key."""
        output = {key: value for key, value in self.edits.get("output", {}).items() if key == "aovs"}
        kept = {"output": output, **{key: self.edits[key] for key in ("frames", "quality") if key in self.edits}}
        return json.dumps(kept, sort_keys=True)


def edits_of(job, rng):
    """(what, keys of the job) of edits that the kind of job allows now."""
    edits = [("tiles", {"image": {"tileSize": rng.choice([16, 32, 48])}, "priority": rng.randrange(100)}),
             ("pattern", {"output": {"pattern": rng.choice(["frame.####.exr", "shot_####.exr"])}}),
             ("AOVs", {"output": {"aovs": rng.choice([["depth"], ["normal", "depth"]])}})]
    sweeps = job.edits.get("quality", {}).get("sweeps", 1)
    if sweeps == 1:  # a later sweep begins with what the last frame hands on: other frames are another picture
        edits += [("frames", {"frames": f"1-{number}"}) for number in (rng.randrange(2, job.last), job.last)]
    if job.kind == "motion" and sweeps < 3:
        edits.append(("sweeps", {"quality": {"sweeps": sweeps + 1, "refinable": True}}))
    return edits


class Undisturbed:
    """What the frames of a job show when nothing happens to it. isas: instruction sets of the workers that there may be."""

    def __init__(self, programs, folder, isas=("auto",)):
        self._programs, self._folder, self._isas, self._known = programs, folder, isas, {}

    def of(self, job, isa):
        """File name of each frame of the job -> pixels, rendered with an instruction set."""
        key = (job.kind, job.picture(), isa)
        if key not in self._known:
            number = len(self._known)
            plain = Job(job.kind, f"-plain-{number}", self._folder)
            plain.edit(**job.edits)
            self._programs.render(plain.path, self._folder / f"work-plain-{number}", threads=2, extra=["--isa", isa])
            pixels = self._programs.pixels(plain.frames)
            self._known[key] = [pixels.get(plain.frame(frame).name) for frame in plain.numbers()]
        return {job.frame(frame).name: pixels for frame, pixels in zip(job.numbers(), self._known[key])}

    def check(self, job):
        """All frames of the job are there, and those of one instruction set."""
        got = self._programs.pixels(job.frames)
        faults = []
        for isa in self._isas:
            wrong = [f"{frame}: {'other pixels' if frame in got else 'missing'}"
                     for frame, pixels in self.of(job, isa).items() if got.get(frame) != pixels]
            if not wrong:
                return
            faults.append(f"with {isa} {wrong[0]}")
        raise Fault(f"{job.frames}: {', and '.join(faults)}; the job's edits: {job.edits}")

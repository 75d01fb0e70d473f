"""A job of which some frames are done when its worker leaves."""

from farm import OK, check, wait_until
from jobs import make_job, write_job

FRAMES = 8
STANDSTILL_S = 5  # longer than a worker may be silent


def make(folder, **changes):
    return write_job(folder / "job.json", make_job(folder, **{"frames": f"1-{FRAMES}", "image": {"tileSize": 32}, **changes}))


def undisturbed(programs, folder):
    programs.render(make(folder / "witness"), folder / "witness/work", threads=2)
    return programs.pixels(folder / "witness/frames")


def frame(folder, number):
    return folder / f"frames/frame.{number:04d}.exr"


def begin(farm, folder, num_done=2, make_job_file=make):
    """Submits the job and has its first frames made, then nobody works. Returns its ID."""
    worker = farm.start_worker()
    ident = farm.submit(make_job_file(folder))
    wait_until(lambda: farm.show(ident)["framesDone"] >= num_done, "frames are done")
    worker.terminate()
    worker.wait()
    check(farm.show(ident)["framesDone"] < FRAMES, "all was done too soon")
    return ident


def finish(farm, ident, expect=OK):
    farm.start_worker()
    return farm.baton("job", "wait", ident, expect=expect)

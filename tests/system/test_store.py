#!/usr/bin/env python3
"""What the store holds: as `baton check` says, and never more than a limit."""


from disk_use import StoreWatch, measure
from farm import IO, check, check_equal, run_tests
from jobs import camera_keys, make_job, write_job

MIB = 1 << 20
MOVING = camera_keys((1, [0, 1.2, 5], [0, 0.6, 0]), (30, [1.5, 1.2, 4.8], [0, 0.6, 0]))


def job_in(folder, **changes):
    """30 frames of 40 tiles with a checkpoint every 6."""
    common = {"frames": "1-30", "image": {"width": 256, "height": 160, "tileSize": 32}, "state": {"checkpointEvery": 6, "keep": "last"}}
    return write_job(folder / "job.json", make_job(folder, **{**common, **changes}))


def check_says_what_the_store_holds(programs, folder):
    for name, changes in {"rest": {}, "pool": {"sampling": {"method": "pool"}},
                          "films": {"sampling": {"method": "bidirectional"}}, "motion": {"camera": MOVING}}.items():
        predicted, watch = measure(programs, job_in(folder / name, **changes), folder=folder)
        ratio = predicted["storeBytes"] / watch.peak
        check(0.8 < ratio < 1.25, f"{name}: predicted {predicted['storeBytes']}, measured {watch.peak}")
        check(watch.peak <= predicted["storeBytesMost"], f"{name}: past its bound")


def two_workers_leave_nothing_but_the_last_states(programs, folder):
    _, alone = measure(programs, job_in(folder / "one", camera=MOVING), folder=folder)
    _, both = measure(programs, job_in(folder / "two", camera=MOVING), workers=2, folder=folder)
    check_equal(both.at_end, alone.at_end, "bytes in the store after the job")


def a_limit_holds_and_the_job_ends(programs, folder):
    path = job_in(folder)
    programs.render(path, folder / "free")
    witness = programs.pixels(folder / "frames")
    predicted = programs.checked(path)["storeBytes"]
    limit = round(1.2 * predicted / MIB)
    check(limit < 0.6 * predicted * 30 / 12 / MIB, "the limit is far below what all frames take")
    with StoreWatch(folder / "work/store") as watch:
        programs.render(path, folder / "work", workers=2,
                        extra=["--store-limit", limit, "--set", f"output.directory={folder}/limited"])
    check(watch.peak <= limit * MIB, f"{watch.peak} bytes, the limit is {limit} MiB")
    found = [path for path in folder.iterdir() if path.name.startswith("limited")]
    check_equal(programs.pixels(found[0]), witness, "pixels")


def a_limit_that_is_too_low_ends_the_render_with_an_error(programs, folder):
    path = job_in(folder)
    done = programs.render(path, folder / "work", extra=["--store-limit", 1], expect=IO)
    check("stopped: the job waits for room in the store" in done.stderr, done.stderr)
    check("of the 1.0 MiB that --store-limit allows" in done.stderr, done.stderr)
    programs.render(path, folder / "work", extra=["--store-limit", 1000])
    check_equal(len(list((folder / "frames").glob("*.exr"))), 30, "frames")


if __name__ == "__main__":
    run_tests()

#!/usr/bin/env python3
"""`baton compare`: jobs of the same frames side by side."""

import re

from farm import BAD_INPUT, OK, check, check_equal, make_job, run_tests, write_job


def pair(folder, **second):
    """Two jobs of the same frames, by two methods; `second` changes the second one. Their paths."""
    paths = []
    for name, method, more in [("one", "bidirectional", {}), ("two", "pool", second)]:
        job = make_job(folder, frames="1-5", sampling={"method": method}, output={"directory": str(folder / name)})
        paths.append(write_job(folder / f"{name}.json", {**job, "name": name, **more}))
    return paths


def both_rows_are_measured_and_shown(programs, folder):
    paths = pair(folder)
    done = programs.run("baton", "compare", *paths, "--output", folder / "out", expect=OK)
    rows = dict(re.findall(r"^(one|two) +[\d.]+ s +([\d.]+) ", done.stdout, re.MULTILINE))
    check_equal(sorted(rows), ["one", "two"], "rows")
    check(all(0 < float(noise) < 1 for noise in rows.values()), f"noise of some kind, got {rows}")
    check((folder / "out/comparison.png").stat().st_size > 1000, "a sheet")
    for name in rows:
        check_equal(len(list((folder / "out" / name).glob("*.exr"))), 5, f"frames of {name}")
        check(not (folder / name).exists(), "the jobs' own folders are left alone")


def jobs_that_cannot_be_compared_are_told_apart(programs, folder):
    for key, value in [("frames", "1-4"), ("name", "one")]:
        paths = pair(folder / key, **{key: value})
        said = programs.run("baton", "compare", *paths, expect=BAD_INPUT).stderr
        check(f"two.json: $.{key}: expected" in said and "one.json" in said, f"{key}: {said}")


if __name__ == "__main__":
    run_tests([both_rows_are_measured_and_shown, jobs_that_cannot_be_compared_are_told_apart])

#!/usr/bin/env python3
"""`baton compare`: jobs of the same frames side by side."""

import json
import re

from exr_frames import read_frame
from farm import BAD_INPUT, IO, OK, USAGE, check, check_equal, check_says, run_tests
from jobs import make_job, write_job


def pair(folder, **second):
    """Two jobs of the same frames, by two methods; `second` changes the second one. Their paths."""
    paths = []
    for name, method, more in [("one", "bidirectional", {}), ("two", "pool", second)]:
        job = make_job(folder, frames="1-5", sampling={"method": method}, output={"directory": str(folder / name)})
        paths.append(write_job(folder / f"{name}.json", {**job, "name": name, **more}))
    return paths


def noise_of_rows(done):
    """By the job's name: linear in percent; as shown, its darkest quarter, its worst block, its 99.9th percentile, black in
    percent, FLIP."""
    row = r"^(one|two) +([\d.]+) % +([\d.]+) +([\d.]+) +([\d.]+) +([\d.]+) +([\d.e-]+) % +([\d.]+)$"
    found = re.findall(row, done.stdout, re.MULTILINE)
    return {row[0]: [float(value) for value in row[1:]] for row in found}


def both_rows_are_measured_and_shown(programs, folder):
    paths = pair(folder)
    done = programs.run("baton", "compare", *paths, "--noise", "--output", folder / "out", expect=OK)
    rows = noise_of_rows(done)
    check_equal(sorted(rows), ["one", "two"], "rows")
    for linear, shown, darkest, worst, exceeded, black, flip in rows.values():
        check(0 < linear < 100 and 0 < darkest < worst and 0 < shown < worst, f"noise of some kind, got {rows}")
        check(shown < exceeded < 255, f"one pixel in 1,000 exceeds more, got {rows}")
        check(0 <= black < 50 and 0 < flip < 1, f"black pixels and FLIP of some kind, got {rows}")
    check((folder / "out/comparison.png").stat().st_size > 1000, "a sheet")
    for name in rows:
        check_equal(len(list((folder / "out" / name).glob("*.exr"))), 5, f"frames of {name}")
        check(not (folder / name).exists(), "the jobs' own folders are left alone")


def noise_is_what_render_tells(programs, folder):
    """One measure: what `compare` finds by two seeds, `render` tells of the job, within 20 %; 5 frames of 240 probes."""
    image = {"width": 240, "height": 140, "sites": 1}
    paths = pair(folder, image=image)
    one = json.loads(paths[0].read_text())
    paths[0] = write_job(paths[0], {**one, "image": image})
    rows = noise_of_rows(programs.run("baton", "compare", *paths, "--noise", "--output", folder / "out", expect=OK))
    for path, name in zip(paths, ("one", "two")):
        summary = json.loads(programs.render(path, folder / f"work{name}", extra=["--json"]).stdout)
        told, seen = 100 * summary["judgement"]["noise"], rows[name][0]
        print(f"  {name}: render tells {told:.2f} %, compare {seen:.2f} %")
        check(abs(told / seen - 1) < 0.2, f"{name}: render tells {told} %, compare {seen} %")


def no_more_is_rendered_than_is_asked_for(programs, folder):
    paths = pair(folder)
    done = programs.run("baton", "compare", *paths, "--frames", "2,4", "--scale", ".5", "--set", "image.sites=1", "--out",
                        folder / "look.png", expect=OK)
    check("noise" not in done.stdout, f"nothing of noise, got {done.stdout}")
    check((folder / "look.png").stat().st_size > 500, "the sheet, where --out says")
    output = folder / "one-compared-look"
    for name in ("one", "two"):
        check_equal(sorted(p.name for p in (output / name).glob("*.exr")), ["frame.0002.exr", "frame.0004.exr"], name)
    check_equal(sorted(p.name for p in output.iterdir() if p.name != ".baton"), ["one", "two"], "of other seeds nothing")
    check(not list((output / ".baton").rglob("*.exr")), "of other seeds nothing in the work folder")
    full = json.loads(paths[0].read_text())["image"]["width"]
    check_equal(read_frame(output / "one/frame.0002.exr").width, full // 2, "width")
    programs.refuses("compare", *paths, "--frame", "2", says="compare: no option --frame; did you mean \"--frames\"?", expect=USAGE)


def a_comparison_replaces_comparisons_only(programs, folder):
    paths = pair(folder)
    programs.render(paths[0], folder / "work")
    frames = programs.pixels(folder / "one")
    done = programs.run("baton", "compare", *paths, "--frames", "2", "--output", folder, expect=None)
    check(done.returncode in (BAD_INPUT, IO), f"exit code {done.returncode}")
    check_says(done.stderr, "frame.0002.exr is not what a job has written")
    check_equal(programs.pixels(folder / "one"), frames, "frames of a job")
    for more in (["--restart"], ["--scale", ".5"]):
        programs.run("baton", "compare", *paths, "--frames", "2", "--output", folder, *more, expect=OK)
    check_equal(read_frame(folder / "one/frame.0002.exr").width, 80, "width of the last one")


def jobs_that_cannot_be_compared_are_told_apart(programs, folder):
    for key, value in [("frames", "1-4"), ("name", "one")]:
        paths = pair(folder / key, **{key: value})
        programs.refuses("compare", *paths, says=[f"two.json: $.{key}: expected", "one.json"])


if __name__ == "__main__":
    run_tests()

#!/usr/bin/env python3
"""`baton render` says how good its frames are, and before that what is known to fail."""

import csv
import json
import math
import re

from farm import check, check_equal, make_job, run_tests, write_job


def job_at(folder, **changes):
    """A job file of six frames by `pool`, in floats."""
    changes = {"sampling": {"method": "pool"}, "output": {"aovs": ["depth"], "pixelType": "float"}, **changes}
    return write_job(folder / "job.json", make_job(folder, **changes))


def grey(programs, file):
    planes = [programs.values(file, channel) for channel in "RGB"]
    return [sum(values) / 3 for values in zip(*planes)]


def deviation(programs, a, b):
    """Relative noise of two frames of two seeds: rms of their difference over sqrt(2) and mean radiance, where both see
    the same surface."""
    depths = zip(programs.values(a, "depth"), programs.values(b, "depth"))
    same = [i for i, (x, y) in enumerate(depths) if x > 0 and abs(x - y) < 0.01 * x]
    first, second = grey(programs, a), grey(programs, b)
    square = sum((first[i] - second[i]) ** 2 for i in same) / 2 / len(same)
    return math.sqrt(square) / (sum(first[i] for i in same) / len(same))


def noise_told_is_noise(programs, folder):
    """The noise of `pool` from the halves of its pixels is that of two seeds; in frame, JSON and CSV alike."""
    summaries = []
    for seed in (1, 2):
        path = job_at(folder / str(seed), seed=seed, image={"sites": 1, "width": 240, "height": 140})
        done = programs.render(path, folder / f"work{seed}", extra=["--json"])
        summaries.append(json.loads(done.stdout))
    for number, row in enumerate(summaries[0]["frames"], 1):
        check_equal(row["noiseFrom"], "halves", "source")
        frames = [folder / f"{seed}/frames/frame.000{number}.exr" for seed in (1, 2)]
        true = deviation(programs, *frames)
        check(true / 1.6 < row["noise"] < 1.6 * true, f"frame {number}: told {row['noise']}, seeds differ by {true}")
        header = frames[0].read_bytes()[:4000]
        check(b"baton:noise\0" in header and f"{row['noise']:.4g}".encode() in header, "the header does not tell it")
    check_equal(summaries[0]["judgement"]["frames"], 6, "judged frames")
    with (folder / "1/frames/diagnostics.csv").open(encoding="ascii") as file:
        rows = [row for row in csv.DictReader(file) if row["tile"] == "all"]
    check_equal([row["noiseFrom"] for row in rows], ["halves"] * 6, "diagnostics.csv")
    check(abs(float(rows[2]["noise"]) - summaries[0]["frames"][2]["noise"]) < 1e-5, "diagnostics.csv")


def a_method_that_fails_is_named(programs, folder):
    """15 degrees a frame by `sequential`: warned of by check and render, and the noise is told."""
    path = job_at(folder, sampling={"method": "sequential"}, environment={"rotation": {"degPerFrame": 15}})
    word = "turns 15 degrees a frame: `sequential` fails from 1.5 on glossy surfaces"
    check(word in programs.run("baton", "check", path).stdout, "check does not warn")
    done = programs.render(path, folder / "work")
    check(word in done.stderr, f"render does not warn:\n{done.stderr}")
    told = re.search(r"noise +([\d.]+) % of the radiance.*neighbouring pixels", done.stdout)
    check(told is not None, f"no noise:\n{done.stdout}")

    path = job_at(folder / "pool", environment={"rotation": {"degPerFrame": 15}})
    done = programs.render(path, folder / "work2")
    check("fails from" not in done.stderr, "`pool` holds")
    quiet = re.search(r"noise +([\d.]+) % of the radiance.*two halves", done.stdout)
    check(quiet is not None, f"no noise:\n{done.stdout}")
    check(float(told[1]) > 2 * float(quiet[1]), f"`sequential` {told[1]} %, `pool` {quiet[1]} %")


def what_half_floats_cannot_hold_is_written_as_float(programs, folder):
    path = job_at(folder, frames="1", environment={"scale": 5000}, output={"aovs": [], "pixelType": "half"},
                  camera={"lookAt": [0, 2.5, 0], "verticalFovDeg": 120})
    done = programs.render(path, folder / "work")
    told = re.search(r"very bright (\d+) pixels in 1 frames", done.stdout)
    check(told is not None, f"nothing is told:\n{done.stdout}")
    brightest = programs.values(folder / "frames/frame.0001.exr", "R")
    check(max(brightest) > 1e5, f"clipped at {max(brightest)}")
    check_equal(int(told[1]), sum(1 for value in brightest if value > 65504), "pixels")


def values_below_zero_are_counted_and_set_to_zero(programs, folder):
    """Counted either way, and what is kept is what was counted."""
    changes = {"image": {"width": 400, "height": 240}, "environment": {"rotation": {"degPerFrame": 9}}, "frames": "1-10"}
    counts = []
    for clamp in (True, False):
        place = folder / str(clamp)
        path = job_at(place, output={"pixelType": "float", "aovs": [], "clampNegative": clamp}, **changes)
        summary = json.loads(programs.render(path, folder / f"work{clamp}", extra=["--json"]).stdout)
        below = 0
        for frame in sorted((place / "frames").glob("*.exr")):
            below += sum(1 for rgb in zip(*(programs.values(frame, c) for c in "RGB")) if min(rgb) < 0)
        counts.append((summary["judgement"]["pixelsBelowZero"], below))
    check(counts[0][0] > 0, "no pixel of `pool` is below zero: the test says nothing")
    check_equal(counts, [(counts[0][0], 0), (counts[0][0], counts[0][0])], "told and found, set to zero and kept")


def one_frame_of_another_light_stands_out(programs, folder):
    """A frame lit by a map of its own among others: named, and warned of before."""
    from farm import write_map
    folder.mkdir(parents=True, exist_ok=True)
    write_map(folder / "flash.hdr", colour=lambda x, y, width, height: (30.0, 30.0, 30.0))
    path = job_at(folder, frames="1-8")
    job = json.loads(path.read_text())
    keys = [(1, "lamp"), (4, "lamp"), (5, "flash"), (6, "lamp")]
    job["environment"]["keys"] = [{"frame": frame, "map": f"{name}.hdr"} for frame, name in keys]
    write_job(path, job)
    check("the light jumps from frame 4 to 5" in programs.run("baton", "check", path).stdout, "no warning of the jump")
    done = programs.render(path, folder / "work")
    check(re.search(r"stands out frame 5: mean radiance [\d.]+ times", done.stdout), f"not told:\n{done.stdout}")


if __name__ == "__main__":
    run_tests([noise_told_is_noise, a_method_that_fails_is_named, what_half_floats_cannot_hold_is_written_as_float,
               values_below_zero_are_counted_and_set_to_zero, one_frame_of_another_light_stands_out])

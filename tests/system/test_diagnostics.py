#!/usr/bin/env python3
"""What the sampler did in each frame and tile is in diagnostics.csv, in the job's JSON and in the frames, and agrees."""

import csv
import json

from farm import check, check_equal, run_tests
from jobs import make_job

COUNTS = ["carried", "fresh", "refreshed", "restarted"]
OF_FRAMES = ["noise", "noiseFrom", "mean", "pixelsBelowZero", "lowest", "lightBelowZero", "pixelsBeyondHalf", "pixelsNotFinite"]


def render(programs, folder, workers):
    """Three frames of small tiles in runs of two; returns (rows of diagnostics.csv, summary)."""
    job = make_job(folder, frames="1-3", state={"checkpointEvery": 2}, output={"aovs": ["depth", "resampled"]},
                   environment={"rotation": {"degPerFrame": 3}}, sampling={"refreshEvery": 0, "refreshRatio": 1.2})
    done = programs.render_in(folder, job, workers=workers, extra=["--json"])
    with (folder / "frames/diagnostics.csv").open(encoding="ascii") as file:
        return list(csv.DictReader(file)), json.loads(done.stdout)


def rows_add_up(programs, folder):
    """Each frame's sum is that of its tiles; every pixel with a surface is in one class and one bin."""
    rows, summary = render(programs, folder, workers=2)
    check_equal(sorted({row["frame"] for row in rows}), ["1", "2", "3"], "frames")
    for frame in "123":
        of_frame = [row for row in rows if row["frame"] == frame]
        total, tiles = of_frame[0], of_frame[1:]
        check_equal(total["tile"], "all", "first row of a frame")
        check_equal([int(row["tile"]) for row in tiles], list(range(len(tiles))), "tiles")
        check(all(total[column] for column in OF_FRAMES), f"nothing was seen of frame {frame}")
        check_equal([row[column] for row in tiles for column in OF_FRAMES if row[column]], [], "of a tile")
        for column in total:
            if column not in ("frame", "tile", *OF_FRAMES):
                check_equal(int(total[column]), sum(int(row[column]) for row in tiles), f"frame {frame}: {column}")
        check_equal(sum(int(total[c]) for c in COUNTS), int(total["pixels"]), "classes")
        check_equal(sum(int(total[c]) for c in total if c.startswith("essRatio")), int(total["pixels"]), "bins")

        # The picture tells the same.
        exr = folder / f"frames/frame.000{frame}.exr"
        check_equal(int(total["pixels"]), sum(1 for d in programs.values(exr, "depth") if d > 0), "pixels")
        check_equal(int(total["resampled"]), int(sum(programs.values(exr, "resampled"))), "resampled")

    sums = [row for row in rows if row["tile"] == "all"]
    check_equal(summary["stats"]["pixelsCarried"], sum(int(row["carried"]) for row in sums), "carried in the JSON")
    check(int(sums[0]["fresh"]) > 0 and int(sums[1]["carried"]) > 0, "nothing was sampled")
    check(sum(int(row["refreshedByRatio"]) for row in sums) > 0, "no pixel was refreshed by ratio")


def workers_do_not_matter(programs, folder):
    """The file is the same bytes with one worker and with three."""
    one, _ = render(programs, folder / "one", workers=1)
    three, _ = render(programs, folder / "three", workers=3)
    check_equal(one, three, "diagnostics")


def frames_say_what_they_are(programs, folder):
    """M, the matrices, an AOV under its name, and normals of length 1 where sites of two surfaces meet."""
    job = make_job(folder, frames="1-2", image={"sites": 4}, output={"aovs": ["acceptanceLocal", "normal", "depth"]})
    programs.render_in(folder, job)
    frame = folder / "frames/frame.0002.exr"
    header = frame.read_bytes()[:4000]
    for attribute in [b"baton:numCandidates\0string\0\x02\0\0\x0064", b"worldToCamera\0m44f\0", b"worldToNDC\0m44f\0"]:
        check(attribute in header, f"the header has no {attribute}")
    check(0 < max(programs.values(frame, "acceptanceLocal")) <= 1, "no local move was accepted")
    vectors = zip(*(programs.values(frame, f"normal.{axis}") for axis in "XYZ"), programs.values(frame, "depth"))
    lengths = [sum(v * v for v in normal)**0.5 for *normal, depth in vectors if depth > 0]
    check(all(abs(length - 1) < 1e-3 for length in lengths), f"normals of length {min(lengths)} to {max(lengths)}")


if __name__ == "__main__":
    run_tests()

#!/usr/bin/env python3
"""With state.carry off every pixel of every frame starts with SIR; with it on none does after the first frame, but for the
few pixels that look down and hardly see light: all of their samples may end without any."""

import json

from farm import check, check_equal, run_tests
from jobs import make_job


def render(programs, folder, carry):
    """Two frames; returns (summary, pixels with a surface, red and green of the `source` AOV of frame 2)."""
    job = make_job(folder, frames="1-2", state={"carry": carry, "checkpointEvery": 1})
    done = programs.render_in(folder, job, workers=2, extra=["--json"])
    frame = folder / "frames/frame.0002.exr"
    red, green = programs.values(frame, "source.R"), programs.values(frame, "source.G")
    surfaces = [depth > 0 for depth in programs.values(frame, "depth")]
    check(sum(surfaces) > 1000, "the camera sees hardly anything")
    return json.loads(done.stdout), surfaces, red, green


def count(surfaces, red, green, colour):
    """Pixels with a surface whose source has the colour (red, green)."""
    return sum(1 for s, r, g in zip(surfaces, red, green) if s and (r, g) == colour)


def carry_off_starts_every_pixel(programs, folder):
    summary, surfaces, red, green = render(programs, folder, carry=False)
    num_surfaces = sum(surfaces)
    check_equal(summary["stats"]["pixelsCarried"], 0, "carried pixels")
    check_equal(summary["stats"]["pixelsFresh"], 2 * num_surfaces, "fresh pixels of both frames")
    check_equal(count(surfaces, red, green, (1, 0)), num_surfaces, "red pixels of frame 2")


def carry_on_starts_none(programs, folder):
    summary, surfaces, red, green = render(programs, folder, carry=True)
    num_surfaces = sum(surfaces)
    check_equal(summary["stats"]["pixelsFresh"], num_surfaces, "fresh pixels: those of frame 1")
    restarted = summary["stats"]["pixelsRestarted"]
    check(restarted <= 0.001 * num_surfaces, f"{restarted} restarted pixels")
    check_equal(summary["stats"]["pixelsCarried"], num_surfaces - restarted, "carried pixels: those of frame 2")
    check_equal(count(surfaces, red, green, (0, 1)), num_surfaces - restarted, "green pixels of frame 2")
    check_equal(count(surfaces, red, green, (1, 1)), restarted, "yellow pixels of frame 2")


if __name__ == "__main__":
    run_tests()

#!/usr/bin/env python3
"""Traits of Blender files, each alone, as Cycles and as Baton show it, and the test of that test. All: random_blender.py."""

import random
import re
import struct
import sys
from pathlib import Path

from farm import check, check_equal, run_tests
from random_blender import blocks_of, compare, has_blender, names_of_traits, run_files

# Those in which viewport and renders, headers and pixels, or Eevee and Cycles differ, by the seed that draws forms that do.
TRAITS = {"302": "is_viewport|screw|child|instancer|splines|adaptive|image_with_alpha|^mapping|beyond_one|^alpha$|axes|clipping",
          "34": "hdr_that|exr_that|exr_with_w|png_with_alpha|two_outputs"}
SOURCE = Path(__file__).resolve().parents[2]
sys.path.append(str(SOURCE / "jobs/exporters/blender/baton_exporter"))
import exr  # noqa: E402


def differences_are_seen(_programs, _folder):
    """Of noise alone none; one of all blocks, one of a single block, and one of size."""
    draw = random.Random(1)
    truth = [draw.uniform(0.5, 2) for _ in range(120)]

    def noisy(share):
        return [value * draw.gauss(1, share) for value in truth]

    for share in (0, 0.002, 0.02):
        check(not compare(noisy(share / 3), [noisy(share), noisy(share)])[0], f"noise of {share} is taken for a difference")
    check(compare([1.02 * value for value in truth], [noisy(0.002), noisy(0.002)])[0], "nobody saw a share of 2 %")
    check(compare([*truth[:-1], truth[-1] + 0.3], [noisy(0.002), noisy(0.002)])[0], "nobody saw a block")
    check(compare(truth[:-1], [truth, truth])[0], "nobody saw the size")
    check(compare([*truth[:-1], float("nan")], [truth, truth])[0], "nobody saw what is no number")


def blocks_are_means(_programs, folder):
    folder.mkdir()
    lines = [struct.pack("<36f", *[row] * 12, *range(12), *[2] * 12) for row in range(10)]
    exr.write(folder / "picture.exr", 12, 10, lines)
    check_equal(blocks_of(folder / "picture.exr", "BGR"), [3.5, 3.5, 8.5, 8.5, 3.5, 9.5, 3.5, 9.5, 2, 2, 2, 2], "means")


def traits_of_files(programs, folder):
    """Nothing differs from Cycles that the report does not tell."""
    if not has_blender():
        print("blender is not there: left out")
        return
    names = names_of_traits()
    for seed, wanted in TRAITS.items():
        chosen = [i - len(names) for i, name in enumerate(names) if re.search(wanted, name)]
        check_equal(run_files(programs, SOURCE, seed, chosen, folder / seed), [], "files that differ and are not told of")


if __name__ == "__main__":
    sys.dont_write_bytecode = True
    run_tests()

#!/usr/bin/env python3
"""The short form of edits.py."""

from edits import run
from farm import run_tests

NUM_SEQUENCES, SEED = 4, 1


def every_frame_is_right_after_sequences_of_edits(programs, folder):
    run(programs, folder, NUM_SEQUENCES, SEED)


if __name__ == "__main__":
    run_tests()

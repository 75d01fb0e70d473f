#!/usr/bin/env python3
"""The short form of chaos.py, whose faults are random but for their seed."""

from chaos import run
from chaos_disk import enter_namespace
from farm import run_tests

NUM_FAULTS, SEED = 25, 1


def every_frame_is_right_after_random_faults(programs, folder):
    run(programs, folder, NUM_FAULTS, SEED)


if __name__ == "__main__":
    enter_namespace()
    run_tests()

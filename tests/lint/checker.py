"""What the checkers of the tree have in common: they are trusted only as long as they find what they must."""

import sys
from pathlib import Path


def run(usage, self_test, find):
    """The exit code of a checker that is called with a root, or with --self-test. self_test() returns how many planted faults it
    missed; find(root) the lines to print, of which there should be none."""
    if sys.argv[1:] == ["--self-test"]:
        return 1 if self_test() else 0
    root = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).resolve().parents[2]
    if len(sys.argv) > 2 or not root.is_dir():
        print(usage, file=sys.stderr)
        return 64
    if self_test():
        return 1
    found = find(root)
    for line in found:
        print(line)
    return 1 if found else 0

#!/usr/bin/env python3
"""Checks that the drawing of the rooms, docs/build/rooms.svg, shows those of the tree: every room, every arrow, none else.
Numbers of lines are those of the day it was drawn. The panel of an earlier revision is not checked.

usage: check_rooms.py [ROOT]      print every difference, exit 1 when there is any
       check_rooms.py --self-test plant one fault of each kind in a small tree and see it found
"""

import sys
from pathlib import Path

sys.dont_write_bytecode = True
sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "jobs/lab"))

import checker  # noqa: E402
import rooms  # noqa: E402


def differences(svg, sources):
    """What a drawing shows that the tree has not, and the other way round. sources: path -> text."""
    tree = rooms.Rooms(sources)
    drawn_rooms, drawn_arrows = rooms.drawn_after(svg)
    arrows = {arrow: arrow in tree.red() for arrow in tree.arrows}
    found = [f"room {room} is not drawn" for room in sorted(tree.lines.keys() - drawn_rooms)]
    found += [f"draws room {room}, which is not there" for room in sorted(drawn_rooms - tree.lines.keys())]
    found += [f"arrow {a} -> {b} is not drawn" for a, b in sorted(arrows.keys() - drawn_arrows.keys())]
    found += [f"draws {a} -> {b}, which is not there or implied by others" for a, b in sorted(drawn_arrows.keys() - arrows.keys())]
    for a, b in sorted(arrows.keys() & drawn_arrows.keys()):
        if arrows[a, b] != drawn_arrows[a, b]:
            found.append(f"draws {a} -> {b} {'red' if drawn_arrows[a, b] else 'grey'}, which it is not")
    return found


TREE = {
    "common/base/a.h": "#pragma once\n",
    "common/math/a.h": '#include "common/base/a.h"\n',
    "worker/run/a.h": '#include "common/base/a.h"\n#include "common/math/a.h"\n',
    "worker/main.cpp": '#include "worker/run/a.h"\n',
    "coordinator/main.cpp": '#include "common/math/a.h"\n#include "common/math/written_by_the_build.h"\n',
    "jobs/lab/studies/a.cpp": '#include "worker/run/a.h"\n',
}
BASE = '#include "common/base/a.h"\n'
# A planted fault: file, its text (None: it is gone), and what the messages must be.
PLANTED = [
    ("common/state/a.h", "", ["room common/state is not drawn"]),
    ("worker/main.cpp", None, [
        "draws room worker, which is not there",
        "draws worker -> worker/run, which is not there or implied by others",
    ]),
    ("common/math/a.h", "", [
        "arrow worker/run -> common/base is not drawn",
        "draws common/math -> common/base, which is not there or implied by others",
    ]),
    # A circle, whose arrow upwards is red.
    ("common/base/a.h", '#include "common/math/a.h"\n', [
        "arrow common/base -> common/math is not drawn",
        "arrow worker/run -> common/base is not drawn",
        "draws worker/run -> common/math, which is not there or implied by others",
        "draws common/math -> common/base grey, which it is not",
    ]),
    ("coordinator/main.cpp", TREE["coordinator/main.cpp"] + '#include "worker/run/a.h"\n', [
        "arrow coordinator -> worker/run is not drawn",
        "draws coordinator -> common/math, which is not there or implied by others",
    ]),
    ("common/base/b.h", "int more;\n" * 500, []),
    ("worker/main.cpp", TREE["worker/main.cpp"] + BASE, []),
    ("tests/unit/a.cpp", TREE["worker/main.cpp"], []),
]


def self_test():
    """Draws a tree, then plants each fault in it. Returns how many were not found."""
    missed = 0
    tree = {path: text for path, text in TREE.items() if rooms.is_drawn(path)}
    old, new = rooms.Rooms({**tree, "jobs/old/a.h": BASE}), rooms.Rooms(tree)
    svg = rooms.drawing(("1234567", old), ("2345678", new))
    for path, text, expected in [("worker/main.cpp", TREE["worker/main.cpp"], []), *PLANTED]:
        sources = {name: words for name, words in {**TREE, path: text}.items() if words is not None and rooms.is_drawn(name)}
        found = differences(svg, sources)
        if found != expected:
            missed += 1
            print(f"self-test: {path}: expected {expected}, got {found}")
    print(f"self-test: {len(PLANTED) + 1 - missed} of {len(PLANTED) + 1} as expected")
    return missed


def faults(root):
    """Lines that say where the figure differs from the tree, and what to do then."""
    found = [f"{rooms.FIGURE}: {line}" for line in differences((root / rooms.FIGURE).read_text(encoding="utf-8"), rooms.sources_of_tree(root))]
    return found + [f"{rooms.FIGURE}: draw it again when the sources are committed: jobs/lab/rooms.py e1e9939"] if found else []


if __name__ == "__main__":
    sys.exit(checker.run(__doc__, self_test, faults))

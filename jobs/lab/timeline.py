#!/usr/bin/env python3
"""Draws how many threads are busy over time, as `baton trace` plays a recorded trace on a number of threads.

    python3 jobs/lab/timeline.py docs/lab/timeline.svg --baton build/release/bin/baton --threads 16 "before=a.trace" "after=b.trace"
"""

import argparse
import json
import subprocess
from html import escape
from pathlib import Path

WIDTH, HEIGHT, LEFT, TOP, GAP = 720, 90, 44, 26, 44  # of a diagram, and around it [px]
FILL, LINE, TEXT = "#7aa6c2", "#999", "#333"


def played(baton, trace, threads):
    """(seconds, mean of busy threads, busy threads in equal stretches of time)"""
    told = subprocess.run([baton, "trace", trace, "--threads", str(threads), "--json"], check=True, capture_output=True, text=True)
    play = json.loads(told.stdout)["played"][0]
    return play["seconds"], play["busy"], play["busyOverTime"]


def diagram(label, play, threads, longest_s, top):
    """Lines of SVG: steps over a common axis of time."""
    seconds, busy, stretches = play
    width = WIDTH * seconds / longest_s
    step = width / len(stretches)
    points = [(LEFT, top + HEIGHT)]
    for i, count in enumerate(stretches):
        y = top + HEIGHT * (1 - min(count / threads, 1))
        points += [(LEFT + i * step, y), (LEFT + (i + 1) * step, y)]
    points.append((LEFT + width, top + HEIGHT))
    path = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
    yield f'<text x="{LEFT}" y="{top - 8}">{escape(label)}: {seconds:.1f} s, {busy:.1f} of {threads} threads busy</text>'
    yield f'<polygon points="{path}" fill="{FILL}"/>'
    for count in (0, threads):
        y = top + HEIGHT * (1 - count / threads)
        yield f'<line x1="{LEFT}" y1="{y}" x2="{LEFT + WIDTH}" y2="{y}" stroke="{LINE}"/>'
        yield f'<text x="{LEFT - 6}" y="{y + 4}" text-anchor="end">{count}</text>'


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("picture", type=Path)
    parser.add_argument("traces", nargs="+", metavar="LABEL=TRACE")
    parser.add_argument("--baton", default="baton")
    parser.add_argument("--threads", type=int, default=16)
    given = parser.parse_args()
    named = [trace.split("=", 1) for trace in given.traces]
    plays = [(label, played(given.baton, trace, given.threads)) for label, trace in named]
    longest_s = max(seconds for _, (seconds, _, _) in plays)
    lines, top = [], TOP
    for label, play in plays:
        lines += diagram(label, play, given.threads, longest_s, top)
        top += HEIGHT + GAP
    size = f'width="{LEFT + WIDTH + 8}" height="{top - GAP + 10}"'
    head = f'<svg xmlns="http://www.w3.org/2000/svg" {size} font-family="sans-serif" font-size="12" fill="{TEXT}">'
    given.picture.write_text("\n".join([head, '<rect width="100%" height="100%" fill="white"/>', *lines, "</svg>"]) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()

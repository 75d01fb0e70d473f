#!/usr/bin/env python3
"""Draws the tables of study_sequential as SVG. Needs python3-matplotlib.

usage: plot.py FOLDER     reads FOLDER/*.csv, writes FOLDER/*.svg
"""

import csv
import sys
from collections import defaultdict
from pathlib import Path

import matplotlib

matplotlib.use("svg")
import matplotlib.pyplot as plt  # noqa: E402: the backend comes first

plt.rcParams.update({"svg.hashsalt": "baton", "svg.fonttype": "none", "font.size": 9, "axes.grid": True,
                     "grid.alpha": 0.3, "axes.spines.top": False, "axes.spines.right": False})


def series(path, name, x, y):
    """{name: ([x], [y])} of a table."""
    lines = defaultdict(lambda: ([], []))
    with path.open() as file:
        for row in csv.DictReader(file):
            lines[row[name]][0].append(float(row[x]))
            lines[row[name]][1].append(float(row[y]))
    return lines


def save(figure, path):
    """Without the date, so that equal tables give equal files."""
    figure.tight_layout()
    figure.savefig(path, metadata={"Date": None})
    plt.close(figure)


def draw_moves(folder, name):
    """Fig. 3: errors of Lns and of the image against the number of moves or distributions."""
    figure, axes = plt.subplots(1, 2, figsize=(8, 3.2))
    for axis, y, label in ((axes[0], "logLnsError", "RMS of log Lns"), (axes[1], "rmse", "RMS error of the image")):
        for kind, (xs, ys) in series(folder / f"{name}.csv", "kind", "count", y).items():
            if kind != "bidirectional":
                axis.plot(xs, ys, marker="o", markersize=3, label=kind)
        axis.set_xlabel("moves or distributions")
        axis.set_ylabel(label)
        axis.set_yscale("log")
    axes[0].legend(fontsize=7, frameon=False)
    save(figure, folder / f"{name}.svg")


def draw_resampled(folder, name):
    """Section 7: the share of pixels that were resampled."""
    figure, axis = plt.subplots(figsize=(5, 2.8))
    for kind, (xs, ys) in series(folder / f"{name}.csv", "kind", "frame", "resampled").items():
        axis.plot(xs, [100 * y for y in ys], label=f"{kind}: {100 * sum(ys) / len(ys):.0f} %", linewidth=1)
    axis.set_xlabel("frame")
    axis.set_ylabel("% of pixels resampled")
    axis.set_ylim(bottom=0)
    axis.legend(fontsize=7, frameon=False)
    save(figure, folder / f"{name}.svg")


def draw_equal_time(folder, name):
    """Fig. 1, 4, 5: error over the sequence at equal time."""
    figure, axis = plt.subplots(figsize=(5, 3))
    times = series(folder / f"{name}.csv", "kind", "frame", "ms")
    for kind, (xs, ys) in series(folder / f"{name}.csv", "kind", "frame", "rmse").items():
        mean_ms = sum(times[kind][1]) / len(times[kind][1])
        axis.plot(xs, ys, marker="o", markersize=3, label=f"{kind}, {mean_ms:.0f} ms")
    axis.set_xlabel("frame")
    axis.set_ylabel("RMS error")
    axis.set_ylim(bottom=0)
    axis.legend(fontsize=7, frameon=False)
    save(figure, folder / f"{name}.svg")


def draw_speed_up(folder):
    """Section 7: error against time of bidirectional for many M, with the sequential sampler as points."""
    kinds = {"P = 1": "s", "P = 1, refreshEvery 4": "D", "P = 5": "*", "P = 5, refreshRatio 1.5": "P"}
    motions = {"slow-light": "light, 0.1\u00b0 a frame", "light": "light, 1.5\u00b0 a frame", "camera": "camera, 2\u00b0 a frame"}
    figure, axes = plt.subplots(2, len(motions), figsize=(9, 5.6))
    for line, (suffix, scene) in zip(axes, (("", "interior"), ("-soft", "forest"))):
        for axis, (motion, title) in zip(line, motions.items()):
            with (folder / f"speed-up-{motion}{suffix}.csv").open() as file:
                rows = list(csv.DictReader(file))
            for colour, frames in enumerate(("2", "2-9")):
                mine = [r for r in rows if r["frames"] == frames]
                curve = [(float(r["ms"]), float(r["rmse"])) for r in mine if r["kind"].startswith("bidirectional")]
                axis.plot(*zip(*curve), marker=".", color=f"C{colour}", label=f"bidirectional, M = 16 to 1024, frames {frames}")
                for kind, marker in kinds.items():
                    point = next(r for r in mine if r["kind"] == kind)
                    axis.plot(float(point["ms"]), float(point["rmse"]), marker, color=f"C{colour}", markersize=7,
                              label=f"sequential, {kind}, frames {frames}")
            axis.set_xscale("log")
            axis.set_xticks((4, 6, 10, 15), ("4", "6", "10", "15"))
            axis.set_xticks((), minor=True)
            axis.set_yscale("log")
            axis.set_title(f"{scene}, {title}", fontsize=9)
        line[0].set_ylabel("RMS error")
    for axis in axes[-1]:
        axis.set_xlabel("ms per frame")
    figure.legend(*axes[0][0].get_legend_handles_labels(), fontsize=7, frameon=False, loc="lower center", ncols=2)
    figure.tight_layout(rect=(0, 0.17, 1, 1))
    figure.savefig(folder / "speed-up.svg", metadata={"Date": None})
    plt.close(figure)


def draw_drift(folder):
    """Carried over true Lns: median, mean and the middle 90 % for each speed and kind."""
    with (folder / "drift.csv").open() as file:
        rows = list(csv.DictReader(file))
    speeds = list(dict.fromkeys(row["degPerFrame"] for row in rows))
    kinds = list(dict.fromkeys(row["kind"] for row in rows))
    figure, axes = plt.subplots(len(speeds), len(kinds), figsize=(2.4 * len(kinds), 1.9 * len(speeds)), sharex=True,
                                sharey="row", squeeze=False)
    for line, speed in zip(axes, speeds):
        for axis, kind in zip(line, kinds):
            mine = [r for r in rows if r["degPerFrame"] == speed and r["kind"] == kind]
            frames = [int(r["frame"]) for r in mine]
            axis.fill_between(frames, [float(r["p05"]) for r in mine], [float(r["p95"]) for r in mine], alpha=0.25)
            axis.plot(frames, [float(r["median"]) for r in mine], label="median")
            axis.plot(frames, [float(r["mean"]) for r in mine], "--", label="mean")
            axis.axhline(1, color="black", linewidth=0.5)
            axis.set_yscale("log")
            axis.set_ylim((0.9, 1.1) if float(speed) == 0 else (0.02, 5))
            if axis in axes[0]:
                axis.set_title(kind, fontsize=8)
        line[0].set_ylabel(f"{float(speed):g}\u00b0 a frame")
    axes[-1][0].set_xlabel("frame")
    axes[0][0].legend(fontsize=6, frameon=False)
    save(figure, folder / "drift.svg")


def main():
    if len(sys.argv) != 2:
        print(__doc__, file=sys.stderr)
        return 64
    folder = Path(sys.argv[1])
    draw_moves(folder, "moves")
    draw_moves(folder, "moves-soft")
    draw_resampled(folder, "resampled")
    draw_resampled(folder, "resampled-soft")
    draw_equal_time(folder, "sky-specular")
    draw_equal_time(folder, "sky-mixed")
    draw_speed_up(folder)
    draw_drift(folder)
    return 0


if __name__ == "__main__":
    sys.exit(main())

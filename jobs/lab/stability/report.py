#!/usr/bin/env python3
"""Turns the tables of the stability suite into a report.

usage: report.py FOLDER CASES [--docs DOCS]

FOLDER holds grid.csv and series.csv; CASES is the output of `stability --list`. Writes FOLDER/report.html (self-contained:
the grid, and for each case its sentence, its plots and its numbers) and FOLDER/plots/CASE.svg. --docs writes the grid for
the pages: DOCS/grid.svg, and DOCS/grid.csv with the same numbers unabridged.
"""

import argparse
import csv
import html
import math
import re
from collections import defaultdict
from pathlib import Path

COLORS = ["#444444", "#8c8c8c", "#e07b00", "#2a7de1", "#1a9850", "#c51b7d", "#7b52ab", "#d62728", "#17a2b8", "#8c564b",
          "#b8a000", "#005f73"]
FILLS = {"holds": "#d7f0d7", "degrades": "#fff0c2", "fails": "#f9d0cd"}
WIDTH, HEIGHT, MARGIN = 430, 230, 42


def read_table(path):
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def log_ticks(low, high):
    """Powers of ten inside [low, high]; with fewer than two of them also their doubles and fivefolds."""
    decades = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    ticks = [10.0**d for d in decades if low <= 10.0**d <= high]
    if len(ticks) < 2:
        ticks = [f * 10.0**d for d in decades for f in (1, 2, 5) if low <= f * 10.0**d <= high]
    return ticks


def panel(x0, title, lines, low, high, last_frame):
    """One set of axes with a logarithmic ordinate. lines: (color, dash, [(frame, value)])."""
    values = [min(max(v, low), high) for _, _, points in lines for _, v in points] or [low, high]
    bottom, top = min(values) / 1.2, max(values) * 1.2

    def place(frame, value):
        x = x0 + MARGIN + (frame - 1) / max(last_frame - 1, 1) * (WIDTH - MARGIN - 8)
        t = math.log(min(max(value, low), high) / bottom) / math.log(top / bottom)
        return x, HEIGHT - 26 - t * (HEIGHT - 50)

    out = [f'<text x="{x0 + MARGIN}" y="14" font-weight="bold">{html.escape(title)}</text>']
    for tick in log_ticks(bottom, top):
        x, y = place(1, tick)
        out.append(f'<path d="M{x:.0f} {y:.1f}H{x0 + WIDTH - 8}" stroke="#ddd"/>'
                   f'<text x="{x - 4:.0f}" y="{y + 3:.1f}" text-anchor="end">{tick:g}</text>')
    for frame in (1, (last_frame + 1) // 2, last_frame):
        out.append(f'<text x="{place(frame, bottom)[0]:.0f}" y="{HEIGHT - 10}" text-anchor="middle">{frame}</text>')
    for color, dash, points in lines:
        path = "L".join(f"{x:.1f} {y:.1f}" for x, y in (place(f, v) for f, v in points))
        if path:
            out.append(f'<path d="M{path}" fill="none" stroke="{color}" stroke-width="1.4" stroke-dasharray="{dash}"/>')
    return "".join(out)


def plot(series, subjects):
    """SVG of one case: Lns^/Lns and noise over frames, a line a method. series: subject -> rows."""
    last = max((int(row["frame"]) for rows in series.values() for row in rows), default=2)
    ratio, noise = [], []
    for index, subject in enumerate(subjects):
        color, rows = COLORS[index % len(COLORS)], series.get(subject, [])
        for column, dash in (("lns_mean", ""), ("lns_median", "4 3")):
            ratio.append((color, dash, [(int(r["frame"]), float(r[column])) for r in rows]))
        noise.append((color, "", [(int(r["frame"]), float(r["noise"])) for r in rows]))
    legend = "".join(
        f'<path d="M{2 * WIDTH + 12} {22 + 16 * i}h18" stroke="{COLORS[i % len(COLORS)]}" stroke-width="2"/>'
        f'<text x="{2 * WIDTH + 36}" y="{26 + 16 * i}">{html.escape(s)}</text>' for i, s in enumerate(subjects))
    return (f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {2 * WIDTH + 210} {max(HEIGHT, 30 + 16 * len(subjects))}" '
            f'font-family="sans-serif" font-size="11"><rect width="100%" height="100%" fill="#fff"/>'
            + panel(0, "Lns^/Lns: mean (line), median (dashes)", ratio, 1e-2, 1e2, last)
            + panel(WIDTH, "error of a pixel / mean radiance", noise, 1e-3, 1e2, last) + legend + "</svg>")


def number_table(rows):
    columns = [c for c in rows[0] if c not in ("case", "verdict", "expected", "number")]
    head = "".join(f"<th>{c.replace('_', ' ')}</th>" for c in columns)
    body = "".join("<tr>" + "".join(f"<td>{html.escape(row[c])}</td>" for c in columns) + "</tr>" for row in rows)
    return f"<table class=n><tr>{head}</tr>{body}</table>"


def grid_table(cells, texts, subjects):
    head = "".join(f"<th>{html.escape(s)}</th>" for s in subjects)
    lines = []
    for name, row in cells.items():
        tds = []
        for subject in subjects:
            cell = row.get(subject)
            if cell is None:
                tds.append("<td></td>")
                continue
            changed = cell["expected"] not in ("", cell["verdict"])
            note = f"<br><b>recorded: {cell['expected']}</b>" if changed else ""
            tds.append(f'<td style="background:{FILLS[cell["verdict"]]}">{cell["verdict"]}<br>'
                       f'<small>{html.escape(cell["number"])}</small>{note}</td>')
        lines.append(f'<tr><th title="{html.escape(texts.get(name, ""))}"><a href="#{name}">{name}</a></th>{"".join(tds)}</tr>')
    return f"<table><tr><th>case</th>{head}</tr>{''.join(lines)}</table>"


def short_number(text):
    """The number that decided a verdict in the width of a cell; what it is of is left out where it is the noise."""
    shapes = ((r"noise x([\d.]+)( after the jump)?", lambda m: m[1] + ("\N{DAGGER}" if m[2] else "")),
              (r"growth of Lns error x([\d.]+)", lambda m: f"growth {m[1]}"),
              (r"(median|mean) Lns\^/Lns ([\d.]+).*", lambda m: f"{m[1]} {m[2]}"),
              (r"bias -?([\d.]+) .*", lambda m: f"bias {'-' if '-' in text else ''}{float(m[1]):.0f} %"),
              (r"([\d.]+) % of pixels dark", lambda m: f"dark {m[1]} %"))
    for pattern, shorten in shapes:
        match = re.fullmatch(pattern, text)
        if match:
            return shorten(match)
    return text


def grid_picture(cells, subjects):
    """The grid as SVG: a row a case, a column a method, colour and type face by verdict."""
    left, top, width, height = 150, 118, 74, 17
    faces = {"holds": "", "degrades": ' font-style="italic"', "fails": ' font-weight="bold"'}
    size = (left + width * len(subjects) + 70, top + height * len(cells) + 4)
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {size[0]} {size[1]}" font-family="sans-serif" '
           f'font-size="11"><rect width="100%" height="100%" fill="#fff"/>']
    for column, subject in enumerate(subjects):
        x = left + width * (column + 0.4)
        out.append(f'<text transform="translate({x:.0f} {top - 6}) rotate(-40)">{html.escape(subject)}</text>')
    for line, (name, row) in enumerate(cells.items()):
        y = top + height * line
        out.append(f'<text x="{left - 6}" y="{y + 12}" text-anchor="end">{html.escape(name)}</text>')
        for column, subject in enumerate(subjects):
            if subject not in row:
                continue
            verdict, x = row[subject]["verdict"], left + width * column
            out.append(f'<rect x="{x}" y="{y}" width="{width - 1}" height="{height - 1}" fill="{FILLS[verdict]}"/>'
                       f'<text x="{x + width / 2:.0f}" y="{y + 12}" text-anchor="middle" '
                       f'font-size="10"{faces[verdict]}>'
                       f'{html.escape(short_number(row[subject]["number"]))}</text>')
    return "".join(out) + "</svg>\n"


def write_docs(folder, cells, subjects):
    (folder / "grid.svg").write_text(grid_picture(cells, subjects), encoding="utf-8")
    with (folder / "grid.csv").open("w", encoding="utf-8", newline="") as file:
        lines = csv.writer(file, lineterminator="\n")
        lines.writerow(["case", "method", "verdict", "number"])
        lines.writerows([name, subject, row[subject]["verdict"], row[subject]["number"]]
                        for name, row in cells.items() for subject in subjects if subject in row)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("cases", type=Path)
    parser.add_argument("--docs", type=Path)
    options = parser.parse_args()

    # Sort the tables by case and subject, in the order of the files.
    texts = dict(line.split("\t", 1) for line in options.cases.read_text(encoding="utf-8").splitlines())
    cells, series = defaultdict(dict), defaultdict(lambda: defaultdict(list))
    for row in read_table(options.folder / "grid.csv"):
        cells[row["case"]][row["subject"]] = row
    for row in read_table(options.folder / "series.csv"):
        series[row["case"]][row["subject"]].append(row)
    subjects = list(dict.fromkeys(subject for row in cells.values() for subject in row))

    # Write plots, page and table.
    plots = options.folder / "plots"
    plots.mkdir(exist_ok=True)
    sections = []
    for name, row in cells.items():
        picture = plot(series[name], subjects)
        (plots / f"{name}.svg").write_text(picture, encoding="utf-8")
        sections.append(f'<h2 id="{name}">{name}</h2><p>{html.escape(texts.get(name, ""))} '
                        f'<a href="#top">grid</a></p>{picture}{number_table(list(row.values()))}')
    page = ('<!doctype html><meta charset="utf-8"><title>Stability</title><style>body{font:13px sans-serif;margin:16px}'
            "table{border-collapse:collapse}td,th{border:1px solid #ccc;padding:2px 6px;text-align:left}"
            ".n{font-size:11px}svg{max-width:1100px;display:block}</style><h1 id=top>Stability</h1>"
            + grid_table(cells, texts, subjects) + "".join(sections))
    (options.folder / "report.html").write_text(page, encoding="utf-8")
    if options.docs:
        write_docs(options.docs, cells, subjects)
    print(f"{options.folder / 'report.html'}: {len(cells)} cases, {len(subjects)} methods")


if __name__ == "__main__":
    main()

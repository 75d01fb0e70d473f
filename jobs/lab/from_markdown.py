#!/usr/bin/env python3
"""Takes the tables of a Markdown file, in their order, as CSV files.

usage: from_markdown.py PAGE.md FOLDER NAME...      FOLDER/NAME.csv of each; a NAME of - leaves one out
"""

import csv
import re
import sys
from pathlib import Path


def tables_of(text):
    """Lists of rows, the line under the header left out."""
    for block in re.findall(r"(?:^\|.*\n)+", text, re.MULTILINE):
        lines = block.splitlines()
        yield [[cell.strip() for cell in re.split(r"(?<!\\)\|", line.strip()[1:-1])] for line in lines[:1] + lines[2:]]


def main():
    if len(sys.argv) < 4:
        print(__doc__, file=sys.stderr)
        return 64
    page, folder, names = Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3:]
    tables = list(tables_of(page.read_text(encoding="utf-8") + "\n"))
    if len(tables) != len(names):
        print(f"{page} has {len(tables)} tables, expected {len(names)}: {' '.join(names)}", file=sys.stderr)
        return 65
    for name, rows in zip(names, tables):
        if name == "-":
            continue
        with (folder / f"{name}.csv").open("w", encoding="utf-8", newline="") as file:
            csv.writer(file, lineterminator="\n").writerows(rows)
    return 0


if __name__ == "__main__":
    sys.exit(main())

#!/usr/bin/env python3
"""Time of a pixel over that of its shadow rays, by method, as CSV: bench_methods on the demo and in the crowd, one site.

usage: over_rays.py BIN >CSV      BIN: where the programs are
"""

import csv
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
JOBS = {"demo": ("jobs/examples/demo.json", "16"), "crowd": ("tests/bench/crowd.json", "6")}
ROW = re.compile(r"^(\S.{21}) +([\d.]+) +([\d.]+|-) ")


def main():
    if len(sys.argv) != 2:
        print(__doc__, file=sys.stderr)
        return 64
    table = csv.writer(sys.stdout, lineterminator="\n")
    table.writerow(["scene", "method", "ratio", "goal"])
    for scene, (job, frames) in JOBS.items():
        said = subprocess.run([f"{sys.argv[1]}/bench_methods", str(ROOT / job), frames, "", "1"], stdout=subprocess.PIPE, text=True,
                              check=True).stdout
        if "assertions are on" in said:
            sys.exit("bench_methods was built with assertions: its times are not the product's")
        rows = [match.groups() for match in map(ROW.match, said.splitlines()) if match]
        if not rows:
            sys.exit(f"bench_methods printed no row that is known:\n{said}")
        for name, ratio, goal in rows:
            name = re.sub(r" ([MP])=(\d+)", r", \1 = \2", name.strip()).replace(" path", ", path sampling")
            table.writerow([scene, name, ratio, "" if goal == "-" else goal])
    return 0


if __name__ == "__main__":
    sys.exit(main())

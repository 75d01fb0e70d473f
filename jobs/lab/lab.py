#!/usr/bin/env python3
"""The notebook: docs/lab, and every number of other pages that comes from it.

usage: lab.py [NAME...]     runs the commands that make the tables of these names, or all, and writes the pages
       lab.py --tables      writes the pages' tables from the CSV files that are there
       lab.py --check       says which tables are older than what they measure; exit 1 when a page differs from its CSV
       lab.py --list        every command, how long it takes, and the tables that come from it

jobs/lab/manifest.json names the commands, the files that they write, and the sources that these measure. Numbers that a
person copied have no command; the manifest says where they came from.
"""

import csv
import datetime
import os
import re
import subprocess
import sys
from pathlib import Path

from tables import MADE, Lab, faults, pages

ROOT = Path(__file__).resolve().parents[2]


def git(*arguments):
    """What git says, or None where there is no repository or no such commit."""
    done = subprocess.run(["git", "-C", str(ROOT), *arguments], capture_output=True, text=True, check=False)
    return done.stdout.strip() if done.returncode == 0 else None


def machine():
    """Cores, processor and the widest instruction set that the program uses."""
    text = Path("/proc/cpuinfo").read_text(encoding="utf-8")
    model = re.search(r"model name\s*: (.*)", text)
    widest = "AVX-512" if " avx512f " in text else "AVX2" if " avx2 " in text else "baseline"
    return f"{os.cpu_count()}-core {model[1] if model else 'unknown processor'} ({widest})"


def build_of(measures):
    """The commit that is built, with a + where what is measured has changes that are in none."""
    commit = git("rev-parse", "--short=7", "HEAD")
    if commit is None:
        return "unknown"
    return commit + ("+" if git("status", "--porcelain", "--", *measures) else "")


def write_made(lab):
    with (ROOT / MADE).open("w", encoding="utf-8", newline="") as file:
        table = csv.DictWriter(file, ["csv", "date", "build", "exact", "machine"], lineterminator="\n")
        table.writeheader()
        table.writerows(lab.made.values())


def run_commands(names):
    """Runs the commands of these tables or entries, all of them without names. Returns the names of those that failed."""
    lab, failed = Lab(ROOT), []
    wanted = {maker for name in names for maker in ([name] if name in lab.makers else lab.makers_of(name))} or set(lab.makers)
    (ROOT / "build/lab").mkdir(parents=True, exist_ok=True)
    for maker, entry in lab.makers.items():
        if maker not in wanted:
            continue
        if "command" not in entry:
            print(f"{maker}: by hand: {entry['by hand']}")
            continue
        print(f"{maker}: {entry['takes']}", flush=True)
        build = build_of(entry["measures"])
        if subprocess.run(["bash", "-euc", entry["command"]], cwd=ROOT, check=False).returncode:
            failed.append(maker)
            continue
        for path in entry["writes"]:
            lab.made[path] = {"csv": path, "date": datetime.date.today().isoformat(), "build": build, "exact": "yes",
                              "machine": machine()}
        write_made(lab)
    return failed


def write_tables():
    lab = Lab(ROOT)
    for page in pages(ROOT):
        text = page.read_text(encoding="utf-8")
        written = lab.written(text)
        if written != text:
            page.write_text(written, encoding="utf-8")
            print(page.relative_to(ROOT))


def print_ages():
    """One line for each table that is older than the sources that it measures."""
    lab = Lab(ROOT)
    for name in lab.tables:
        measures = sorted({path for maker in lab.makers_of(name) for path in lab.makers[maker]["measures"]})
        ages = []
        for path in lab.csv_of(name):
            made = lab.made[path]
            commits = git("rev-list", "--count", f"{made['build'].rstrip('+')}..HEAD", "--", *measures)
            ages.append(None if commits is None else int(commits))
        if None in ages:
            print(f"{name}: its build is no commit of this repository")
        elif max(ages):
            print(f"{name}: {max(ages)} commits of {', '.join(measures)} are newer ({lab.origin(name)})")


def print_list():
    lab = Lab(ROOT)
    for maker, entry in lab.makers.items():
        shown = [name for name in lab.tables if maker in lab.makers_of(name)]
        print(f"{maker}\n  {'command' if 'command' in entry else 'by hand'}: {entry.get('command') or entry['by hand']}\n"
              f"  takes: {entry['takes'] or 'no time of its own'}\n  tables: {', '.join(shown) or 'none; charts alone'}")


def main():
    options = [argument for argument in sys.argv[1:] if argument.startswith("-")]
    names = [argument for argument in sys.argv[1:] if not argument.startswith("-")]
    if options not in ([], ["--tables"], ["--check"], ["--list"]) or (options and names):
        print(__doc__, file=sys.stderr)
        return 64
    if options == ["--list"]:
        print_list()
        return 0
    if options == ["--check"]:
        print_ages()
        found = faults(ROOT)
        print("".join(line + "\n" for line in found), end="")
        return 1 if found else 0
    lab = Lab(ROOT)
    unknown = [name for name in names if name not in lab.makers and name not in lab.tables]
    if unknown:
        print(f"no table or command is called {unknown[0]}; --list has them", file=sys.stderr)
        return 64
    failed = [] if options else run_commands(names)
    write_tables()
    for maker in failed:
        print(f"{maker}: its command failed, the tables are as they were", file=sys.stderr)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())

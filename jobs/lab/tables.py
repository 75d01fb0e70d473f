"""Tables of pages, written from CSV.

A page has the place of a table between two lines:

    <!-- table: NAME -->
    <!-- end -->

and of a single number in a sentence: <!-- value: NAME ROW COLUMN -->2.5<!-- /value -->, with ROW and COLUMN counted from 1, or as
they are called, with _ for each blank.
"""

import csv
import json
import re
from pathlib import Path

import views

FOLDER = "docs/lab/tables"
MADE = "docs/lab/made.csv"
MANIFEST = "jobs/lab/manifest.json"
TABLE = re.compile(r"^<!-- table: (\S+) -->\n(.*?)^<!-- end -->$", re.DOTALL | re.MULTILINE)
VALUE = re.compile(r"<!-- value: (\S+) (\S+) (\S+) -->(.*?)<!-- /value -->")


class Lab:
    """What is measured, with what, and where it is shown."""

    def __init__(self, root):
        self.root = Path(root)
        manifest = json.loads((self.root / MANIFEST).read_text(encoding="utf-8"))
        self.makers, self.tables = manifest["makers"], manifest["tables"]
        self.made = {row["csv"]: row for row in self.rows(MADE)}

    def rows(self, path):
        """Rows by the names of their columns; a second column of a name is called "NAME 2"."""
        with (self.root / path).open(encoding="utf-8", newline="") as file:
            header, *rows = csv.reader(file)
        names = [name if name not in header[:i] else f"{name} {header[:i].count(name) + 1}" for i, name in enumerate(header)]
        return [dict(zip(names, row)) for row in rows]

    def csv_of(self, name):
        """The files that a table shows."""
        return self.tables[name].get("csv", [f"{FOLDER}/{name}.csv"])

    def makers_of(self, name):
        """The entries that make what a table shows."""
        return [maker for maker in self.makers if set(self.makers[maker]["writes"]) & set(self.csv_of(name))]

    def cells(self, name):
        """The table as it is shown: a list of rows, the first one the header."""
        view = self.tables[name].get("view")
        if view:
            return getattr(views, view)(*(self.rows(path) for path in self.csv_of(name)))
        with (self.root / self.csv_of(name)[0]).open(encoding="utf-8", newline="") as file:
            return list(csv.reader(file))

    def origin(self, name):
        """When, with which program and where the numbers of a table were measured, each answer once."""
        said = []
        for path in self.csv_of(name):
            made = self.made[path]
            date = made["date"] or "on a day that was not recorded"
            build = f"build {made['build']}" if made["exact"] == "yes" else f"build not recorded, at the latest {made['build']}"
            text = f"Measured {date}, {build}, {made['machine'] or 'machine not recorded'}."
            if text not in said:
                said.append(text)
        return " ".join(said)

    def markdown(self, name):
        """What stands between the two lines of a table."""
        rows = [[cell.replace("|", "\\|") for cell in row] for row in self.cells(name)]
        lines = ["| " + " | ".join(row) + " |" for row in rows]
        lines.insert(1, "|" + "---|" * len(rows[0]))
        return f"*{self.origin(name)}*\n\n" + "\n".join(line.replace("  |", " |") for line in lines) + "\n"

    def value(self, name, row, column):
        """One cell, by the words before it and above it or by its place."""
        cells = self.cells(name)

        def place(key, names):
            if key.isdigit():
                return int(key)
            names = [re.sub(r"[`*]", "", text).replace(" ", "_") for text in names]
            return names.index(key)

        return cells[place(row, [line[0] for line in cells])][place(column, cells[0])]

    def written(self, text):
        """A page with its tables and numbers anew."""
        text = TABLE.sub(lambda m: f"<!-- table: {m[1]} -->\n{self.markdown(m[1])}<!-- end -->", text)
        return VALUE.sub(lambda m: f"<!-- value: {m[1]} {m[2]} {m[3]} -->{self.value(m[1], m[2], m[3])}<!-- /value -->", text)


def pages(root):
    """All pages with text of people, relative to the root."""
    root = Path(root)
    found = [root / "README.md", root / "ARCHITECTURE.md", root / "CHANGELOG.md", *(root / "docs").rglob("*.md")]
    return sorted(page for page in found if page.exists())


def names_in(text):
    """Tables that a page shows, whole or a number of."""
    return [m[1] for m in TABLE.finditer(text)] + [m[1] for m in VALUE.finditer(text)]


def faults(root):
    """What is wrong with tables and pages: lines that name the page. Empty where all is well."""
    lab = Lab(root)
    found, shown = [], {}
    unmade = sorted({path for name in lab.tables for path in lab.csv_of(name) if path not in lab.made})
    if unmade:
        return [f"{MADE}: no row for {path}" for path in unmade]
    for page in pages(root):
        text = page.read_text(encoding="utf-8")
        path = page.relative_to(root).as_posix()
        for name in names_in(text):
            shown.setdefault(name, set()).add(path)
        unknown = [name for name in names_in(text) if name not in lab.tables]
        found += [f"{path}: no table is called {name}" for name in unknown]
        if unknown:
            continue
        if len(re.findall(r"^<!-- table:", text, re.MULTILINE)) != len(TABLE.findall(text)):
            found.append(f"{path}: a table has no end")
        for match in TABLE.finditer(text):
            if match[2] != lab.markdown(match[1]):
                found.append(f"{path}: table {match[1]} differs from {', '.join(lab.csv_of(match[1]))}; ./run lab --tables writes it")
        for match in VALUE.finditer(text):
            if match[4] != lab.value(match[1], match[2], match[3]):
                found.append(f"{path}: a number of table {match[1]} is {match[4]}, in the CSV {lab.value(match[1], match[2], match[3])}")
    for name, table in lab.tables.items():
        if set(table["pages"]) != shown.get(name, set()):
            found.append(f"{MANIFEST}: table {name} says it is on {table['pages']}, and is on {sorted(shown.get(name, []))}")
        if not lab.makers_of(name):
            found.append(f"{MANIFEST}: no entry makes table {name}")
    for maker, entry in lab.makers.items():
        missing = [path for path in [*entry["measures"], *entry["writes"]] if not (Path(root) / path).exists()]
        found += [f"{MANIFEST}: {maker} names {path}, which is not there" for path in missing]
    return found

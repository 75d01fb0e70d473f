#!/usr/bin/env python3
"""Draws docs/build/rooms.svg: the rooms (folders with sources) of two revisions, who includes whom and how large each is.

usage: rooms.py BEFORE [AFTER]     revisions in the history of this repository; AFTER: HEAD when not given

An arrow A -> B says that A includes B. An arrow that others imply (A -> C -> B) is left out, unless it is red.
"""

import io
import re
import subprocess
import sys
import tarfile
from collections import Counter
from pathlib import Path
from xml.etree import ElementTree

sys.path.insert(0, str(Path(__file__).resolve().parent))

from stacked import Stacked  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]
FIGURE = "docs/build/rooms.svg"
AREAS = ("common", "coordinator", "worker", "jobs")
MEASURES = "jobs/lab/"  # programs that measure: like tests they include rooms of every area
INCLUDE = re.compile(r'^\s*#\s*include\s*"([^"]+)"', re.MULTILINE)


# ---- rooms and arrows --------------------------------------------------------------------------------------


def is_drawn(path):
    """Whether a file of the tree is a source of a room."""
    return path.split("/")[0] in AREAS and path.endswith((".h", ".cpp")) and not path.startswith(MEASURES)


def sources_of_tree(root):
    """Path from the root -> text, of every source of a room below a folder."""
    files = (file for area in AREAS for file in (root / area).rglob("*"))
    paths = {file.relative_to(root).as_posix(): file for file in files}
    return {path: file.read_text(encoding="utf-8") for path, file in paths.items() if is_drawn(path)}


def sources_of_revision(revision):
    """The same of a revision of this repository."""
    archive = subprocess.run(["git", "-C", str(ROOT), "archive", revision], stdout=subprocess.PIPE, check=True).stdout
    with tarfile.open(fileobj=io.BytesIO(archive)) as tar:
        members = [member for member in tar if member.isfile() and is_drawn(member.name)]
        return {member.name: tar.extractfile(member).read().decode("utf-8") for member in members}


def room_of(path):
    return path.rsplit("/", 1)[0]


def area_of(room):
    return room.split("/")[0]


class Rooms:
    """The rooms of a tree, by its sources: path -> text.

    lines: room -> lines of its files, without subfolders. includes: (room, other) -> files of the one that include the other.
    circles: lists of rooms that include one another, on whatever way. arrows: pairs of `includes` that are drawn.
    up: arrows of circles from a lower room to a higher one; without them no room reaches itself.
    across: arrows from one of coordinator, worker and jobs into another: they share common alone.
    """

    def __init__(self, sources):
        lines, includes = Counter(), {}
        for path, text in sources.items():
            lines[room_of(path)] += text.count("\n")
            # A header that the build writes stands beside the files of its room.
            targets = (room_of(target) for target in INCLUDE.findall(text) if "/" in target)
            for target in {*targets} - {room_of(path)}:
                includes.setdefault((room_of(path), target), []).append(path)
        self.lines = {room: lines[room] for room in sorted(lines)}
        self.includes = {arrow: includes[arrow] for arrow in sorted(includes) if arrow[1] in lines}
        self.circles = list(self._circles())
        self.up = {arrow for circle in self.circles for arrow in self._back(circle)}
        self.across = {(a, b) for a, b in self.includes if area_of(b) not in (area_of(a), "common")}
        down = self.includes.keys() - self.up
        self.arrows = {arrow for arrow in down if not self._is_implied(arrow, down)} | self.up | self.across

    def red(self):
        """Arrows that a tree of clean layers has not, and their opposites: two arrows between two rooms are drawn as one."""
        faults = self.up | self.across
        return faults | {(a, b) for a, b in self.arrows if (b, a) in faults}

    @staticmethod
    def _reached(room, arrows):
        """Rooms that arrows lead to from this one."""
        found, left = set(), [room]
        while left:
            room = left.pop()
            new = {b for a, b in arrows if a == room} - found
            found |= new
            left += new
        return found

    def _circles(self):
        reached = {room: self._reached(room, self.includes) for room in self.lines}
        left = [room for room in self.lines if room in reached[room]]
        while left:
            circle = [room for room in left if room in reached[left[0]] and left[0] in reached[room]]
            left = [room for room in left if room not in circle]
            yield circle

    def _back(self, circle):
        """Arrows against the order in which a circle is stacked: subfolders above their folder, and among them who includes
        most and is included least above the others [Eades, Lin and Smyth 1993]."""
        top, left = [], sorted(circle)
        while left:
            deepest = max(room.count("/") for room in left)
            rooms = [room for room in left if room.count("/") == deepest]
            inside = [(a, b) for a, b in self.includes if a in rooms and b in rooms]
            free = [room for room in rooms if all(b != room for _, b in inside)]
            top.append(max(free or rooms, key=lambda room: sum((a == room) - (b == room) for a, b in inside)))
            left.remove(top[-1])
        return [(a, b) for a, b in self.includes if {a, b} <= {*circle} and top.index(a) > top.index(b)]

    def _is_implied(self, arrow, arrows):
        return any(arrow[1] in self._reached(c, arrows) for a, c in arrows if a == arrow[0] and c != arrow[1])


# ---- where they stand --------------------------------------------------------------------------------------

AREA_PER_LINE = 2.1  # of a box [px^2]
FONT_SIZE, CHARACTER, LINE_HEIGHT = 12, 6.7, 14  # [px]; CHARACTER: the mean width of a wide font


def label_of(room):
    """The name in its box, whose colour says the area."""
    return room.split("/", 1)[1] if "/" in room else f"{room} main"


def size_of(room, lines):
    """Width and height of a box: its area in proportion to its lines, but for what its name needs."""
    width = max(CHARACTER * len(label_of(room)) + 14, 1.4 * (lines * AREA_PER_LINE) ** 0.5)
    return width, max(2 * LINE_HEIGHT + 4, lines * AREA_PER_LINE / width)


def layers_of(rooms):
    """Room -> layer, 0 the lowest: above all it includes, common below all others. And the lowest layer above common."""
    down = rooms.arrows - rooms.up
    below = {room: [b for a, b in down if a == room] for room in rooms.lines}
    above = {room: [a for a, b in down if b == room] for room in rooms.lines}
    common = [room for room in rooms.lines if area_of(room) == "common"]
    layer = {}

    def place(room, lowest):
        if room not in layer:
            layer[room] = max([lowest, *(place(b, lowest) + 1 for b in below[room])])
        return layer[room]

    ground = 1 + max((place(room, 0) for room in common), default=-1)
    for room in rooms.lines:
        place(room, ground)
    # Arrows are short: a room with more arrows from above than to below stands as high as it can.
    moved = True
    while moved:
        moved = False
        for room in sorted(rooms.lines, key=layer.get, reverse=True):
            highest = min([layer[a] - 1 for a in above[room]] + [ground - 1] * (room in common), default=0)
            if len(above[room]) > len(below[room]) and highest > layer[room]:
                layer[room], moved = highest, True
    return layer, ground


# ---- the drawing -------------------------------------------------------------------------------------------

COLOURS = {"common": "#d6e6f5", "coordinator": "#fbe3c0", "worker": "#d9ecd0", "jobs": "#e6d8f1"}
GREY, RED = "#666", "#d00000"
MARGIN, HEAD, FOOT = 20, 92, 64  # [px]
LEGEND = [
    "A → B: A includes B. An arrow that others imply is left out. Red: back up, so that rooms include one another in a circle;"
    " or from one of coordinator, worker and jobs into another.",
    "Number and area of a box: lines of .h and .cpp, without subfolders (small boxes: as large as the name)."
    " Not drawn: tests, jobs/lab. Drawn by jobs/lab/rooms.py.",
]


def text(x, y, words, extra=""):
    return f'<text x="{x:.0f}" y="{y:.0f}"{extra}>{words}</text>'


class Panel:
    """A tree of rooms in layers, its lower left corner at (0, 0)."""

    def __init__(self, rooms):
        self.rooms = rooms
        layer, self.ground = layers_of(rooms)
        sizes = {room: size_of(room, lines) for room, lines in rooms.lines.items()}
        pairs = {tuple(sorted(arrow)) for arrow in rooms.arrows}
        self.placed = Stacked(sizes, layer, pairs, lambda room, k: AREAS.index(area_of(room)) if k >= self.ground else 0)
        self.width, self.height = self.placed.width, self.placed.height

    def _arrow(self, pair):
        chain, path = self.placed.chains[pair], ""
        for (x, y), (_, leaves), (x2, enters), (_, y2) in self.placed.path(pair):
            middle = (leaves + enters) / 2
            path += f"V{y:.0f}" if path else f"M{x:.0f} {y:.0f}"
            path += f"V{leaves:.0f}C{x:.0f} {middle:.0f} {x2:.0f} {middle:.0f} {x2:.0f} {enters:.0f}V{y2:.0f}"
        down, up = (chain[0], chain[-1]), (chain[-1], chain[0])
        drawn = [arrow for arrow in (down, up) if arrow in self.rooms.arrows]
        kind = "red" if self.rooms.red() & {*drawn} else "grey"
        ends = f' marker-end="url(#{kind})"' * (down in drawn) + f' marker-start="url(#{kind})"' * (up in drawn)
        titles = "; ".join(f"{a} -> {b}" for a, b in drawn)
        stroke = f'stroke="{RED}" stroke-width="1.7"' if kind == "red" else f'stroke="{GREY}"'
        return kind, f'<path class="{kind}" fill="none" {stroke}{ends} d="{path}"><title>{titles}</title></path>'

    def _box(self, room):
        (width, height), x, y = self.placed.size[room], self.placed.x[room], self.placed.top[room]
        yield f'<rect class="room" x="{x - width / 2:.0f}" y="{y:.0f}" width="{width:.0f}" height="{height:.0f}"'
        yield f' fill="{COLOURS[area_of(room)]}" stroke="#333"><title>{room}</title></rect>'
        yield text(x, y + height / 2 - 2, label_of(room), ' text-anchor="middle"')
        yield text(x, y + height / 2 + 12, f"{self.rooms.lines[room]:,}", ' text-anchor="middle" fill="#444"')

    def _summary(self):
        largest = sorted(self.rooms.lines.items(), key=lambda item: -item[1])[:3]
        names = ", ".join(f"{label_of(room)} {lines:,}" for room, lines in largest)
        yield f"{len(self.rooms.lines)} rooms, {sum(self.rooms.lines.values()):,} lines. Largest: {names}.", "#000"
        for circle in self.rooms.circles:
            lines = sum(self.rooms.lines[room] for room in circle)
            names = f"{circle[0]} and {len(circle) - 1} more" if len(circle) > 2 else " and ".join(circle)
            files = {file for arrow in self.rooms.up if arrow[0] in circle for file in self.rooms.includes[arrow]}
            by = files.pop() if len(files) == 1 else f"{len(files)} files"
            yield f"A circle of {lines:,} lines: {names}. What includes upwards: {by}.", RED
        for other in sorted({b for _, b in self.rooms.across}):
            names = ", ".join(sorted(a for a, b in self.rooms.across if b == other))
            yield f"{other} is included by {names}.", RED

    def svg(self, name, title, x, y, head):
        """The panel as a group with its lower left corner at (x, y), its title at height `head`."""
        band = -(self.placed.rows[self.ground][1] + self.placed.rows[self.ground - 1][0]) / 2
        yield f'<g id="{name}" transform="translate({x:.0f} {y:.0f})">'
        yield f'<rect x="-8" y="{-band:.0f}" width="{self.width + 16:.0f}" height="{band + 8:.0f}" fill="#f2f6fa"/>'
        yield text(0, 0, "common", ' font-size="16" fill="#789"')
        yield text(0, head - y, title, ' font-size="18" font-weight="bold"')
        for i, (line, colour) in enumerate(self._summary()):
            yield text(0, head - y + 20 + 16 * i, line, f' font-size="13" fill="{colour}"')
        # Red over grey.
        yield from (path for _, path in sorted(self._arrow(pair) for pair in self.placed.chains))
        for room in self.rooms.lines:
            yield "".join(self._box(room))
        yield "</g>"


def drawing(before, after):
    """The SVG of two trees, each as (name of its revision, Rooms)."""
    panels = [(name, Panel(rooms)) for name, rooms in (before, after)]
    width = sum(panel.width for _, panel in panels) + 4 * MARGIN
    height = max(panel.height for _, panel in panels) + HEAD + FOOT
    out = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:.0f} {height:.0f}" width="{width:.0f}"'
        f' height="{height:.0f}" font-family="sans-serif" font-size="{FONT_SIZE}">',
        "<defs>",
    ]
    for kind, colour, size in (("grey", GREY, 8), ("red", RED, 10)):
        out.append(f'<marker id="{kind}" viewBox="0 0 8 8" refX="8" refY="4" markerWidth="{size}" markerHeight="{size}"')
        out.append(f' markerUnits="userSpaceOnUse" orient="auto-start-reverse"><path d="M0 0L8 4L0 8z" fill="{colour}"/></marker>')
    out += ["</defs>", '<rect width="100%" height="100%" fill="#fff"/>']
    x = MARGIN
    for which, (name, panel) in zip(("before", "after"), panels):
        out += panel.svg(which, f"{which.capitalize()} ({name})", x, height - FOOT, MARGIN + 8)
        x += panel.width + 2 * MARGIN
    for i, (area, colour) in enumerate(COLOURS.items()):
        at = width - 4 * 110 - MARGIN + 110 * i
        out.append(f'<rect x="{at:.0f}" y="{MARGIN - 5}" width="18" height="14" fill="{colour}" stroke="#333"/>')
        out.append(text(at + 24, MARGIN + 7, area, ' font-size="13"'))
    out += [text(MARGIN, height - FOOT + 30 + 18 * i, line, ' font-size="13"') for i, line in enumerate(LEGEND)]
    return "\n".join([*out, "</svg>", ""])


def drawn_after(svg):
    """What the later panel of a drawing shows: its rooms, and arrow -> whether it is red."""
    panel = ElementTree.fromstring(svg).find(".//*[@id='after']")
    rooms, arrows = set(), {}
    for mark in panel.iter():
        titles = [child.text for child in mark if child.tag.endswith("title")]
        if mark.get("class") == "room":
            rooms |= {*titles}
        for arrow in (arrow for title in titles for arrow in title.split("; ") if "->" in arrow):
            arrows[tuple(arrow.split(" -> "))] = mark.get("class") == "red"
    return rooms, arrows


def main():
    if not 2 <= len(sys.argv) <= 3:
        print(__doc__, file=sys.stderr)
        return 64
    trees = []
    for revision in (sys.argv[1], *(sys.argv[2:] or ["HEAD"])):
        command = ["git", "-C", str(ROOT), "rev-parse", "--quiet", "--verify", "--short=7", f"{revision}^{{commit}}"]
        name = subprocess.run(command, stdout=subprocess.PIPE)
        if name.returncode != 0:
            print(f"rooms.py: {revision}: expected a revision in the history of {ROOT}", file=sys.stderr)
            return 1
        trees.append((name.stdout.decode().strip(), Rooms(sources_of_revision(revision))))
    (ROOT / FIGURE).write_text(drawing(*trees), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())

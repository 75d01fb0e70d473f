#!/usr/bin/env python3
"""docs/first-day.md is true: every command of the page runs, in its order, and says what stands there but for numbers.

With --record FOLDER the page's commands run there in the page's own sizes, and what they say is written into the page.
"""

import json
import math
import os
import re
import subprocess
import sys
from array import array
from pathlib import Path

from assets import sphere, write_exr, write_mesh
from farm import DEADLINE_S, OK, Programs, check, check_equal, run_tests

SOURCE = Path(__file__).resolve().parents[2]
PAGE = SOURCE / "docs/first-day.md"
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.DOTALL | re.MULTILINE)
# The page's sizes would take minutes.
SMALL = {"width": 120, "height": 68, "tileSize": 32, "sites": 1}


def steps_of(text):
    """(kind, body, start, end) of each block of the page: "console" is commands and what they say, "NAME.json" a job, whose
    name stands before it."""
    steps = []
    for match in BLOCK.finditer(text):
        kind = match[1]
        if kind == "json":
            kind = re.findall(r"`(\w+\.json)`:", text[:match.start()])[-1]
        steps.append((kind, match[2], match.start(2), match.end(2)))
    return steps


def commands_of(body):
    """[command, what it says] of a console block."""
    commands = []
    for line in body.splitlines():
        if line.startswith("$ "):
            commands.append([line[2:], ""])
        elif commands:
            commands[-1][1] += line + "\n"
    return commands


def run_command(command, programs, folder):
    environment = {**os.environ, "PATH": f"{programs.bin}:{os.environ['PATH']}"}
    done = subprocess.run(["bash", "-c", command], cwd=folder, env=environment, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, text=True, timeout=DEADLINE_S, check=False)
    return done.returncode, done.stdout.replace(str(folder), "/show").replace(str(folder.resolve()), "/show")


def shown(output):
    """What the page shows of what is said: no progress, no news, no times of a log."""
    lines = [re.sub(r"^\d{4}-\d\d-\d\dT[\d:.+-]+ baton ", "", line) for line in output.splitlines()]
    return [line for line in lines if line and not re.match(r"frames \d+/|info: ", line)]


def shape(output):
    """The kinds of lines, without numbers and units, each once, in order."""
    lines = []
    for line in shown(output):
        line = re.sub(r"[+-]?\d[\d.,:e+-]*( ?(KiB|MiB|GiB|B|%|ms|s|m\d\ds|k|M|G)\b)?%?", "#", line)
        line = re.sub(r"\b[0-9a-f]{8,}\b", "#", line)
        line = re.sub(r" +", " ", line).strip()
        if line not in lines:
            lines.append(line)
    return lines


def may_differ(line, kinds):
    """Lines that depend on the picture: their kind must be there, if it always is."""
    kind = line.split(" ")[0]
    if kind in ("stands", "below", "afresh", "warning", "warning:"):
        return True
    return kind in ("noise", "rays", "pixels", "state", "object", "geometry", "image", "tasks", "sheet") and kind in kinds


def stand_ins(folder):
    """Meshes and a map under the names of those that the page takes from Debian packages."""
    for name in re.findall(r"([\w-]+\.off)\b", PAGE.read_text(encoding="utf-8")):
        write_mesh(folder / name, *sphere(rings=12, segments=16))
    width = 32
    lamp, sky = (40.0, 36.0, 30.0), (0.3, 0.4, 0.6)
    rows = [array("f", [c for x in range(width) for c in (lamp if (x, y) in ((8, 4), (9, 4)) else sky)])
            for y in range(width // 2)]
    for name in re.findall(r'"map": "(\w+)\.exr"', PAGE.read_text(encoding="utf-8")):
        write_exr(folder / f"{name}.exr", width, rows)


def _check_every_command(programs, folder):
    folder.mkdir(parents=True)
    stand_ins(folder)
    num_commands = 0
    for kind, body, _, _ in steps_of(PAGE.read_text(encoding="utf-8")):
        if kind.endswith(".json"):
            job = json.loads(body)
            job["image"] = {**job["image"], **SMALL}
            (folder / kind).write_text(json.dumps(job, separators=(", ", ": ")), encoding="utf-8")
        if kind != "console":
            continue
        for command, said in commands_of(body):
            num_commands += 1
            if re.match(r"tar |cp /usr", command):
                continue
            code, output = run_command(command, programs, folder)
            check_equal(code, OK, f"exit code of {command!r}, which says\n{output}")
            # Numbers of a small picture may leave out a line, such as frames that stand out, or bring one more.
            kinds = {line.split(" ")[0] for line in shape(output)}
            wrong = [line for line in shape(said) if line not in shape(output) and not may_differ(line, kinds)]
            check(not wrong, f"$ {command}\nthe page has {wrong}, but it says\n{output}")
    check(num_commands >= 10, f"the page has {num_commands} commands: it is not read as it should be")


def the_expression_of_the_page_is_one(programs, folder):
    """What a compositor would compute: the fog of the page grows with depth, and leaves what has no surface alone."""
    _check_every_command(programs, folder)
    text = PAGE.read_text(encoding="utf-8")
    expression = re.search(r"^```\nr = (.*?)\n", text, re.MULTILINE)
    check(expression is not None, "the page has no expression r = ...")
    frame = sorted((folder / "frames").glob("*.exr"))[0]
    names = {"exp": math.exp}
    planes = [programs.values(frame, channel) for channel in ("R", "depth")]
    fogged = [eval(expression[1], {**names, "r": r, "depth": depth}) for r, depth in zip(*planes)]
    far = [(depth, new) for depth, new in zip(planes[1], fogged) if depth > 0]
    check(far and all(math.isfinite(new) for _, new in far), "the expression is not finite")
    check(all(new == r for r, depth, new in zip(*planes, fogged) if depth == 0), "what has no surface is fogged")
    check(any(new != r for r, new in zip(planes[0], fogged)), "nothing is fogged")


def links_lead_to_the_page(programs, folder):
    for page in ("README.md", "docs/README.md"):
        check("first-day.md" in (SOURCE / page).read_text(encoding="utf-8"), f"{page} does not name it")
    # Whoever reads README's first screen knows what is not rendered.
    screen = "\n".join((SOURCE / "README.md").read_text(encoding="utf-8").splitlines()[:40])
    check("## What it renders" in screen and screen.count("*Not*") >= 3, "README does not say what is not rendered")


def _record(programs, folder):
    """Runs the commands of the page in `folder` and writes what they say into it."""
    folder.mkdir(parents=True, exist_ok=True)
    text = PAGE.read_text(encoding="utf-8")
    parts, at = [], 0
    for kind, body, start, end in steps_of(text):
        if kind.endswith(".json"):
            (folder / kind).write_text(body, encoding="utf-8")
        if kind != "console":
            continue
        said = ""
        for command, _ in commands_of(body):
            code, output = run_command(command, programs, folder)
            said += f"$ {command}\n" + "".join(line + "\n" for line in shown(output))
            if code != OK:
                sys.exit(f"{command}: exit code {code}\n{output}")
        parts += [text[at:start], said]
        at = end
    PAGE.write_text("".join(parts) + text[at:], encoding="utf-8")


if __name__ == "__main__":
    if "--record" in sys.argv:
        _record(Programs(sys.argv[sys.argv.index("--bin") + 1]), Path(sys.argv[sys.argv.index("--record") + 1]))
    else:
        run_tests()

#!/usr/bin/env python3
"""Checks the pages: tables and numbers are those of their CSV files, links lead somewhere, files that are
named exist, and pages are short enough.

usage: check_pages.py [ROOT]      print every fault as page: what, exit 1 when there is any
       check_pages.py --self-test plant one fault of each kind in a small tree and see it found
"""

import json
import re
import sys
import tempfile
from pathlib import Path

sys.dont_write_bytecode = True
sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "jobs/lab"))

import checker  # noqa: E402
import tables  # noqa: E402

USER_WORDS, ARCHITECTURE_WORDS, PAGE_WORDS = 20000, 1200, 2400
LINK = re.compile(r"!?\[[^\]]*\]\(([^)\s]+)\)")
# A file of the tree that a sentence names.
FILE = re.compile(r"`((?:common|worker|coordinator|jobs|tests|docker|docs)/[\w/.-]*\.[a-z]+)`")
FENCE = re.compile(r"^```.*?^```$", re.DOTALL | re.MULTILINE)
# Folders whose Markdown files are pages, too.
FOLDERS = ["docs", "docker", "common", "jobs", "tests"]


def anchors_of(text):
    """What # of a link may name: headings in small letters, as GitHub writes them."""
    found = set()
    for heading in re.findall(r"^#+ (.*)$", FENCE.sub("", text), re.MULTILINE):
        heading = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading.strip()).lower()
        found.add(re.sub(r"[^\w\- ]", "", heading).replace(" ", "-"))
    return found


def link_faults(root, page):
    """Yields what is wrong with the links of a page."""
    path = page.relative_to(root).as_posix()
    for link in LINK.findall(FENCE.sub("", page.read_text(encoding="utf-8"))):
        if re.match(r"\w+:", link):
            continue
        target, _, anchor = link.partition("#")
        file = (page.parent / target).resolve() if target else page
        if not file.exists():
            yield f"{path}: {link} leads nowhere"
        elif anchor and anchor not in anchors_of(file.read_text(encoding="utf-8")):
            yield f"{path}: {link}: no heading of that name"


def file_faults(root, page):
    """Yields which files a page names that are not there."""
    for name in FILE.findall(page.read_text(encoding="utf-8")):
        if not (root / name).exists():
            yield f"{page.relative_to(root).as_posix()}: names {name}, which is not there"


def words_of(*files):
    return sum(len(file.read_text(encoding="utf-8").split()) for file in files)


def length_faults(root):
    """Yields which pages are too long."""
    users = sorted((root / "docs").glob("*.md"))
    if words_of(*users) > USER_WORDS:
        yield f"docs: the pages of users have {words_of(*users)} words, at most {USER_WORDS}"
    for page in users:
        if words_of(page) > PAGE_WORDS:
            yield f"docs/{page.name}: {words_of(page)} words, at most {PAGE_WORDS}"
    architecture = root / "ARCHITECTURE.md"
    if architecture.exists() and words_of(architecture) > ARCHITECTURE_WORDS:
        yield f"ARCHITECTURE.md: {words_of(architecture)} words, at most {ARCHITECTURE_WORDS}"


# Numbers of the code that pages say: page, what is said, source, what it is there.
SAID = [
    ("common/protocol/PROTOCOL.md", r"version is (\d+)", "common/protocol/messages.h", r"kProtocolVersion = (\d+)"),
    ("CHANGELOG.md", r"Protocol (\d+)", "common/protocol/messages.h", r"kProtocolVersion = (\d+)"),
    ("CHANGELOG.md", r"journal (\d+)", "coordinator/journal/schema.h", r"kSchemaVersion = (\d+)"),
]


def number_faults(root):
    """Yields which pages say another number than the code."""
    for page, said, source, meant in SAID:
        if not ((root / page).exists() and (root / source).exists()):
            continue
        says = re.search(said, (root / page).read_text(encoding="utf-8"))
        is_in = re.search(meant, (root / source).read_text(encoding="utf-8"))
        if not (says and is_in and says[1] == is_in[1]):
            yield f"{page}: says {says[0] if says else 'nothing'}, {source} {is_in[0] if is_in else 'nothing'}"


# A row of the table of rights, in the code and on the page: the message, and what each role may.
RIGHT = re.compile(r'kRights<(\w+)>\s+\{"[^"]+",' + r"\s*May::(\w+),?" * 4)
SAID_RIGHT = re.compile(r"^\| `(\w+)`" + r" \| (no|own|yes)" * 4 + r" \|$", re.MULTILINE)


def right_faults(root):
    """Yields what SECURITY.md says otherwise of the rights of keys than the program has them."""
    page, source = root / "SECURITY.md", root / "coordinator/service/permissions.h"
    if not (page.exists() and source.exists()):
        return
    said = {row[0]: row[1:] for row in SAID_RIGHT.findall(page.read_text(encoding="utf-8"))}
    meant = {row[0]: row[1:] for row in RIGHT.findall(source.read_text(encoding="utf-8"))}
    for message in sorted({*said, *meant}):
        if said.get(message) != meant.get(message):
            yield f"SECURITY.md: {message}: says {said.get(message)}, permissions.h {meant.get(message)}"
    if not meant:
        yield "coordinator/service/permissions.h: no table of rights"


def faults(root):
    root = root.resolve()
    linked = {*tables.pages(root), *root.glob("SECURITY.md"), *(page for folder in FOLDERS for page in (root / folder).rglob("*.md"))}
    found = [*tables.faults(root), *length_faults(root), *number_faults(root), *right_faults(root)]
    for page in sorted(linked):
        found += [*link_faults(root, page), *file_faults(root, page)]
    return found


# ---- faults on purpose -------------------------------------------------------------------------------------

PAGE = """# A page

<!-- table: times -->
*Measured 2026-01-02, build 1234567, a machine.*

| method | time |
|---|---|
| `pool` | 2.5 |
<!-- end -->

It takes <!-- value: times pool time -->2.5<!-- /value --> s ([this](#a-page), [that](lab/other.md#the-other)).
"""
TREE = {
    "docs/page.md": PAGE,
    "docs/lab/other.md": "# The other\n",
    "docs/lab/tables/times.csv": "method,time\n`pool`,2.5\n",
    "docs/lab/made.csv": "csv,date,build,exact,machine\ndocs/lab/tables/times.csv,2026-01-02,1234567,yes,a machine\n",
    "jobs/lab/manifest.json": json.dumps({
        "makers": {"clock": {"by hand": "a clock", "takes": "", "writes": ["docs/lab/tables/times.csv"], "measures": ["docs"]}},
        "tables": {"times": {"pages": ["docs/page.md"]}}}),
    "ARCHITECTURE.md": "# How it is built\n",
    "common/protocol/PROTOCOL.md": "# The protocol\n\nversion is 7\n",
    "common/protocol/messages.h": "kProtocolVersion = 7;\n",
    "SECURITY.md": "| `Look` | no | yes | own | yes |\n",
    "coordinator/service/permissions.h": 'kRights<Look> {"look", May::no, May::yes, May::own, May::yes};\n',
}
# A planted fault: file, what is replaced, by what, and what the message must contain.
PLANTED = [
    ("docs/page.md", "| 2.5 |", "| 2.4 |", "table times differs"),
    ("docs/page.md", "2026-01-02", "2026-01-03", "table times differs"),
    ("docs/page.md", "-->2.5<!--", "-->2.4<!--", "a number of table times is 2.4"),
    ("docs/page.md", "<!-- end -->", "", "a table has no end"),
    ("docs/page.md", "table: times", "table: hours", "no table is called hours"),
    ("docs/lab/tables/times.csv", "2.5", "2.6", "table times differs"),
    ("docs/lab/made.csv", "times.csv", "hours.csv", "no row for docs/lab/tables/times.csv"),
    ("docs/page.md", "lab/other.md", "lab/another.md", "leads nowhere"),
    ("docs/page.md", "# A page\n", "# A page\n\n`worker/gone.h`\n", "names worker/gone.h"),
    ("docs/page.md", "#the-other", "#the-end", "no heading of that name"),
    ("docs/page.md", "# A page\n", "# A page\n" + "word " * (PAGE_WORDS + 1), f"words, at most {PAGE_WORDS}"),
    ("ARCHITECTURE.md", "# How", "word " * ARCHITECTURE_WORDS + "# How", f"at most {ARCHITECTURE_WORDS}"),
    ("common/protocol/messages.h", "= 7", "= 8", "says version is 7"),
    ("SECURITY.md", "| own |", "| yes |", "Look: says"),
    ("coordinator/service/permissions.h", "<Look>", "<Change>", "Change: says None"),
    ("jobs/lab/manifest.json", '"measures": ["docs"]', '"measures": ["gone"]', "names gone, which is not there"),
    ("jobs/lab/manifest.json", '"docs/page.md"', '"docs/lab/other.md"', "says it is on"),
    ("jobs/lab/manifest.json", '"docs/lab/tables/times.csv"], "measures"', '"docs/lab/made.csv"], "measures"', "no entry makes"),
]


def plant(root, path, old, new):
    for name, text in TREE.items():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(text.replace(old, new) if name == path else text, encoding="utf-8")


def self_test():
    """Plants each fault alone, and none. Returns how many were not found."""
    missed = 0
    for path, old, new, expected in [("", "", "", ""), *PLANTED]:
        with tempfile.TemporaryDirectory() as folder:
            plant(Path(folder), path, old, new)
            found = faults(Path(folder))
        if not (any(expected in fault for fault in found) if expected else not found):
            missed += 1
            print(f"self-test: {path}: expected {expected!r}, got {found}")
    # All pages together: none of them too long.
    with tempfile.TemporaryDirectory() as folder:
        plant(Path(folder), "", "", "")
        for i in range(USER_WORDS // PAGE_WORDS + 1):
            (Path(folder) / f"docs/{i}.md").write_text("word " * PAGE_WORDS, encoding="utf-8")
        found = faults(Path(folder))
    if not any(f"at most {USER_WORDS}" in fault for fault in found):
        missed += 1
        print(f"self-test: expected too many words, got {found}")
    print(f"self-test: {len(PLANTED) + 2 - missed} of {len(PLANTED) + 2} as expected")
    return missed


if __name__ == "__main__":
    sys.exit(checker.run(__doc__, self_test, faults))

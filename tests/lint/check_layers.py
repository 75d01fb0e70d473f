#!/usr/bin/env python3
"""Checks who includes whom, where third-party libraries appear, and a few rules of the house.

usage: check_layers.py [ROOT]      print every violation as file:line: what, exit 1 when there is any
       check_layers.py --self-test plant one fault of each kind in a temporary tree and see it found
"""

import re
import sys
import tempfile
from pathlib import Path

sys.dont_write_bytecode = True

import checker  # noqa: E402

# Room -> rooms whose headers it may include besides its own. A room is a folder with sources. No rules go in a circle.
COMMON_BASE = {"common/base"}
COMMON_DATA = COMMON_BASE | {"common/math"}
JOB = COMMON_DATA | {"common/job"}
PLAN = JOB | {"common/state", "common/job/plan"}
TEXT = PLAN | {"common/job/text"}
COMMON_ALL = TEXT | {"common/advice", "common/image", "common/store", "common/protocol"}
SCENE_PARTS = {f"common/scene/{part}" for part in ["mesh", "texture", "gltf", "map", "material"]}
SCENE = PLAN | {"common/image", "common/scene"} | SCENE_PARTS
ACCEL = SCENE | {"worker/surface"}
LIGHT = ACCEL | {"common/advice", "worker/sampling"}
METHOD = LIGHT | {"worker/accel", "worker/light"}
METHOD_FOLDERS = (Path(__file__).parents[2] / "worker/method").glob("*/")
METHOD_ROOMS = {f"worker/method/{folder.name}" for folder in METHOD_FOLDERS if folder.is_dir()}
# What several methods are made of. Passes know those that have to do with history and second pass alone.
METHOD_LIBRARIES = {f"worker/method/{library}" for library in ("carried", "chosen", "fresh", "weighted")}
METHODS = METHOD_ROOMS - METHOD_LIBRARIES - {"worker/method/list"}
PASS = METHOD | {"common/job/text", "worker/bounce", "worker/method", "worker/method/carried", "worker/method/weighted"}
EXCHANGE = PASS | {"worker/pass"}
RUN = EXCHANGE | {"common/protocol", "common/store", "common/scene/settle", "worker/exchange"}
# Programs that measure look into every room of the worker, and share scenes and statistics with the tests.
LAB = RUN | METHOD_ROOMS | {"worker/run", "jobs/study", "tests/support", "tests/stat"}
# Families of commands, and what they share.
CLI = COMMON_ALL | {"common/scene/settle", "jobs/study", "jobs/auto", "jobs/trace"}

MAY_INCLUDE = {
    "common/base": set(),
    "common/math": COMMON_BASE,
    "common/job": COMMON_DATA,
    "common/job/plan": JOB | {"common/state"},  # how large a state is
    "common/job/text": PLAN,
    "common/advice": PLAN,
    "common/state": JOB,
    "common/image": JOB,
    "common/store": COMMON_BASE,
    "common/protocol": JOB,
    "common/scene/mesh": COMMON_DATA,
    "common/scene/texture": COMMON_BASE | {"common/image", "common/scene/texture/reader"},
    "common/scene/texture/reader": set(),
    "common/scene/gltf": TEXT | {"common/scene/mesh"},
    "common/scene/map": PLAN | {"common/image"},
    "common/scene/material": COMMON_DATA
    | {"common/job", "common/scene/mesh", "common/scene/texture", "common/scene/gltf"},
    "common/scene": PLAN | {"common/image"} | SCENE_PARTS,
    "common/scene/settle": COMMON_DATA | {"common/job", "common/scene", "common/scene/gltf"},
    "worker/sampling": COMMON_DATA | {"common/job", "common/state"},
    "worker/surface": SCENE,
    "worker/accel": ACCEL,
    "worker/light": LIGHT,
    "worker/bounce": METHOD,
    "worker/method": METHOD,
    "worker/method/weighted": METHOD | {"worker/method"},
    "worker/method/carried": METHOD | {"worker/method"},
    "worker/method/chosen": METHOD | {"worker/method"},
    "worker/method/fresh": METHOD | {"worker/method", "worker/method/weighted"},
    **{method: METHOD | {"worker/method"} | METHOD_LIBRARIES for method in METHODS},
    "worker/method/list": METHOD | {"worker/method"} | METHOD_ROOMS,
    "worker/pass": PASS,
    "worker/exchange": EXCHANGE,
    "worker/run": RUN,
    "worker": COMMON_BASE | {"worker/run"},
    "coordinator/schedule": TEXT,
    "coordinator/journal": TEXT | {"coordinator/schedule"},
    "coordinator/service": TEXT | {"common/protocol", "common/store", "coordinator/schedule", "coordinator/journal"},
    "coordinator": COMMON_ALL | {"coordinator/schedule", "coordinator/journal", "coordinator/service"},
    "jobs/study": TEXT | {"common/image", "common/protocol"},
    "jobs/auto": TEXT | {"jobs/study", "common/scene", "common/scene/mesh"},  # how large a scene is
    "jobs/slurm": COMMON_BASE,
    "jobs/trace": COMMON_BASE,
    **{f"jobs/lab/{folder}": LAB for folder in ("peers", "stability", "studies")},
    "jobs/cli": CLI,
    "jobs/cli/check": CLI | {"jobs/cli", "common/scene", "common/scene/map", "common/scene/mesh"},  # it loads the scene
    "jobs/cli/render": CLI | {"jobs/cli", "jobs/cli/check"},  # what is rendered is checked before
    "jobs/cli/farm": CLI | {"jobs/cli", "jobs/cli/render", "jobs/slurm"},
    "jobs/cli/look": COMMON_ALL | {"jobs/cli"},
    "jobs/cli/compare": CLI | {"jobs/cli"},
}

# Library, by how its headers are spelled -> files that may include them (prefix of the path).
THIRD_PARTY = {
    r"embree3/": ["worker/accel/"],
    r"OpenImageIO/": ["common/scene/texture/reader/"],
    r"OpenEXR/|Imath/|png\.h": ["common/image/"],
    r"zmq": ["common/protocol/"],
    r"sqlite3": ["coordinator/journal/"],
    r"zstd|xxhash": ["common/base/"],
    r"nlohmann/": ["common/job/text/job_json", "jobs/cli/", "jobs/lab/", "jobs/study/", "jobs/trace/", "common/scene/gltf/json_view"],
    r"CLI/": ["worker/main.cpp", "coordinator/main.cpp", "jobs/cli/", "jobs/lab/"],
}

# Assembled from pieces, so that this file does not find itself.
FORBIDDEN = ["TO" + "DO", "FIX" + "ME", "ffast" + "-math", "GTEST" + "_SKIP", "#if" + " 0"]

MAX_SCRIPT_LINES = 400  # of sources check_shape.py measures functions and classes
SOURCE_FOLDERS = ["common", "worker", "coordinator", "jobs", "tests", "cmake"]
CODE = {".h", ".cpp"}
TEXT = CODE | {".py", ".cmake", ".sh", ".txt"}
LONG_ASIDE = re.compile(r"///< .{41}")
INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]')


def circle_in(rules):
    """Rooms whose rules lead back to themselves."""
    left = {room: others - {room} for room, others in rules.items()}
    while free := {room for room, others in left.items() if not others & left.keys()}:
        left = {room: others for room, others in left.items() if room not in free}
    return sorted(left)


def room_of(path):
    """Folder of a path relative to the root: the room it belongs to."""
    return path.rsplit("/", 1)[0] if "/" in path else ""


def check_includes(path, lines, known_files):
    """Yields (line number, message) for every include that crosses the layer rule."""
    room = room_of(path)
    ruled = not path.startswith("tests/")
    if ruled and room not in MAY_INCLUDE:
        yield 1, f"folder {room} has no layer rule in check_layers.py"
        return
    own_header = path[:-4] + ".h"
    has_own_header = path.endswith(".cpp") and own_header in known_files
    first = True
    for number, line in enumerate(lines, 1):
        match = INCLUDE.match(line)
        if not match:
            continue
        quote, target = match.groups()
        if first and has_own_header and target != own_header:
            yield number, f"includes {target} first, expected its own header {own_header}"
        first = False
        if not ruled:
            continue
        if quote == "<":
            yield from ((number, message) for message in check_third_party(path, target))
        elif "/" not in target:
            yield number, f'"{target}": expected a path from the root'
        else:
            target_room = room_of(target)
            if target_room != room and target_room not in MAY_INCLUDE[room]:
                yield number, f"{room} may not include {target}"


def check_third_party(path, target):
    """Yields a message when a library header is included outside its place."""
    for pattern, places in THIRD_PARTY.items():
        if re.match(pattern, target) and not any(path.startswith(place) for place in places):
            yield f"includes <{target}>, allowed only in {', '.join(places)}"


def check_text(path, lines):
    """Yields (line number, message) for length and forbidden words."""
    if Path(path).suffix not in CODE and len(lines) > MAX_SCRIPT_LINES:
        yield MAX_SCRIPT_LINES + 1, f"{len(lines)} lines, at most {MAX_SCRIPT_LINES}"
    for number, line in enumerate(lines, 1):
        for word in FORBIDDEN:
            if word in line:
                yield number, f"contains {word!r}"
        if Path(path).suffix in CODE and LONG_ASIDE.search(line):
            yield number, "a member's comment longer than 40 characters stands above it"


def violations(root):
    """All violations of the tree as 'file:line: message', sorted by file."""
    files = []
    for folder in SOURCE_FOLDERS:
        files += [p for p in (root / folder).rglob("*") if p.is_file() and p.suffix in TEXT]
    known = frozenset(p.relative_to(root).as_posix() for p in files)
    found = []
    for file in sorted(files):
        path = file.relative_to(root).as_posix()
        lines = file.read_text(encoding="utf-8").splitlines()
        checks = list(check_text(path, lines))
        if file.suffix in CODE:
            checks += check_includes(path, lines, known)
        found += [f"{path}:{number}: {message}" for number, message in checks]
    return found


# A planted fault: file, text, and what the message must contain.
PLANTED = [
    ("worker/sampling/a.cpp", '#include "common/scene/scene.h"\n', "may not include common/scene/scene.h"),
    ("jobs/cli/a.cpp", '#include "worker/surface/bsdf.h"\n', "may not include worker/surface/bsdf.h"),
    ("jobs/cli/b.cpp", '#include "jobs/cli/look/x.h"\n', "may not include jobs/cli/look/x.h"),
    ("jobs/cli/render/a.cpp", '#include "jobs/cli/farm/x.h"\n', "may not include jobs/cli/farm/x.h"),
    ("jobs/auto/a.cpp", '#include "worker/accel/accel.h"\n', "may not include worker/accel/accel.h"),
    ("coordinator/schedule/a.cpp", '#include "common/scene/scene.h"\n', "may not include common/scene/scene.h"),
    ("coordinator/a.cpp", '#include "common/scene/mesh/x.h"\n', "may not include common/scene/mesh/x.h"),
    ("common/scene/mesh/a.cpp", '#include "common/scene/scene.h"\n', "may not include common/scene/scene.h"),
    ("common/scene/gltf/a.cpp", '#include "common/scene/material/x.h"\n', "may not include common/scene/material"),
    ("common/scene/a.cpp", '#include "common/scene/settle/x.h"\n', "may not include common/scene/settle"),
    ("worker/run/a.cpp", '#include "coordinator/schedule/x.h"\n', "may not include coordinator"),
    ("coordinator/service/a.cpp", '#include "worker/run/x.h"\n', "may not include worker"),
    ("common/base/a.cpp", '#include "common/math/vec3.h"\n', "may not include common/math"),
    ("worker/pass/a.cpp", "#include <embree3/rtcore.h>\n", "<embree3/rtcore.h>"),
    ("common/job/a.cpp", "#include <nlohmann/json.hpp>\n", "<nlohmann/json.hpp>"),
    ("coordinator/service/b.cpp", "#include <zmq.hpp>\n", "<zmq.hpp>"),
    ("common/base/b.cpp", '#include "files.h"\n', "expected a path from the root"),
    ("worker/run/clean.cpp", '#include "worker/pass/x.h"\n#include <vector>\n', ""),
    ("common/math/b.cpp", "int x;  // " + FORBIDDEN[0] + "\n", FORBIDDEN[0]),
    ("cmake/b.cmake", "set(x -" + FORBIDDEN[2] + ")\n", FORBIDDEN[2]),
    ("tests/system/long.py", "\n" * (MAX_SCRIPT_LINES + 1), f"at most {MAX_SCRIPT_LINES}"),
    ("worker/accel/long.cpp", "\n" * (MAX_SCRIPT_LINES + 1), ""),
    ("worker/accel/aside.h", "int x;  ///< " + "a" * 41 + "\n", "stands above it"),
    ("worker/accel/short.h", "int x;  ///< " + "a" * 40 + "\n", ""),
    ("worker/new_room/a.cpp", "int x;\n", "no layer rule"),
]


def self_test():
    """Plants each fault alone in a clean tree. Returns the number of faults that were not found."""
    missed = 0
    for path, text, expected in PLANTED + [("common/state/own.cpp", "#include <vector>\n", "first, expected")]:
        with tempfile.TemporaryDirectory() as folder:
            root = Path(folder)
            (root / "common/state").mkdir(parents=True)
            (root / "common/state/own.h").write_text("#pragma once\n")
            (root / path).parent.mkdir(parents=True, exist_ok=True)
            (root / path).write_text(text)
            found = violations(root)
            good = len(found) == 1 and expected in found[0] if expected else not found
            if not good:
                missed += 1
                print(f"self-test: {path}: expected one violation with {expected!r}, got {found}")
    circle = MAY_INCLUDE | {"common/scene/mesh": {"common/scene/settle"}}
    if "common/scene/mesh" not in circle_in(circle) or circle_in(MAY_INCLUDE):
        missed += 1
        print(f"self-test: expected no circle but a planted one, got {circle_in(MAY_INCLUDE)}, {circle_in(circle)}")
    print(f"self-test: {len(PLANTED) + 2 - missed} of {len(PLANTED) + 2} as expected")
    return missed


if __name__ == "__main__":
    sys.exit(checker.run(__doc__, self_test, violations))

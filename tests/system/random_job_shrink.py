"""Makes a failing case smaller while it fails in the same way: greedy, to a fixed point or a deadline. Standard library
only."""

import copy
import time

# Simplest forms, by key: tried in this order before a key is dropped.
SIMPLER = {
    "frames": ["1", "1-2", "1-3", "1-4"],
    "width": [1, 2, 8, 9, 16, 17], "height": [1, 2, 8, 9, 16, 17],
    "numParticles": [1, 2, 3, 4, 8, 9, 16], "numCandidates": [1, 2, 8, 16, 64],
    "sites": [1, 4], "partitions": [1, 2], "referenceSamples": [2],
    "workers": [1], "threads": [1], "tileSize": [32768, 64, 8], "checkpointEvery": [12, 1], "compression": ["none"],
}
# Simplest recipes of files.
PLAIN_MESH = {"kind": "card"}
PLAIN_MAP = {"kind": "flat", "width": 1, "height": 1}
# What a job costs much more without: defaults are large pictures.
NEVER_DROPPED = {("job", "image"), ("job", "image", "width"), ("job", "image", "height"), ("job", "name")}
# What the second rendering need not have.
OPTIONAL = ("interruption", "compression", "memory")


def shrink(case, fails, seconds, clock=time.monotonic):
    """The smallest case that was found in the time. fails(case) -> whether it still fails in the same way."""
    end = clock() + seconds
    changed = True
    while changed:
        changed = False
        for path, make in smaller_forms(case):
            if clock() > end:
                return case
            candidate = make(copy.deepcopy(case))
            if candidate is not None and candidate != case and fails(candidate):
                case = candidate
                changed = True
    return case


def smaller_forms(case):
    """(what, change) of every smaller form of the case as it is now, the largest steps first."""
    forms = [("interruption", lambda c: drop(c, ("second", "interruption"))),
             ("memory", lambda c: drop(c, ("second", "memory"))),
             ("one split", lambda c: {**c, "second": {**c["first"], **manner_of_second(c)}}),
             ("inline scene", inline_scene)]
    paths = sorted(places(case), key=len)
    quick = [(path, lambda c, p=path, v=value: replace(c, p, v))
             for path in paths if path[-1] in ("frames", "width", "height") and path[0] == "job"
             for value in SIMPLER[path[-1]][:3]]
    forms += quick + [(path, lambda c, p=path: drop(c, p)) for path in paths if path[0] != "files"]
    for path in paths:
        for value in SIMPLER.get(path[-1], []):
            forms.append((path, lambda c, p=path, v=value: replace(c, p, v)))
    for name, recipe in case["files"].items():
        plain = PLAIN_MAP if "width" in recipe else PLAIN_MESH if name.startswith("mesh") else None
        if plain:
            forms.append((name, lambda c, n=name, p=plain: replace(c, ("files", n), dict(p))))
        for key in ("width", "height", "rings", "segments", "count"):
            if recipe.get(key, 1) > 1:
                least = {"rings": 2, "segments": 3}.get(key, 1)
                half = max(recipe[key] // 2, least)
                forms.append((name, lambda c, n=name, k=key, h=half: replace(c, ("files", n, k), h)))
    for path in paths:
        value = look_up(case, path)
        if isinstance(value, (int, float)) and not isinstance(value, bool) and path[0] == "job" and abs(value) > 1:
            half = value // 2 if isinstance(value, int) else float(round(value / 2))
            forms.append((path, lambda c, p=path, h=half: replace(c, p, h)))
    forms.append(("unused files", drop_unused_files))
    return forms


def manner_of_second(case):
    return {key: case["second"][key] for key in OPTIONAL if key in case["second"]}


def places(value, path=()):
    """The paths of all values inside."""
    keys = value.keys() if isinstance(value, dict) else range(len(value)) if isinstance(value, list) else ()
    for key in list(keys):
        yield path + (key,)
        yield from places(value[key], path + (key,))


def look_up(value, path):
    for key in path:
        value = value[key]
    return value


def drop(case, path):
    """Without what is at the path; None where that is not possible, or where it is no longer there."""
    try:
        container = look_up(case, path[:-1])
        look_up(case, path)
    except (KeyError, IndexError, TypeError):
        return None
    of_split = path[0] in ("first", "second", "means") and path[-1] not in OPTIONAL
    if path in NEVER_DROPPED or len(path) == 1 or of_split or (isinstance(container, list) and is_vector(container)):
        return None
    del container[path[-1]]
    return case


def replace(case, path, value):
    """With another value at the path; None where there is none."""
    try:
        container, old = look_up(case, path[:-1]), look_up(case, path)
    except (KeyError, IndexError, TypeError):
        return None
    order = SIMPLER.get(path[-1], [])
    if value in order and old in order and order.index(value) >= order.index(old):
        return None  # or two values would replace each other for ever
    if path[0] == "job" and value in order and isinstance(old, (int, float)) and value >= old:
        return None
    container[path[-1]] = value
    return case


def is_vector(value):
    return bool(value) and all(isinstance(item, (int, float)) for item in value)


def inline_scene(case):
    """A scene of its own file, written into the job."""
    scene = case["job"].get("scene")
    if not isinstance(scene, str) or scene not in case["files"]:
        return None
    case["job"]["scene"] = case["files"].pop(scene)["value"]
    return case


def drop_unused_files(case):
    text = repr(case["job"])
    case["files"] = {name: recipe for name, recipe in case["files"].items()
                     if name in text or (name.startswith("map.") and "####" in text)}
    return case

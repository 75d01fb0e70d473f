"""What the keys of a legal job demand of each other, what a job costs, and how one is spoiled."""

import copy
import math


def work_of(job, num_frames):
    """About what the job costs: surfaces, candidates, moves and rays of all pixels and frames."""
    image, sampling = job["image"], job["sampling"]
    n, m = sampling["numParticles"], sampling["numCandidates"]
    moves = sampling.get("numDistributions", 5) * sampling.get("numMoves", 1)
    of_pixel = 5 * image.get("sites", 1) + m + n * (4 + (moves if sampling["method"] == "sequential" else 0))
    if sampling["method"] == "pool":
        of_pixel += 8 * m
    if sampling["method"] == "reference":
        of_pixel = 10 * sampling["referenceSamples"]
    if job.get("visibility", {}).get("correlated"):
        visibility = job["visibility"]
        of_pixel += n * visibility.get("partitions", 16)
    rounds = job.get("quality", {}).get("rounds", 1)
    if rounds == 1 and {"variance", "denoise"} & set(job["output"].get("aovs", [])):
        of_pixel *= 2
    if method_carries_memory(sampling["method"]):
        rounds += job.get("state", {}).get("preroll", 2) / num_frames
    rounds *= job.get("quality", {}).get("sweeps", 1)
    around = image.get("overscan", 0)
    left, top, right, bottom = around if isinstance(around, list) else 4 * [around]
    pixels = (image["width"] + left + right) * (image["height"] + top + bottom)
    return pixels * num_frames * of_pixel * rounds


def method_carries_memory(method):
    return method == "pool"


def mend_view(view, rng):
    """The three vectors must span a view."""
    up = view.get("up", [0, 1, 0])
    for _ in range(20):
        way = [a - p for a, p in zip(view["lookAt"], view["position"])]
        cross = [way[1] * up[2] - way[2] * up[1], way[2] * up[0] - way[0] * up[2], way[0] * up[1] - way[1] * up[0]]
        if math.hypot(*cross) > 1e-3 * math.hypot(*way) * math.hypot(*up) > 0:
            return
        view["position"] = [round(p + rng.uniform(-1, 1), 3) for p in view["position"]]


def whole_blocks(tile_size):
    """Tiles in which blocks of pixels can have numbers of rounds of their own."""
    return (tile_size + 7) // 8 * 8


def catchers(scene):
    """All that may catch shadows."""
    gltf = scene.get("gltf", {})
    nodes = gltf.get("nodes", {}) if isinstance(gltf, dict) else {}
    return [scene.get("ground", {}), *scene.get("objects", []), *nodes.values()]


def mend(job, rng):
    """What the keys of a legal job demand of each other."""
    sampling, visibility = job["sampling"], job.setdefault("visibility", {})
    method = sampling["method"]
    for counts in [sampling, *sampling.get("byMaterial", {}).values()]:
        n = counts.get("numParticles", sampling["numParticles"])
        counts["numCandidates"] = max(counts.get("numCandidates", sampling["numCandidates"]), n)
    if "refreshCandidates" in sampling:
        sampling["refreshCandidates"] = max(sampling["refreshCandidates"], sampling["numParticles"])
    if method != "mis" or sampling.get("byMaterial"):
        sampling.pop("misCompensation", None)
    for key in ("targetError", "timeBudget"):
        if method != "auto" or (key == "timeBudget" and "targetError" in sampling):
            sampling.pop(key, None)
    if method in ("reference", "pool", "ratio", "restir", "auto") or sampling.get("byMaterial"):
        visibility["correlated"] = False
    if (visibility.get("correlated") or method == "auto") and "quality" in job:
        job["quality"] = {}
    if job.get("quality", {}).get("rounds", 1) < 3 or method in ("sequential", "restir"):
        job.get("quality", {}).pop("adaptiveThreshold", None)
    if "adaptiveThreshold" in job.get("quality", {}) and "tileSize" in job["image"]:
        job["image"]["tileSize"] = whole_blocks(job["image"]["tileSize"])
    image = job["image"]
    if visibility.get("correlated") or method in ("sequential", "restir", "auto"):
        image.pop("maxSites", None)
    elif "maxSites" in image:
        image["maxSites"] = image.get("sites", 1) * rng.choice((1, 4, 4, 16, 16))
    if visibility.get("correlated") and visibility.get("mask") != "same-samples" and sampling["numParticles"] % 2:
        if rng.random() < 0.5:
            visibility["mask"] = "same-samples"
        else:
            sampling["numParticles"] += 1 if sampling["numParticles"] < 64 else -1
            sampling["numCandidates"] = max(sampling["numCandidates"], sampling["numParticles"])
    if visibility.get("correlated"):
        for catcher in catchers(job["scene"]):
            catcher.pop("catcher", None)
    if (method == "restir" and sampling.get("reuseVisibility")) or visibility.get("correlated"):
        aovs = job.get("output", {}).get("aovs", [])
        aovs[:] = [aov for aov in aovs if aov not in ("unshadowed", "blocked")]
    if job["output"].get("background") != "transparent":
        job["output"].pop("shadows", None)
    rotation = job["environment"].get("rotation", {})
    if rotation.get("keys"):
        rotation.pop("startDeg", None)
        rotation.pop("degPerFrame", None)
    for movable in [job["camera"], *job["scene"]["objects"]]:
        if movable.get("keys"):
            movable.pop("gltf", None)


def spoil(case, rng):
    """The case with one value of its job made wrong: what `baton check` must refuse, or take for good reason."""
    case = copy.deepcopy(case)
    places = []

    def visit(value):
        for key in value if isinstance(value, dict) else range(len(value)):
            places.append((value, key))
            if isinstance(value[key], (dict, list)):
                visit(value[key])

    visit(case["job"])
    container, key = rng.choice(places)
    container[key] = rng.choice([None, -1, 1e30, "", "x", [], {}, True, [1, 2], {"a": 1}, 0.5, "\u0000", -1e30])
    return case

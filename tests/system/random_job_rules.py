"""What the keys of a legal job demand of each other, what a job costs, and how one is spoiled.

The rules are a second witness of what `baton check` says: written from the pages, not from the program. test_random_jobs.py
compares both ways: what obeys all rules is accepted, and what breaks a single one is refused.
"""

import copy
import math
import random


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
    of_pixel += 16 * 12 * job.get("light", {}).get("bounces", 4)
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


def is_correlated(job):
    return job["visibility"].get("correlated", False)


def drop_if_true(values, key):
    if values.get(key):
        del values[key]


def catchers(scene):
    """All that may catch shadows."""
    gltf = scene.get("gltf", {})
    nodes = gltf.get("nodes", {}) if isinstance(gltf, dict) else {}
    return [scene.get("ground", {}), *scene.get("objects", []), *nodes.values()]


# ---- the rules ----------------------------------------------------------------------------------------------
# Each mends a job in one respect, and leaves one that is legal in it alone.


def at_least_as_many_candidates_as_particles(job, _rng):
    sampling = job["sampling"]
    for counts in [sampling, *sampling.get("byMaterial", {}).values()]:
        n = counts.get("numParticles", sampling["numParticles"])
        if counts.get("numCandidates", sampling["numCandidates"]) < n:
            counts["numCandidates"] = n
    if "refreshCandidates" in sampling:
        sampling["refreshCandidates"] = max(sampling["refreshCandidates"], sampling["numParticles"])


def compensation_is_of_mis(job, _rng):
    sampling = job["sampling"]
    if sampling["method"] != "mis" or sampling.get("byMaterial"):
        drop_if_true(sampling, "misCompensation")


def one_target_and_only_of_auto(job, _rng):
    sampling = job["sampling"]
    for key in ("targetError", "timeBudget"):
        if sampling["method"] != "auto" or (key == "timeBudget" and "targetError" in sampling):
            sampling.pop(key, None)


def a_second_pass_of_few_methods(job, _rng):
    if job["sampling"]["method"] in ("reference", "pool", "ratio", "restir", "auto") or job["sampling"].get("byMaterial"):
        drop_if_true(job["visibility"], "correlated")


def one_round_with_a_second_pass_or_auto(job, _rng):
    if is_correlated(job) or job["sampling"]["method"] == "auto":
        job.pop("quality", None)


def adaptive_rounds(job, _rng):
    quality, image = job.get("quality", {}), job["image"]
    if quality.get("rounds", 1) < 3 or job["sampling"]["method"] in ("sequential", "restir"):
        quality.pop("adaptiveThreshold", None)


def more_sites_in_later_rounds(job, rng):
    image, sites = job["image"], job["image"].get("sites", 1)
    most = image.get("maxSites", sites)
    if most > sites and (is_correlated(job) or job["sampling"]["method"] in ("sequential", "restir", "auto")):
        image.pop("maxSites")
    elif most not in [sites * factor for factor in (1, 4, 16)]:
        image["maxSites"] = sites * rng.choice((1, 4, 4, 16, 16))


def two_folds_are_of_one_size(job, rng):
    sampling, visibility = job["sampling"], job["visibility"]
    if is_correlated(job) and visibility.get("mask") != "same-samples" and sampling["numParticles"] % 2:
        if rng.random() < 0.5:
            visibility["mask"] = "same-samples"
        else:
            sampling["numParticles"] += 1 if sampling["numParticles"] < 64 else -1
            at_least_as_many_candidates_as_particles(job, rng)


def no_catchers_with_a_second_pass(job, _rng):
    for catcher in catchers(job["scene"]) if is_correlated(job) else []:
        drop_if_true(catcher, "catcher")


def what_arrives_is_known(job, _rng):
    sampling = job["sampling"]
    if (sampling["method"] == "restir" and sampling.get("reuseVisibility")) or is_correlated(job):
        aovs = job.get("output", {}).get("aovs", [])
        aovs[:] = [aov for aov in aovs if aov not in ("unshadowed", "blocked")]


def shadows_in_alpha_of_what_is_transparent(job, _rng):
    if job["output"].get("background") != "transparent" and job["output"].get("shadows") == "alpha":
        del job["output"]["shadows"]


def one_kind_of_motion(job, _rng):
    rotation = job["environment"].get("rotation", {})
    if rotation.get("keys"):
        for angle in ("startDeg", "degPerFrame"):
            if rotation.get(angle):  # 0 says nothing
                rotation.pop(angle)
    for movable in [job["camera"], *job["scene"]["objects"]]:
        if movable.get("keys"):
            movable.pop("gltf", None)


RULES = [at_least_as_many_candidates_as_particles, compensation_is_of_mis, one_target_and_only_of_auto,
         a_second_pass_of_few_methods, one_round_with_a_second_pass_or_auto, adaptive_rounds,
         more_sites_in_later_rounds,
         two_folds_are_of_one_size, no_catchers_with_a_second_pass, what_arrives_is_known,
         shadows_in_alpha_of_what_is_transparent, one_kind_of_motion]


def mend(job, rng, without=None):
    """Makes a drawn job legal; or, `without` one of the rules, legal but for it."""
    job.setdefault("visibility", {})
    for rule in RULES:
        if rule is not without:
            rule(job, rng)


def breaks(job, rule):
    mended = copy.deepcopy(job)
    rule(mended, random.Random(1))
    return mended != job


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

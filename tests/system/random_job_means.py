"""Random jobs of unbiased methods have the brightness that brute force finds.

Hypothesis: the mean of the picture (all pixels, mean of R, G, B) has the same expectation under a method as under
`reference`. Pixels of one run read the same presampled light and are correlated, so a run is one observation: both sides are
rendered with 8 seeds and compared by Welch's t-test [Welch 1947], its degrees of freedom taken as the fewest that they
can be, 7. What is significant at 0.2 % (two-sided) is rendered again with 24 fresh seeds a side and must be
significant there, too. A job without a fault is thus reported with probability 4e-6, one in 10,000 jobs, of which about
200 are tested, with less than 0.1 %. The statistic wants means that are nearly normal, so these jobs have tame light
and no sharp lobes. Which claims are tested is in UNBIASED."""

import copy
import math
import statistics

from exr_frames import read_frame

# Method -> which frame is unbiased: for those that carry samples the first, whose samples are fresh. `pool` is unbiased
# in all; `ratio` is only consistent.
UNBIASED = {"environment": -1, "mis": -1, "bidirectional": -1, "brdf": -1, "pool": -1, "sequential": 0, "restir": 0}
# Seeds a side, and Student's t that is exceeded with probability 0.002 at one degree of freedom less.
FIRST_LOOK = (8, 4.785)
SECOND_LOOK = (24, 3.485)
# Samples of `reference`, in pairs.
REFERENCE_SAMPLES = 32


def tame(case, rng):
    """The case, with light and materials of which a few runs tell the mean; it is judged by its brightness."""
    case = copy.deepcopy(case)
    job = case["job"]
    if isinstance(job["scene"], str):
        job["scene"] = case["files"].pop(job["scene"])["value"]
    sampling = job["sampling"]
    if sampling["method"] not in UNBIASED:
        sampling["method"] = rng.choice(sorted(UNBIASED))
    job["image"].update(width=rng.choice([16, 24, 33]), height=rng.choice([9, 16, 24]))
    job["image"].pop("region", None)  # of another size
    job["camera"] = {"position": [0, 1, 4.5], "lookAt": [0, 0.3, 0], "verticalFovDeg": 40}
    job["output"].update(pixelType="float", background="transparent", compression="none")
    for material in job["scene"]["materials"].values():
        if material["type"] == "phong":
            material["exponent"] = min(material.get("exponent", 50), 30)
        if material["type"] == "metallicRoughness":
            material["roughness"] = max(material.get("roughness", 0.5), 0.3)
            material["clearcoatRoughness"] = max(material.get("clearcoatRoughness", 0), 0.3)
    for item in job["scene"]["objects"]:
        item.pop("gltf", None)
    for recipe in case["files"].values():
        if "level" in recipe:
            recipe.update(kind=rng.choice(["sky", "lamp", "flat", "halves"]), level=1.0)
            if recipe["width"] > 64:
                recipe.update(width=64, height=32)
        if recipe["kind"] == "merl":
            recipe["lobe"] = 3
    # Few samples are as unbiased as many, but far from normal.
    sampling["numParticles"] = max(sampling["numParticles"], 4)
    sampling["numCandidates"] = max(min(sampling["numCandidates"], 130), sampling["numParticles"])
    for counts in sampling.get("byMaterial", {}).values():
        counts["numCandidates"] = max(min(counts["numCandidates"], 130),
                                      counts.get("numParticles", sampling["numParticles"]))
    sampling["referenceSamples"] = REFERENCE_SAMPLES
    settle_claims(job)
    case["means"] = {"firstSeed": rng.randrange(1 << 40)}
    return case


def settle_claims(job):
    """Leaves out what is documented as a bias."""
    sampling, visibility = job["sampling"], job.setdefault("visibility", {})
    if sampling["method"] not in ("environment", "brdf", "mis", "bidirectional", "sequential"):
        visibility["correlated"] = False
    if sampling["method"] not in ("environment", "brdf", "mis", "bidirectional"):
        sampling.pop("byMaterial", None)
    if sampling["method"] != "mis":
        sampling.pop("misCompensation", None)
    if sampling["method"] in ("sequential", "restir"):
        job["image"].pop("maxSites", None)
        job.get("quality", {}).pop("adaptiveThreshold", None)
    sampling.pop("targetError", None)
    sampling.pop("timeBudget", None)
    if visibility.get("correlated"):
        visibility["form"] = "corrected"
        if visibility.get("mask") == "same-samples":
            del visibility["mask"]
        sampling["numParticles"] += sampling["numParticles"] % 2
        sampling["numCandidates"] = max(sampling["numCandidates"], sampling["numParticles"])
    # With misCompensation what is dim is left to the BRDF's samples: there must be some.
    if sampling.get("misCompensation"):
        sampling["brdfFraction"] = max(sampling.get("brdfFraction", 0.25), 0.25)


def significant(a, b, most):
    """Whether Welch's t of two samples exceeds `most`; equal constants do not differ."""
    variance = statistics.variance(a) / len(a) + statistics.variance(b) / len(b)
    difference = statistics.fmean(a) - statistics.fmean(b)
    # Sums in another order differ in the last digits of a float.
    if abs(difference) <= 1e-5 * abs(statistics.fmean(b)):
        return False
    return abs(difference) > most * math.sqrt(variance)


def brightness(frame):
    """The mean of the picture."""
    return statistics.fmean(statistics.fmean(frame.channels[channel]) for channel in "RGB")


def judge_means(case, render):
    """None, or what differs. render(case, seed) -> folder of the frames of a job with that seed."""
    sampling = case["job"]["sampling"]
    which = UNBIASED[sampling["method"]]
    judge = copy.deepcopy(case)
    judge["job"]["sampling"] = {"method": "reference", "referenceSamples": REFERENCE_SAMPLES}
    judge["job"].pop("visibility", None)
    # Rounds that carry samples see the sites of the first round, those of `reference` have sites of their own.
    if sampling["method"] in ("sequential", "restir") and case["job"].get("state", {}).get("carry", True):
        judge["job"].pop("quality", None)

    def means(of, first_seed, count):
        found = []
        for seed in range(first_seed, first_seed + count):
            # Frame 10 comes after frame 9, whether or not the pattern has room for two digits.
            frames = sorted(render(of, seed).glob("*.exr"), key=lambda path: (len(path.name), path.name))
            found.append(brightness(read_frame(frames[which])))
        return found

    seed = case["means"]["firstSeed"]
    for count, most in (FIRST_LOOK, SECOND_LOOK):
        a, b = means(case, seed, count), means(judge, seed + 1000, count)
        if not significant(a, b, most):
            return None
        seed += 2000
    return (f"{sampling['method']}: mean of the picture {statistics.fmean(a):.6g} +- "
            f"{statistics.stdev(a) / math.sqrt(len(a)):.2g}, reference {statistics.fmean(b):.6g} +- "
            f"{statistics.stdev(b) / math.sqrt(len(b)):.2g}, {len(a)} seeds each")

#!/usr/bin/env python3
"""Light that fades to black and comes back, and objects that come and go by their scale."""

import math

from farm import check, check_equal, run_tests
from jobs import make_job

METHODS = ["pool", "bidirectional", "environment", "brdf", "mis", "sequential", "restir", "ratio", "reference"]
CARRYING = {"pool", "sequential", "restir"}
BLACK = (3, 4)
NUM_FRAMES = 7


def fade_job(folder, method, frames, scale_keys=None, **changes):
    """The light falls from 1 in frame 1 to 0 in frames 3 and 4, and is whole again in frame 5; all turns."""
    job = make_job(folder, frames=frames, image={"width": 40, "height": 24, "sites": 4, "tileSize": 32},
                   sampling={"method": method, "numParticles": 8, "numCandidates": 32, "referenceSamples": 32},
                   quality={"rounds": 2}, output={"pixelType": "float", "aovs": ["lns", "unshadowed", "visibility"]}, **changes)
    job["environment"]["scaleKeys"] = scale_keys or [{"frame": frame, "scale": scale}
                                                     for frame, scale in ((1, 1), (3, 0), (4, 0), (5, 1))]
    return job


def render(programs, folder, job):
    """What `render` says at its end."""
    said = programs.render_in(folder, job).stdout
    check("WRONG" not in said and "nan" not in said.lower(), said)
    return said


def frame(folder, number):
    return folder / f"frames/frame.{number:04}.exr"


def values(programs, folder, number, channel="G"):
    found = programs.values(frame(folder, number), channel)
    check(all(math.isfinite(value) for value in found), f"{channel} of frame {number} in {folder.name} is not finite")
    return found


def every_method_fades(programs, folder):
    """Black frames are black. Those after them are as bright as ever; the same bytes, where nothing is carried."""
    for method in METHODS:
        faded, whole = folder / method / "faded", folder / method / "whole"
        render(programs, faded, fade_job(faded, method, f"1-{NUM_FRAMES}"))
        render(programs, whole, fade_job(whole, method, f"5-{NUM_FRAMES}", [{"frame": 1, "scale": 1}]))
        for number in BLACK:
            for channel in ("R", "G", "B", "lns", "unshadowed.G"):
                check_equal(set(values(programs, faded, number, channel)), {0.0}, f"{channel} of {method} in frame {number}")
        for number in range(5, NUM_FRAMES + 1):
            if method not in CARRYING:
                check_equal(programs.pixels(faded / "frames")[frame(faded, number).name],
                            programs.pixels(whole / "frames")[frame(whole, number).name], f"frame {number} of {method}")
            got, expected = (sum(values(programs, where, number)) for where in (faded, whole))
            check(abs(got / expected - 1) < 0.1, f"{method}: frame {number} has {got:.4g}, without the fade {expected:.4g}")


def catchers_have_no_shadow_without_light(programs, folder):
    """S / U is 1 where U is 0; in A, nothing is black."""
    for method in ("pool", "sequential", "mis"):
        for shadows in ("channels", "alpha"):
            where = folder / method / shadows
            job = fade_job(where, method, "2-5")
            job["scene"]["ground"]["catcher"] = True
            job["output"] |= {"background": "transparent", "shadows": shadows, "aovs": []}
            render(programs, where, job)
            if shadows == "channels":
                for number in BLACK:
                    check_equal(set(values(programs, where, number, "shadow.R")), {1.0}, f"shadow of {method}")
                check(min(values(programs, where, 5, "shadow.R")) < 0.9, f"{method}: no shadow in frame 5")
            else:
                seen = [sum(values(programs, where, number, "A")) for number in (3, 5)]
                check(seen[0] < seen[1] - 1, f"{method}: alpha without and with light {seen}")


def black_jobs_are_said(programs, folder):
    """`auto`, adaptive rounds, noise thresholds and studies end in black, too."""
    for name, changes in {"auto": {"sampling": {"method": "auto", "targetError": 0.1}},
                          "adaptive": {"sampling": {"method": "mis"}, "quality": {"rounds": 8, "adaptiveThreshold": 0.01}},
                          "threshold": {"sampling": {"method": "pool"}, "quality": {"noiseThreshold": 0.01, "maxRounds": 8}}}.items():
        for scale in (0, 1):
            where = folder / f"{name}-{scale}"
            job = fade_job(where, "pool", "3-5")
            job["sampling"] = changes["sampling"]
            job["quality"] = changes.get("quality", {})
            job["environment"]["scale"] = scale
            render(programs, where, job)
            check_equal(set(values(programs, where, 3)), {0.0}, f"{name} in black")
            check(scale == 0 or sum(values(programs, where, 5)) > 1, f"{name}: dark in frame 5")


def objects_come_and_go(programs, folder):
    """A scale of 0 is no object: the pixels are those of a job without it, where nothing is carried. Any tiling is alike."""
    for method in ("mis", "pool", "sequential"):
        pictures = {}
        for name, tile_size in (("whole", 128), ("small", 16), ("without", 128)):
            where = folder / method / name
            job = make_job(where, frames="1-5", image={"width": 64, "height": 40, "sites": 4, "tileSize": tile_size},
                           sampling={"method": method, "numParticles": 8, "numCandidates": 32}, motion={"maxPx": 5},
                           output={"aovs": ["motion", "object", "cryptoObject"], "pixelType": "float"})
            pops = job["scene"]["objects"].pop(0)
            pops["keys"] = [{"frame": frame, "scale": scale} for frame, scale in ((1, 0), (2, 0), (3, 1), (4, [1, 0, 1]))]
            job["scene"]["objects"][0]["keys"] = [{"frame": 1}, {"frame": 5, "translate": [0.3, 0, 0]}]
            if name != "without":
                job["scene"]["objects"].append(pops)
            render(programs, where, job)
            pictures[name] = where
        check_equal(programs.pixels(pictures["small"] / "frames"), programs.pixels(pictures["whole"] / "frames"),
                    f"pixels of {method} in small tiles")
        for number in (1, 2, 4, 5) if method == "mis" else (1,):
            got, expected = (values(programs, pictures[name], number) for name in ("whole", "without"))
            check_equal(got, expected, f"{method}: frame {number} without the object")
        check(values(programs, pictures["whole"], 3) != values(programs, pictures["without"], 3), "it never comes")
        for channel in ("forward.u", "backward.v"):
            values(programs, pictures["whole"], 3, channel)


if __name__ == "__main__":
    run_tests()

#!/usr/bin/env python3
"""A glTF scene as a job: nodes, materials and animations are shown, the same for any tiling; what is wrong with the file
is said once; the file is part of the job."""

import json
import sys
from pathlib import Path

from farm import BAD_INPUT, check, check_equal, make_job, run_tests, write_job

sys.path.append(str(Path(__file__).parents[2] / "jobs/examples"))
from make_gltf_set import make_set, png  # noqa: E402

NUM_FRAMES = 3


def set_job(folder, tile_size=64, method="pool", textured=False, alive=False, **scene):
    """The camera of the set from behind its dolly; frames with motion of all kinds."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "set.glb").write_bytes(make_set(3, textured, alive))
    job = make_job(folder, frames="12-14", image={"width": 96, "height": 54, "sites": 4, "tileSize": tile_size},
                   sampling={"method": method, "numParticles": 4, "numCandidates": 32})
    del job["camera"]
    job["scene"] = {"gltf": {"file": "set.glb", **scene.pop("gltf", {})}, **scene}
    return job


def rendered(programs, folder, job, **how):
    path = write_job(folder / "job.json", job)
    programs.render(path, folder / "work", **how)
    pixels = programs.pixels(folder / "frames")
    check_equal(len(pixels), NUM_FRAMES, f"frames in {folder}")
    return pixels


def any_tiling(programs, folder):
    """Small tiles on two workers and the whole image on one give the same pixels, while everything moves."""
    for method in ("pool", "sequential"):
        whole, small = folder / method / "whole", folder / method / "small"
        expected = rendered(programs, whole, set_job(whole, 128, method), workers=1, threads=1)
        got = rendered(programs, small, set_job(small, 16, method), workers=2, threads=1)
        check_equal(got, expected, f"pixels of {method} in small tiles")
        depths = [programs.values(whole / f"frames/frame.{frame:04}.exr", "depth") for frame in (12, 14)]
        check(depths[0] != depths[1], "nothing moves")


def the_job_says_otherwise(programs, folder):
    """`check` counts what is shown; hidden nodes are not, and names that are not there are suggested."""
    checked = json.loads(programs.run("baton", "check", write_job(folder / "job.json", set_job(folder)), "--json").stdout)
    check_equal((checked["meshes"], checked["instances"]), (4, 6), "meshes and instances")
    check(checked["motionMaxPx"] > 1, f"motion of {checked['motionMaxPx']} pixels")
    hidden = set_job(folder, gltf={"nodes": {"ring": {"visible": False}}})
    checked = json.loads(programs.run("baton", "check", write_job(folder / "hidden.json", hidden), "--json").stdout)
    check_equal(checked["instances"], 3, "instances without the ring")
    wrong = set_job(folder, gltf={"nodes": {"rings": {"visible": False}}})
    failed = programs.run("baton", "check", write_job(folder / "wrong.json", wrong), expect=BAD_INPUT)
    check('set.glb: no node "rings"; did you mean "ring"?' in failed.stderr, failed.stderr)


def a_cut_file_is_one_error(programs, folder):
    path = write_job(folder / "job.json", set_job(folder))
    whole = (folder / "set.glb").read_bytes()
    for size in (0, 1024, len(whole) // 2, len(whole) - 1):
        (folder / "set.glb").write_bytes(whole[:size])
        failed = programs.run("baton", "check", path, expect=BAD_INPUT)
        check_equal(len(failed.stderr.strip().splitlines()), 1, f"lines on stderr for {size} bytes: {failed.stderr}")
        check("set.glb: not a glTF file" in failed.stderr, failed.stderr)


def textures_for_any_tiling(programs, folder):
    """Holes, bumps, glow and images are the same in small tiles, and are seen."""
    for method in ("pool", "bidirectional"):
        whole, small, plain = (folder / method / name for name in ("whole", "small", "plain"))
        expected = rendered(programs, whole, set_job(whole, 128, method, textured=True), workers=1, threads=1)
        got = rendered(programs, small, set_job(small, 16, method, textured=True), workers=2, threads=1)
        check_equal(got, expected, f"pixels of {method} in small tiles")
        check(rendered(programs, plain, set_job(plain, 128, method), workers=1, threads=1) != expected, "no texture is seen")


def textures_are_said_and_part_of_the_job(programs, folder):
    """`check` says what is not as in the file; another image is another picture; a damaged one is one error."""
    path = write_job(folder / "job.json", set_job(folder, textured=True))
    said = programs.run("baton", "check", path).stdout
    check('material "clay": it glows, but lights nothing' in said, said)
    check("textures are not read" not in said, said)
    (folder / "wood.png").write_bytes(png(2, 2, lambda x, y: (100 * x, 50 * y, 9)))
    job = make_job(folder)
    job["scene"]["materials"] = {name: {"type": "diffuse", "colorTexture": "wood.png"} for name in job["scene"]["materials"]}
    job["scene"]["objects"], job["scene"]["ground"] = [], {"material": next(iter(job["scene"]["materials"]))}
    path = write_job(folder / "wood.json", job)
    programs.render(path, folder / "work")
    before = programs.pixels(folder / "frames")
    (folder / "wood.png").write_bytes(png(2, 2, lambda x, y: (100 * x, 50 * y, 99)))
    refused = programs.render(path, folder / "work", expect=None)
    check(refused.returncode != 0 and "wood.png" in refused.stderr, refused.stderr)
    programs.render(path, folder / "work", extra=["--restart"])
    check(programs.pixels(folder / "frames") != before, "another image shows the same")
    for content, said in ((b"no image\n" * 9, "not an image"), (None, "missing")):
        (folder / "wood.png").unlink()
        if content is not None:
            (folder / "wood.png").write_bytes(content)
        failed = programs.run("baton", "check", path, expect=BAD_INPUT)
        check("wood.png: " + said in failed.stderr, failed.stderr)
        (folder / "wood.png").write_bytes(b"")


def deforming_for_any_tiling(programs, folder):
    """A reed on bones and a drop that flattens: the same pixels in small tiles, by a run that is cut in two, and in a job of
    the last frame alone, where nothing is carried; they are where the file's animation has them."""
    for method in ("pool", "mis"):
        whole, small, split = (folder / method / name for name in ("whole", "small", "split"))
        expected = rendered(programs, whole, set_job(whole, 128, method, textured=True, alive=True), workers=1, threads=1)
        got = rendered(programs, small, set_job(small, 16, method, textured=True, alive=True), workers=2, threads=2)
        check_equal(got, expected, f"pixels of {method} in small tiles")
        job = set_job(split, 32, method, textured=True, alive=True)
        path = write_job(split / "first.json", {**job, "frames": "12-13", "motion": {"maxPx": 9}})
        programs.render(path, split / "work")
        job["motion"] = {"maxPx": 9}
        again = rendered(programs, split, job)
        job = set_job(folder / method / "once", 32, method, textured=True, alive=True)
        job["motion"] = {"maxPx": 9}
        check_equal(again, rendered(programs, folder / method / "once", job), f"pixels of {method} in two runs")
    last = set_job(folder / "last", 64, "mis", textured=True, alive=True)
    path = write_job(folder / "last/job.json", {**last, "frames": "14"})
    programs.render(path, folder / "last/work")
    alone = programs.values(folder / "last/frames/frame.0014.exr", "depth")
    check(alone == programs.values(folder / "mis/whole/frames/frame.0014.exr", "depth"), "frame 14 alone is another one")
    still = set_job(folder / "still", 64, "mis", textured=True, alive=True, gltf={"startFrame": 14})
    rendered(programs, folder / "still", still)
    check(programs.values(folder / "still/frames/frame.0014.exr", "depth") != alone, "startFrame moves nothing")


def what_deforms_is_said(programs, folder):
    """`check` counts what deforms as motion; bones can be placed, a mesh that follows them cannot."""
    def checked(**how):
        path = write_job(folder / "job.json", set_job(folder, alive=True, **how))
        return json.loads(programs.run("baton", "check", path, "--json").stdout)
    still = {name: {"place": {}} for name in ("lift", "vane", "ball", "dolly")}
    hidden = checked(gltf={"nodes": {**still, "reed": {"visible": False}, "drop": {"visible": False}}})
    check_equal(hidden["motionMaxPx"], 0, "motion without what deforms")
    alive = checked(gltf={"nodes": {**still, "drop": {"visible": False}}})
    check(alive["motionMaxPx"] > 1, f"motion of {alive['motionMaxPx']} pixels")
    check_equal((hidden["deformingMeshes"], alive["deformingMeshes"]), (0, 1), "meshes that deform")
    check(not [line for line in alive["warnings"] if "morph" in line or "bones" in line], alive["warnings"])
    wrong = set_job(folder, alive=True, gltf={"nodes": {"reed": {"place": {"translate": [0, 1, 0]}}}})
    failed = programs.run("baton", "check", write_job(folder / "wrong.json", wrong), expect=BAD_INPUT)
    check('set.glb: node "reed": follows its bones, expected `place` of these' in failed.stderr, failed.stderr)


if __name__ == "__main__":
    run_tests([any_tiling, the_job_says_otherwise, a_cut_file_is_one_error, textures_for_any_tiling,
               textures_are_said_and_part_of_the_job, deforming_for_any_tiling, what_deforms_is_said])

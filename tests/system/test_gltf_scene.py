#!/usr/bin/env python3
"""A glTF scene as a job: nodes, materials and animations are shown, the same for any tiling; what is wrong with the file
is said once; the file is part of the job."""

import math
from array import array

from assets import make_set, png, write_exr
from farm import check, check_equal, check_layouts, run_tests
from jobs import make_job, write_job

NUM_FRAMES = 3
LAYOUTS = {"whole image": (1, 1, 128), "small tiles": (2, 1, 16)}


def set_job(folder, tile_size=64, method="pool", textured=False, alive=False, **scene):
    """The camera of the set from behind its dolly; frames with motion of all kinds."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "set.glb").write_bytes(make_set(3, textured, alive))
    job = make_job(folder, frames="12-14", image={"width": 96, "height": 54, "sites": 4, "tileSize": tile_size},
                   sampling={"method": method, "numParticles": 4, "numCandidates": 32})
    del job["camera"]
    job["scene"] = {"gltf": {"file": "set.glb", **scene.pop("gltf", {})}, **scene}
    return job


def any_tiling(programs, folder):
    """The same pixels while everything moves."""
    for method in ("pool", "sequential"):
        pixels, _ = check_layouts(programs, folder / method, lambda place: set_job(place, method=method), LAYOUTS)
        check_equal(len(pixels), NUM_FRAMES, "frames")
        depths = [programs.values(pixels.folder / f"frame.{frame:04}.exr", "depth") for frame in (12, 14)]
        check(depths[0] != depths[1], "nothing moves")


def the_job_says_otherwise(programs, folder):
    """`check` counts what is shown; hidden nodes are not, and names that are not there are suggested."""
    checked = programs.checked(write_job(folder / "job.json", set_job(folder)))
    check_equal((checked["meshes"], checked["instances"]), (4, 6), "meshes and instances")
    check(checked["motionMaxPx"] > 1, f"motion of {checked['motionMaxPx']} pixels")
    hidden = set_job(folder, gltf={"nodes": {"ring": {"visible": False}}})
    checked = programs.checked(write_job(folder / "hidden.json", hidden))
    check_equal(checked["instances"], 3, "instances without the ring")
    wrong = set_job(folder, gltf={"nodes": {"rings": {"visible": False}}})
    programs.refuses("check", write_job(folder / "wrong.json", wrong), says='set.glb: no node "rings"; did you mean "ring"?')


def a_cut_file_is_one_error(programs, folder):
    path = write_job(folder / "job.json", set_job(folder))
    whole = (folder / "set.glb").read_bytes()
    for size in (0, 1024, len(whole) // 2, len(whole) - 1):
        (folder / "set.glb").write_bytes(whole[:size])
        told = programs.refuses("check", path, says="set.glb: not a glTF file")
        check_equal(len(told.strip().splitlines()), 1, f"lines on stderr for {size} bytes: {told}")


def textures_for_any_tiling(programs, folder):
    """Holes, bumps, glow and images are the same in small tiles, and are seen."""
    for method in ("pool", "bidirectional"):
        pixels, _ = check_layouts(programs, folder / method, lambda place: set_job(place, method=method, textured=True), LAYOUTS)
        plain = folder / method / "plain"
        check(programs.rendered(plain, set_job(plain, 128, method)) != pixels, "no texture is seen")


def textures_are_said_and_part_of_the_job(programs, folder):
    """`check` says what is not as in the file; another image is another picture; a damaged one is one error."""
    path = write_job(folder / "job.json", set_job(folder, textured=True))
    said = programs.run("baton", "check", path).stdout
    check('material "clay": it glows, but lights nothing, as light.bounces is 0' in said, said)
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
        programs.refuses("check", path, says="wood.png: " + said)
        (folder / "wood.png").write_bytes(b"")


def deforming_for_any_tiling(programs, folder):
    """A reed on bones and a drop that flattens: the same pixels in small tiles, by a run that is cut in two, and in a job of
    the last frame alone, where nothing is carried; they are where the file's animation has them."""
    for method in ("pool", "mis"):
        def alive(place):
            return set_job(place, method=method, textured=True, alive=True)
        check_layouts(programs, folder / method, alive, LAYOUTS)
        split, once = folder / method / "split", folder / method / "once"
        path = write_job(split / "first.json", {**alive(split), "frames": "12-13", "motion": {"maxPx": 9}})
        programs.render(path, split / "work")
        pixels = [programs.rendered(place, {**alive(place), "motion": {"maxPx": 9}}) for place in (split, once)]
        check_equal(*pixels, f"pixels of {method} in two runs")
    last = set_job(folder / "last", 64, "mis", textured=True, alive=True)
    path = write_job(folder / "last/job.json", {**last, "frames": "14"})
    programs.render(path, folder / "last/work")
    alone = programs.values(folder / "last/frames/frame.0014.exr", "depth")
    check(alone == programs.values(folder / "mis/whole-image/frames/frame.0014.exr", "depth"), "frame 14 alone is another one")
    still = set_job(folder / "still", 64, "mis", textured=True, alive=True, gltf={"startFrame": 14})
    programs.render_in(folder / "still", still)
    check(programs.values(folder / "still/frames/frame.0014.exr", "depth") != alone, "startFrame moves nothing")


def what_deforms_is_said(programs, folder):
    """`check` counts what deforms as motion; bones can be placed, a mesh that follows them cannot."""
    def checked(**how):
        path = write_job(folder / "job.json", set_job(folder, alive=True, **how))
        return programs.checked(path)
    still = {name: {"place": {}} for name in ("lift", "vane", "ball", "dolly")}
    hidden = checked(gltf={"nodes": {**still, "reed": {"visible": False}, "drop": {"visible": False}}})
    check_equal(hidden["motionMaxPx"], 0, "motion without what deforms")
    alive = checked(gltf={"nodes": {**still, "drop": {"visible": False}}})
    check(alive["motionMaxPx"] > 1, f"motion of {alive['motionMaxPx']} pixels")
    check_equal((hidden["deformingMeshes"], alive["deformingMeshes"]), (0, 1), "meshes that deform")
    check(not [line for line in alive["warnings"] if "morph" in line or "bones" in line], alive["warnings"])
    wrong = set_job(folder, alive=True, gltf={"nodes": {"reed": {"place": {"translate": [0, 1, 0]}}}})
    programs.refuses("check", write_job(folder / "wrong.json", wrong),
                     says='set.glb: node "reed": follows its bones, expected `place` of these')


def texels_that_are_no_numbers(programs, folder):
    """Of textures, maps and plates they count as 0; `check` and `render` say how many, once for each file."""
    job = make_job(folder, frames="1-2", image={"width": 32, "height": 16, "sites": 1}, sampling={"method": "mis"})
    rows = [array("f", [0.5] * 96) for _ in range(16)]
    rows[3][6:9] = array("f", [math.nan, -math.inf, 1])
    rows[9][30] = rows[9][33] = math.inf
    for name in ("texture", "map", "seen", "plate"):
        write_exr(folder / f"{name}.exr", 32, rows)
    job["scene"]["materials"] = {name: {"type": "diffuse", "colorTexture": "texture.exr"} for name in ("chalk", "clay")}
    job["scene"]["ground"] = {"material": "chalk"}
    (folder / "leaf.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n", encoding="utf-8")
    job["scene"]["meshes"] = {"leaf": "leaf.obj"}
    job["scene"]["objects"] = [{"mesh": "leaf", "material": "clay"}]
    job["environment"] = {"map": "map.exr", "cameraMap": "seen.exr"}
    job["output"] |= {"background": "plate", "plate": "plate.exr", "aovs": []}
    path = write_job(folder / "job.json", job)
    rendered = programs.render(path, folder / "work")
    for said in (programs.run("baton", "check", path).stdout, rendered.stdout + rendered.stderr):
        for name, what in (("texture", "texels"), ("map", "texels"), ("seen", "texels"), ("plate", "pixels")):
            lines = [line for line in said.splitlines() if f"/{name}.exr: 3 {what} are" in line]
            check(len(lines) == 1 and lines[0].endswith("and count as 0"), f"{name}: {lines} of\n{said}")


if __name__ == "__main__":
    run_tests()

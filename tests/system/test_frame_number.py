#!/usr/bin/env python3
"""What a frame shows (pose, light, plate, motion) is a function of its number alone, whichever other frames its job has."""

from assets import make_set, png, write_map
from farm import check, check_equal, run_tests
from jobs import camera_keys, make_job
from make_gltf_set import Builder

FRAMES = ("1-12", "5", "5-12", "1-9x2", "1,5")
MOTION = ("forward.u", "forward.v", "backward.u", "backward.v")
SMALL = {"width": 48, "height": 28, "sites": 4}


def small_job(folder, **changes):
    """Nothing is carried and nothing moves."""
    return make_job(folder, image=SMALL, sampling={"method": "mis", "numParticles": 4, "numCandidates": 16},
                    output={"aovs": ["motion", "object", "position"], "pixelType": "float"}, **changes)


def keys(folder):
    """Camera and objects by smooth keys, some between frames."""
    job = small_job(folder)
    job["camera"] |= camera_keys((1, [0, 1.2, 5], [0, 0.6, 0]), (4.5, [0.4, 1.3, 4.9], [0, 0.6, 0]), (11, [0.1, 1.5, 4.6], [0, 0.5, 0]))
    job["scene"]["objects"][1]["keys"] = [{"frame": 2}, {"frame": 7, "translate": [-0.3, 0, 0.4], "rotateDeg": [40, 0, 0]},
                                          {"frame": 12, "scale": [2, 1, 1]}]
    return job


class WithLatecomer(Builder):
    """Puts a node before all others whose scale is 0 up to frame 8."""

    def glb(self, roots, *rest, **more):
        late = self.node("late", mesh=1, translation=[0, 0.3, 2], scale=[0.1, 0.1, 0.1])
        self.animate(late, "scale", [1 / 24, 8 / 24], [[0, 0, 0], [0.1, 0.1, 0.1]], "STEP")
        return super().glb([late, *roots], *rest, **more)


def write_set(folder):
    (folder / "set.glb").write_bytes(make_set(3, alive=True, builder=WithLatecomer()))


def nodes(folder):
    """A glTF scene: its camera, nodes, bones and morph targets."""
    job = small_job(folder)
    write_set(folder)
    del job["camera"]
    job["scene"] = {"gltf": "set.glb"}
    return job


def followers(folder):
    """Camera and object that follow nodes."""
    job = small_job(folder)
    write_set(folder)
    job["camera"] = {"gltf": {"file": str(folder / "set.glb"), "node": "eye"}}
    job["scene"]["objects"][1] |= {"gltf": {"file": str(folder / "set.glb"), "node": "ball"}}
    return job


def light(folder):
    """Mixed maps that turn by keys and fade, before a plate for each frame. An object moves."""
    job = keys(folder)
    write_map(folder / "a.hdr")
    write_map(folder / "b.hdr", colour=lambda x, y, *_: (x / 9, y / 9, 0.3))
    write_map(folder / "seen.hdr", colour=lambda x, y, *_: (0.1, x / 9, y / 9))
    for number in range(4, 30):
        (folder / f"plate.{number}.png").write_bytes(png(48, 28, lambda x, y, n=number: (5 * x, 8 * y, 8 * n)))
    job["environment"] = {"keys": [{"frame": 2, "map": str(folder / "a.hdr")}, {"frame": 9, "map": str(folder / "b.hdr")}],
                          "scaleKeys": [{"frame": 1, "scale": 1}, {"frame": 7, "scale": 0.4}], "cameraMap": str(folder / "seen.hdr"),
                          "rotation": {"axis": [0, 1, 1], "keys": [{"frame": 3, "deg": 0}, {"frame": 8, "deg": 70}]}}
    job["output"] |= {"background": "plate", "plate": {"files": str(folder / "plate.#.png"), "speed": 2, "offset": 1,
                                                       "first": 4, "last": 29}}
    return job


def numbered_maps(folder):
    """A map for each frame, which turns from a frame of its own on."""
    job = keys(folder)
    for number in range(1, 8):
        write_map(folder / f"sky.{number}.hdr", colour=lambda x, y, *_, n=number: (x / n, y / 9, n / 9))
    job["environment"] = {"frames": {"files": str(folder / "sky.#.hdr"), "speed": 1.5, "first": 1, "last": 7, "beyond": "loop"},
                          "rotation": {"startFrame": 3, "degPerFrame": 4}}
    return job


KINDS = (keys, nodes, followers, light, numbered_maps)


def frame_5_is_one_picture(programs, folder):
    """In every job that has it; its vectors of motion lead to where the points are in frame 6 and were in frame 4."""
    for kind in KINDS:
        first = None
        for frames in FRAMES:
            place = folder / kind.__name__ / frames.replace(",", "+")
            pixels = programs.rendered(place, kind(place) | {"frames": frames})
            file = place / "frames" / "frame.0005.exr"
            got = {channel: programs.values(file, channel) for channel in MOTION}, pixels[file.name]
            first = first or got
            for channel in MOTION:
                check(any(got[0][channel]), f"{kind.__name__}, frames {frames}: {channel} is 0 everywhere")
                apart = max(abs(a - b) for a, b in zip(got[0][channel], first[0][channel], strict=True))
                check(apart == 0, f"{kind.__name__}: {channel} in the job of frames {frames} is {apart:.3f} pixels apart")
            check_equal(got[1], first[1], f"{kind.__name__}: frame 5 in the job of frames {frames}")


def a_job_of_more_frames_goes_on(programs, folder):
    """Frames that are there stay, and are those of the longer job, where samples are carried and all follows glTF files."""
    for kind in (nodes, followers):
        def job_of(place, frames, make=kind):
            return make(place) | {"frames": frames, "sampling": {"method": "pool", "numParticles": 4, "numCandidates": 16}}
        grown, once = (folder / kind.__name__ / name for name in ("grown", "once"))
        programs.rendered(grown, job_of(grown, "3-6"))
        check_equal(programs.rendered(grown, job_of(grown, "3-11")), programs.rendered(once, job_of(once, "3-11")),
                    f"{kind.__name__}: frames of a job that grew")


if __name__ == "__main__":
    run_tests()

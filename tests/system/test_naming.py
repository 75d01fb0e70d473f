"""Frames with the names of Blender's passes: the same values under other names, for Baton's own readers and for Blender."""

import json
import shutil
import subprocess
from pathlib import Path

from exr_frames import read_channel_list, read_frame
from farm import check, check_equal, run_tests
from jobs import camera_keys, make_job, write_job
from png_files import read_png

AOVS = ["lns", "normal", "depth", "variance", "albedo", "position", "z", "motion", "object", "material", "cryptoObject", "unshadowed", "blocked"]


def rendered(programs, folder, naming):
    job = make_job(folder / naming, frames="1-2", sampling={"method": "pool"},
                   camera=camera_keys((1, [0, 1.2, 5], [0, 0.6, 0]), (2, [0.3, 1.2, 5], [0.1, 0.6, 0])))
    job["output"].update(aovs=AOVS, pixelType="float", naming=naming, compression="zip")
    path = write_job(folder / naming / "job.json", job)
    programs.render(path, folder / naming / "work", threads=2)
    return folder / naming / "frames"


def stored_names(frame):
    """Channel names as the file has them."""
    data = frame.read_bytes()
    return {name for name, _ in read_channel_list(data[data.index(b"channels\0chlist\0") + 20:])}


def test_both_namings_hold_the_same(programs, folder):
    plain, blender = (rendered(programs, folder, naming) for naming in ("plain", "blender"))
    for name in ("frame.0001.exr", "frame.0002.exr"):
        a, b = read_frame(plain / name), read_frame(blender / name)
        check_equal(set(b.channels), set(a.channels), "channels by their plain names")
        for channel, values in a.channels.items():
            check_equal(list(b.channels[channel]), list(values), f"{name}: {channel}")
    names = stored_names(blender / "frame.0001.exr")
    check(all(channel.startswith("ViewLayer.") for channel in names), f"{names}")
    check({"ViewLayer.Combined.R", "ViewLayer.Depth.Z", "ViewLayer.Vector.W", "ViewLayer.CryptoObject00.R",
           "ViewLayer.variance.G", "ViewLayer.unshadowed.R", "ViewLayer.blocked.B"} <= names, f"{names}")
    check("Z" in stored_names(plain / "frame.0001.exr"), "plain names")

    # What people look at, by the same words.
    for options in ([], ["--aov", "depth"], ["--aov", "normal"]):
        pictures = []
        for frames in (plain, blender):
            programs.run("baton", "view", frames / "frame.0002.exr", *options, "--out", folder / "look.png")
            pictures.append(read_png(folder / "look.png"))
        check_equal(pictures[0], pictures[1], f"view {options}")
    check_equal((plain / "contact-sheet.png").read_bytes(), (blender / "contact-sheet.png").read_bytes(), "sheet")

    # Another naming writes frames anew from what is kept, and traces nothing.
    path = folder / "plain/job.json"
    job = json.loads(path.read_text())
    job["output"]["naming"] = "blender"
    done = programs.render(write_job(path, job), folder / "plain/work")
    check("written anew: output.naming" in done.stderr or "output.naming" in done.stderr, done.stderr)
    check("ViewLayer.Combined.R" in stored_names(plain / "frame.0001.exr"), "written anew")


def test_blender_shows_the_passes(programs, folder):
    """Where Blender is installed."""
    if not shutil.which("blender"):
        print("blender is not there: left out")
        return
    frame = rendered(programs, folder, "blender") / "frame.0002.exr"
    script = Path(__file__).with_name("blender_passes.py")
    done = subprocess.run(["blender", "-b", "--factory-startup", "--python-exit-code", "1", "--python", str(script), "--",
                           str(frame), "Vector", "160", "96", str(folder / "vector.exr")], capture_output=True, text=True, check=False)
    check_equal(done.returncode, 0, done.stdout + done.stderr)
    line = next(line for line in done.stdout.splitlines() if line.startswith("PASSES "))
    told = json.loads(line.removeprefix("PASSES "))
    check_equal(told["type"], "MULTILAYER", "the image")
    missing = {"Combined", "Depth", "Normal", "Position", "DiffCol", "IndexOB", "IndexMA", "Vector", "lns",
               "CryptoObject00", "variance", "unshadowed", "blocked"} - set(told["passes"])
    check(not missing, f"passes {missing} are missing among {told['passes']}")
    check_equal(told["crypto"], ["ViewLayer.CryptoObject"], "layers of the Cryptomatte node")
    vector, ours = read_frame(folder / "vector.exr"), read_frame(frame)
    for channel, wanted in (("R", ours.channels["backward.u"]), ("G", ours.channels["backward.v"]),
                            ("B", [-value for value in ours.channels["forward.u"]]),
                            ("A", [-value for value in ours.channels["forward.v"]])):
        off = max(abs(a - b) for a, b in zip(vector.channels[channel], wanted))
        check(off < 1e-4, f"Vector.{channel} is off by {off}")


if __name__ == "__main__":
    run_tests()

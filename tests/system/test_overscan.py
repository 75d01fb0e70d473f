"""Overscan: more pixels around the same ones, in the data window of the frames."""

from array import array

from exr_frames import read_frame
from farm import check, check_equal, run_tests
from jobs import camera_keys, make_job, write_job
from png_files import read_png

AROUND = [9, 4, 0, 17]
MOVING = camera_keys((1, [0, 1.2, 5], [0, 0.6, 0]), (3, [1.5, 1.2, 5], [0.5, 0.6, 0]))


def rendered(programs, folder, name, options=(), **changes):
    """The frames of a job by file name."""
    job = make_job(folder / name, frames="1-3", **changes)
    job["image"].update(width=92, height=56, sites=4, tileSize=32)
    job["image"].update(changes.get("image", {}))
    job["output"].update(pixelType="float", aovs=["normal", "depth", "motion", "cryptoObject", "source"])
    path = write_job(folder / name / "job.json", job)
    programs.render(path, folder / name / "work", workers=2, extra=options)
    frames = sorted((folder / name).glob("frames*/*.exr"))
    return [read_frame(file) for file in frames]


def check_same_inside(wide, plain):
    check_equal(len(wide), len(plain), "frames")
    for number, (w, p) in enumerate(zip(wide, plain), start=1):
        check_equal((p.display, p.window), ((0, 0, 92, 56), (0, 0, 92, 56)), "windows without overscan")
        check_equal((w.display, w.window), ((0, 0, 92, 56), (-9, -4, 92, 73)), "windows")
        check_equal(set(w.channels), set(p.channels), "channels")
        for name in p.channels:
            check_equal(array("f", w.shown(name)).tobytes(), p.channels[name].tobytes(), f"frame {number}: {name}")


def test_the_picture_is_the_same_bytes(programs, folder):
    """With a method that carries at rest, one that draws anew, shadows on a plate, and a camera that moves. The picture
    consists of whole blocks of pixels that learn together; those that its border cuts have other noise."""
    cases = {"pool": {"sampling": {"method": "pool"}},
             "moving": {"camera": MOVING, "sampling": {"method": "bidirectional"}}}
    for name, changes in cases.items():
        plain = rendered(programs, folder, name, **changes)
        wide = rendered(programs, folder, name + "-wide", image={"overscan": AROUND}, **changes)
        check_same_inside(wide, plain)
        outside = [v for i, v in enumerate(wide[0].channels["G"]) if i // 101 >= 60 or i % 101 < 9]
        check(sum(v > 0 for v in outside) > 0.9 * len(outside), f"{name}: nothing is rendered around the picture")
        check(len(set(outside)) > 0.5 * len(outside), f"{name}: pixels around the picture repeat each other")


def test_what_comes_into_view_has_its_history(programs, folder):
    """Fewer pixels of the picture start afresh; tiles do not show."""
    changes = {"camera": MOVING, "sampling": {"method": "pool"}}
    plain = rendered(programs, folder, "plain", **changes)
    wide = rendered(programs, folder, "wide", image={"overscan": 20}, **changes)
    other = rendered(programs, folder, "tiled", image={"overscan": 20, "tileSize": 17}, **changes)
    for frame in (1, 2):
        afresh = [sum(v > 0 for v in f[frame].shown("source.R")) for f in (plain, wide)]
        check(afresh[1] < afresh[0] - 20, f"frame {frame + 1}: afresh without and with overscan: {afresh}")
        for name, plane in wide[frame].channels.items():
            check_equal(plane.tobytes(), other[frame].channels[name].tobytes(), f"frame {frame + 1}: {name} in other tiles")


def test_looks_and_pictures_of_it(programs, folder):
    """--scale scales overscan, --region has it around the region; what people see is the picture."""
    job = make_job(folder, frames="1", sampling={"method": "bidirectional"})
    job["image"].update(overscan=AROUND, sites=1)
    path = write_job(folder / "job.json", job)
    told = programs.run("baton", "check", path).stdout
    check("image      160x96, " in told and "overscan 9 left, 4 on top, 0 right, 17 below: 169x117 are rendered" in told, told)
    programs.render(path, folder / "work")
    whole = read_frame(folder / "frames/frame.0001.exr")
    frame = folder / "frames/frame.0001.exr"
    programs.run("baton", "view", frame)
    check_equal(read_png(frame.with_suffix(".png"))[:2], (160, 96), "size of the PNG")
    programs.run("baton", "view", frame, "--overscan", "--out", folder / "all.png")
    check_equal(read_png(folder / "all.png")[:2], (169, 117), "size with overscan")
    sheet = read_png(folder / "frames/contact-sheet.png")
    picture = read_png(frame.with_suffix(".png"))
    check_equal(sheet[2][2][6:6 + 300], picture[2][0][:300], "the top of the picture on the sheet")

    programs.render(path, folder / "work2", extra=["--region", "40,20,50,30"])
    part = read_frame(folder / "frames-look/frame.0001.exr")
    check_equal((part.display, part.window), ((0, 0, 160, 96), (31, 16, 90, 67)), "windows of a region")
    check_equal(list(part.channels["G"]), [whole.channels["G"][(y + 4) * 169 + x + 9] for y in range(16, 67) for x in range(31, 90)],
                "pixels of the region")
    programs.render(path, folder / "work2", extra=["--scale", ".5"])
    half = read_frame(folder / "frames-look/frame.0001.exr")
    check_equal((half.display, half.window), ((0, 0, 80, 48), (-5, -2, 80, 57)), "windows at half the size")
    for value, text in [("[1,2]", "expected a number or a list of 4 numbers, got a list of 2"),
                        ("5000", "expected a number in [0, 4096], got 5000")]:
        programs.refuses("check", path, "--set", f"image.overscan={value}", says=f"--set: $.image.overscan: {text}")


if __name__ == "__main__":
    run_tests()

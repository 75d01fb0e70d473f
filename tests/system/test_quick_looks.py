"""Quick looks: a part of a job in a folder of its own, frames as PNG, and looks that follow the job file."""

import json
import re
import shutil
import subprocess

from assets import write_map
from exr_frames import read_frame
from farm import BAD_INPUT, IO, OK, USAGE, Farm, Process, check, check_equal, check_says, run_tests, wait_until
from jobs import make_job, write_job
from png_files import read_png, srgb


def job_at(folder, **changes):
    """A job file of four frames by `bidirectional`."""
    changes = {"frames": "1-4", "sampling": {"method": "bidirectional"}, **changes}
    return write_job(folder / "job.json", make_job(folder, **changes))


def render(programs, job, *extra, **options):
    return programs.run("baton", "render", job, "--threads-per-worker", 2, *extra, **options)


def test_a_look_leaves_finished_frames_alone(programs, folder):
    job = job_at(folder)
    render(programs, job)
    before = {path: path.stat().st_mtime_ns for path in (folder / "frames").iterdir()}
    done = render(programs, job, "--frames", "3", "--region", "40,16,80,48", "--scale", ".5", "--set",
                  "sampling.numParticles=4", "--out", folder / "look.png")
    after = {path: path.stat().st_mtime_ns for path in (folder / "frames").iterdir()}
    check_equal(after, before, "the job's own folder")
    look = folder / "frames-look"
    check_equal(sorted(path.name for path in look.glob("*.exr")), ["frame.0003.exr"], "frames of the look")
    check(f"frames go to {look}" in done.stderr, done.stderr)
    check("look.png, exposure +0 stops" in done.stdout, done.stdout)
    check(re.search(r"contact-sheet\.png, exposure [+-][0-9.]+ stops", done.stdout), done.stdout)
    check_equal(read_png(folder / "look.png")[:2], (40, 24), "size of the look")

    # Another look takes its place without further words; what changes nothing is the job itself.
    render(programs, job, "--frames", "3", "--set", "image.sites=4")
    same = render(programs, job, "--set", "sampling.numParticles=16", "--frames", "1-4")
    check(str(look) not in same.stdout + same.stderr, same.stdout + same.stderr)


def test_a_look_replaces_looks_only(programs, folder):
    """What another job or somebody has put into a folder of that name stays, until --restart."""
    job, other = job_at(folder), folder / "other"
    theirs = job_at(other, seed=3, output={"directory": str(folder / "frames-look")})
    programs.render(theirs, other / "work")
    frames = programs.pixels(folder / "frames-look")
    look = ("render", job, "--work-dir", folder / "work", "--frames", "2", "--scale", ".5")
    check_says(programs.run("baton", *look, expect=IO).stderr, "frame.0002.exr is not what a job has written", "--restart")
    check_equal(programs.pixels(folder / "frames-look"), frames, "frames of another job")
    programs.run("baton", *look, "--restart", expect=OK)
    programs.run("baton", *look[:-1], ".25", expect=OK)
    check_equal(read_frame(folder / "frames-look/frame.0002.exr").width, 40, "width of the last look")
    done = programs.run("baton", "render", theirs, "--work-dir", other / "work", expect=IO)
    check_says(done.stderr, "frame.0002.exr is not what a job has written")

    # In one coordinator: beside a job that has rendered nothing yet, and beside its frames.
    shutil.rmtree(folder / "frames-look")
    with Farm(programs, folder / "farm") as farm:
        ident = farm.submit(theirs)
        submit = ("job", "submit", job, "--frames", "2")
        says = ["it would replace", "--restart"]
        check_says(farm.baton(*submit, expect=BAD_INPUT).stderr, *says)
        check_equal(farm.show(ident)["status"], "running", "status of the job")
        farm.start_worker()
        farm.wait_for(ident)
        check_says(farm.baton(*submit, expect=BAD_INPUT).stderr, *says)
        check_equal(programs.pixels(folder / "frames-look"), frames, "frames of another job, beside a farm")
        for more in (["--restart"], ["--scale", ".25"]):
            farm.wait_for(farm.baton(*submit, *more).stdout.strip())
        check_equal(read_frame(folder / "frames-look/frame.0002.exr").width, 40, "width of the last look")
        check_says(farm.baton("job", "submit", theirs, expect=BAD_INPUT).stderr, *says)


def test_the_sheet_has_numbers_and_one_exposure(programs, folder):
    """Frames stand on it as a viewer shows them at the exposure that is told: a dark one beside a bright one stays dark."""
    job = job_at(folder, frames="1-2")
    write_map(folder / "dim.hdr", colour=lambda *_: (0.02, 0.02, 0.02))
    spec = json.loads(job.read_text())
    spec["environment"]["keys"] = [{"frame": 1, "map": "dim.hdr"}, {"frame": 2, "map": "lamp.hdr"}]
    spec["environment"]["interpolate"] = False
    told = render(programs, write_job(job, spec)).stdout
    rows = read_png(folder / "frames/contact-sheet.png")[2]
    dark, bright = (sum(sum(row[3 * x:3 * x + 480]) for row in rows[2:80]) for x in (2, 164))
    check(dark < 0.5 * bright, f"sums of {dark} and {bright}")
    for x in (2, 164):
        corner = {tuple(row[3 * i:3 * i + 3]) for row in rows[84:98] for i in range(x, x + 10)}
        check({(0, 0, 0), (255, 255, 255)} <= corner, f"no number at {x}")
    check("contact-sheet.png, exposure +0 stops" in told, told)
    shown = [[srgb(v) for v in programs.values(folder / f"frames/frame.000{f}.exr", "G")] for f in (1, 2)]
    for x, plane in zip((2, 164), shown):  # frames of 160x96 are on it as they are, but for the number
        off = [(i, y) for y in range(0, 70, 7) for i in range(0, 160, 11)
               if abs(rows[2 + y][3 * (x + i) + 1] - plane[160 * y + i]) > 1]
        check(not off, f"frame at {x}: pixels {off[:5]}")


def test_a_region_has_the_pixels_of_the_whole(programs, folder):
    job = job_at(folder, image={"sites": 4})
    render(programs, job, "--frames", "2-3")
    look = folder / "frames-look/frame.0003.exr"
    whole = programs.values(look, "G")
    render(programs, job, "--frames", "2-3", "--region", "35,20,90,50")
    part = programs.values(look, "G")
    # Blocks of 4 x 4 pixels, which learn together, have other noise where the border cuts them.
    inside = [(x, y) for y in range(20, 68) for x in range(36, 124)]
    check_equal([part[(y - 20) * 90 + x - 35] for x, y in inside], [whole[y * 160 + x] for x, y in inside],
                "pixels of the region")


def test_check_and_explain_take_the_same_options(programs, folder):
    job = job_at(folder)
    options = ["--frames", "2", "--region", "40,16,80,48", "--set", "image.sites=4"]
    report = programs.checked(job, *options, "--explain")
    check_equal(report["frames"], 1, "frames")
    check_equal(report["primaryRaysPerPixel"], 4, "sites")
    check_equal(report["outputDirectory"], str(folder / "frames-look"), "folder")
    settings = {s["path"]: s["value"] for s in report["settings"]}
    check_equal(settings["$.image.region"], [40, 16, 80, 48], "region")
    # What is explained can be set.
    check_equal(programs.run("baton", "check", job, "--set", "$.scene.objects[0].fitHeight=2").returncode, OK, "path")


def test_check_draws_the_scene(programs, folder):
    """What the camera sees and what it does not: an object that floats off the picture is seen from outside."""
    job = make_job(folder, frames="1-4")
    job["scene"]["objects"].append({"mesh": "sphere", "material": "chalk", "translate": [30, 12, 0]})
    path = write_job(folder / "job.json", job)
    done = programs.run("baton", "check", path, "--picture", folder / "scene.png")
    check("object     2 sphere (chalk): 2 x 2 x 2, x 29 to 31, y 11 to 13, z -1 to 1" in done.stdout, done.stdout)
    check("scene.png: frame 1 as the camera sees it" in done.stdout, done.stdout)
    width, height, rows = read_png(folder / "scene.png")
    check_equal((width, height), (640 + 4 + 640, 384), "size of the picture")

    def has(columns, hue):
        """Whether some pixels of these columns are of the hue: r > g > b and so on, plainly."""
        pixels = [row[3 * x:3 * x + 3] for row in rows for x in columns]
        return sum(1 for rgb in pixels if hue(*rgb)) > 20

    orange = lambda r, g, b: r > g + 20 > b + 60
    green = lambda r, g, b: g > b + 20 > r + 40
    check(has(range(640), orange), "the camera sees no object 0")
    check(not has(range(640), green), "the camera sees object 2")
    check(has(range(644, 1284), green), "object 2 is not to be seen from outside")


def test_faults_name_the_option(programs, folder):
    job = job_at(folder)
    for options, code, text in [
            (["--set", "sampling.numParticels=8"], BAD_INPUT,
             '--set: $.sampling.numParticels: unknown key; did you mean "numParticles"?'),
            (["--scale", "3"], BAD_INPUT, "--scale: $.image.scale: expected a number in (0, 1], got 3"),
            (["--region", "0,0,500,20"], BAD_INPUT, "--region: $.image.region: expected x, y, width and height"),
            (["--frames", "4-2"], BAD_INPUT, "--frames: $.frames: expected a last frame not before the first"),
            (["--set", "image.sites"], USAGE, "expected KEY=VALUE"),
            (["--out", "x.png"], USAGE, "--out x.png: expected a job of one frame, as with --frames 1, got 4")]:
        done = render(programs, job, *options, expect=code)
        check(text in done.stderr, f"{options}: {done.stderr}")
        check_equal(done.stdout, "", "stdout")
    check(not (folder / "frames").exists() and not (folder / "frames-look").exists(), "nothing was begun")


def test_view(programs, folder):
    job = job_at(folder, frames="1", sampling={"method": "pool"},
                 output={"aovs": ["normal", "depth", "variance", "visibility"], "background": "transparent"})
    render(programs, job)
    frame = folder / "frames/frame.0001.exr"

    # The colours as a viewer shows them: two stops more is four times the light.
    done = programs.run("baton", "view", frame)
    check("exposure +0 stops" in done.stdout and "frame.0001.png" in done.stdout, done.stdout)
    green = programs.values(frame, "G")
    for stops, out in [(0, folder / "frames/frame.0001.png"), (2, folder / "bright.png")]:
        programs.run("baton", "view", frame, "--exposure", stops, "--out", out)
        rows = read_png(out)[2]
        for i in range(0, len(green), 97):
            shown = rows[i // 160][3 * (i % 160) + 1]
            check(abs(shown - srgb(green[i] * 2**stops)) <= 1, f"{stops} stops: pixel {i}: {shown} for {green[i]}")

    # Depth: the nearest is white, the farthest dark, nothing black.
    done = programs.run("baton", "view", frame, "--aov", "depth", "--out", folder / "depth.png")
    depth = programs.values(frame, "depth")
    rows = read_png(folder / "depth.png")[2]
    shown = [rows[i // 160][3 * (i % 160)] for i in range(len(depth))]
    nearest = min(d for d in depth if d > 0)
    check_equal(shown[depth.index(nearest)], 255, "nearest")
    check_equal({s for s, d in zip(shown, depth) if d == 0}, {0}, "pixels without surface")
    check(min(s for s, d in zip(shown, depth) if d > 0) >= 25, "the farthest differs from nothing")
    check(f"depth {nearest:.4g} (white)" in done.stdout, done.stdout)

    # A normal of 0 is the middle.
    programs.run("baton", "view", frame, "--aov", "normal", "--out", folder / "normal.png")
    check_equal(read_png(folder / "normal.png")[2][0][:3], b"\x80\x80\x80", "normal of the background")

    # Shares are shown from 0 to 1, a variance up to what a hundredth of the pixels exceed.
    done = programs.run("baton", "view", frame, "--aov", "visibility", "--out", folder / "visibility.png")
    white = float(re.search(r"0 \(black\) to (\S+) \(white\)", done.stdout)[1])
    check(white >= 1, done.stdout)
    done = programs.run("baton", "view", frame, "--aov", "variance", "--out", folder / "variance.png")
    white = float(re.search(r"0 \(black\) to (\S+) \(white\)", done.stdout)[1])
    variance = [v for channel in "RGB" for v in programs.values(frame, f"variance.{channel}") if v > 0]
    above = sum(v > 1.001 * white for v in variance)
    check(len(variance) > 100 and 0.005 < above / len(variance) <= 0.01, f"{done.stdout}: {above} of {len(variance)}")

    programs.refuses("view", frame, "--aov", "dept",
                     says="--aov dept: no such AOV in the file; there is A, depth, normal, variance, visibility")
    programs.refuses("view", folder / "job.json", says="job.json")


def test_watch_follows_job_and_files(programs, folder):
    job = make_job(folder, frames="2", sampling={"method": "bidirectional"})
    path = write_job(folder / "job.json", job)
    out = folder / "look.png"
    watch = Process([programs.path("baton"), "render", str(path), "--watch", "--threads-per-worker", "2", "--out",
                     str(out)], folder / "watch.log")
    try:
        def rounds():
            return watch.log().count("waiting for changes")

        wait_until(lambda: rounds() == 1, "the first look")
        sizes = [line.split()[1] for line in watch.log().splitlines() if line.startswith("picture")]
        check_equal(len(sizes), 2, "pictures, coarse first")
        check_equal(read_png(out)[:2], (160, 96), "size of the look")
        check(not (folder / "frames").exists(), "only looks are rendered")
        first = out.read_bytes()

        # An asset changes, then the job, then it is broken and mended.
        write_map(folder / "lamp.hdr", colour=lambda *_: (1.0, 0.5, 0.25))
        wait_until(lambda: rounds() == 2, "the look under another map")
        check(out.read_bytes() != first, "another map, the same picture")
        job["image"]["width"] = 100
        write_job(path, job)
        wait_until(lambda: rounds() == 3, "the look of another size")
        check_equal(read_png(out)[:2], (100, 96), "size of the look")
        path.write_text("{")
        wait_until(lambda: rounds() == 4, "the message about a broken job")
        check("syntax error" in watch.log(), watch.log())
        job["image"]["width"] = 50
        write_job(path, job)
        wait_until(lambda: rounds() == 5, "the look of the mended job")
        check_equal(read_png(out)[:2], (50, 96), "size of the look")
        watch.terminate()
        check_equal(watch.wait(), OK, "exit code of a watch that is stopped")
    except subprocess.TimeoutExpired:
        print(watch.log())
        raise
    finally:
        watch.kill()


if __name__ == "__main__":
    run_tests()

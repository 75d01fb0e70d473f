#!/usr/bin/env python3
"""Pictures laid over plates: objects with the shadows that they cast on what is in the plate."""

import math
from array import array

from assets import png, write_exr, write_map
from exr_frames import read_frame
from farm import check, check_equal, run_tests
from jobs import camera_keys, make_job, write_job

WIDTH, HEIGHT = 96, 56
# What the camera sees behind: colour of the ground, colour of the sky. Dark, bright, and of a strong colour.
BEHIND = [([0.02, 0.02, 0.02], (0.002, 0.002, 0.002)), ([0.9, 0.9, 0.9], (4.0, 4.0, 4.0)), ([0.8, 0.1, 0.02], (0.01, 0.1, 2.0))]
# Two-sided; of all checks on one picture.
LEVEL_SIGMAS = 4.0


def sky(x, y, width, height):
    """Nothing comes from below, where a ground would be in the way and a catcher is not."""
    if abs(x - width // 4) <= 1 and abs(y - height // 4) <= 1:
        return (40.0, 36.0, 30.0)
    return (0.5, 0.6, 0.8) if y < height / 2 - 1 else (1e-6, 1e-6, 1e-6)


def job_of(folder, behind, seed, **output):
    """Two spheres on a small ground, before the sky."""
    ground, seen = BEHIND[behind]
    job = make_job(folder, frames="1", seed=seed, sampling={"method": "pool", "numParticles": 16, "numCandidates": 64},
                   quality={"rounds": 16}, output={"pixelType": "float", "aovs": [], **output})
    write_map(folder / "sky.hdr", colour=sky)
    write_map(folder / "seen.hdr", 2, 1, lambda *_: seen)
    job["image"] = {"width": WIDTH, "height": HEIGHT, "sites": 4, "siteSeed": 5}
    job["environment"] = {"map": str(folder / "sky.hdr"), "filter": "nearest", "cameraMap": str(folder / "seen.hdr")}
    job["scene"]["materials"]["ground"] = {"type": "diffuse", "color": ground}
    job["scene"]["ground"] = {"material": "ground", "height": 0, "size": 6}
    return job


def frame_of(programs, folder, job):
    programs.render_in(folder, job, threads=2)
    return read_frame(folder / "frames/frame.0001.exr")


def directly(programs, folder, behind, seed):
    """The picture with everything in it."""
    return frame_of(programs, folder, job_of(folder, behind, seed))


def plate(programs, folder, behind):
    """Without the spheres: as a photograph of the place."""
    job = job_of(folder, behind, seed=100)
    job["scene"]["objects"] = []
    job["sampling"] = {"method": "bidirectional", "numParticles": 64, "numCandidates": 512}
    frame_of(programs, folder, job)
    return folder / "frames/frame.0001.exr"


def catching(folder, behind, seed, **output):
    job = job_of(folder, behind, seed, **output)
    job["scene"]["ground"]["catcher"] = True
    return job


def is_even(values, i):
    """Whether a pixel and those around it show one thing, to 2 %."""
    around = [values[i + dx + WIDTH * dy] for dy in (-1, 0, 1) for dx in (-1, 0, 1) if 0 <= i + dx + WIDTH * dy < len(values)]
    return max(around) < 1.02 * min(around)


def kinds_of_pixels(alpha, shadow, seen):
    """Indices by what is in the pixel. Where edges of the plate itself meet those of objects, no picture laid over it can
    know which of both is seen."""
    edges = [i for i, a in enumerate(alpha) if 0.01 < a < 0.99 and is_even(seen, i)]
    caught = [i for i, a in enumerate(alpha) if a == 0 and shadow[i] < 0.9 and is_even(seen, i)]
    inside = [i for i, a in enumerate(alpha) if a == 1]
    return {"edges": edges, "shadows": caught, "objects": inside}


def test_three_backgrounds_without_fringe(programs, folder):
    """Hypothesis: laid over the plate, each kind of pixel has the mean of the picture with everything in it. Seeds 1 to 4,
    two of each picture, so that their differences tell the noise; 4 standard deviations, 27 checks: level 0.002."""
    open_frame = frame_of(programs, folder / "kinds", catching(folder / "kinds", 1, 9, background="transparent"))
    seen = read_frame(plate(programs, folder / "seen", 2)).channels["B"]
    kinds = kinds_of_pixels(open_frame.channels["A"], open_frame.channels["shadow.G"], seen)

    check(all(len(pixels) > 80 for pixels in kinds.values()), f"pixels: { {k: len(p) for k, p in kinds.items()} }")
    for behind in range(len(BEHIND)):
        place = folder / str(behind)
        seen = plate(programs, place / "plate", behind)
        laid, direct = [], []
        for seed in (1, 2):
            job = catching(place / f"laid-{seed}", behind, seed, background="plate", plate=str(seen))
            laid.append(frame_of(programs, place / f"laid-{seed}", job))
            direct.append(directly(programs, place / f"direct-{seed}", behind, seed + 2))
        check_equal(set(laid[0].channels["A"]), {1.0}, "alpha over a plate")
        for kind, pixels in kinds.items():
            for channel in "RGB":
                a, b, c, d = ([frame.channels[channel][i] for i in pixels] for frame in laid + direct)
                off = sum(p + q - r - s for p, q, r, s in zip(a, b, c, d)) / 2
                spread = math.sqrt(sum((p - q) ** 2 + (r - s) ** 2 for p, q, r, s in zip(a, b, c, d))) / 2
                bound = LEVEL_SIGMAS * spread + 1e-4 * sum(c)
                check(abs(off) <= bound, f"behind {behind}: {kind} {channel}: {off / sum(c):+.4%} of the light, "
                                         f"allowed {bound / sum(c):.4%}")


def write_png(path, color):
    """Twice as large as the picture."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(png(2 * WIDTH, 2 * HEIGHT, color))


def light_of(value):
    """Of an 8-bit sRGB value."""
    v = value / 255
    return v / 12.92 if v <= 0.04045 else ((v + 0.055) / 1.055) ** 2.4


def plates_of_a_shot(folder):
    """Twice as large as the picture; numbers 11 to 13."""
    for number in (11, 12, 13):
        write_png(folder / f"shot.{number:03}.png", lambda x, y, n=number: (x % 256, (2 * y) % 256, 20 * n % 256))


def shot(folder, **output):
    """Three frames with a camera that moves."""
    job = catching(folder, 0, 1, **output)
    job["frames"] = "1-3"
    job["quality"] = {"rounds": 1}
    job["sampling"]["method"] = "bidirectional"  # of which overscan changes no pixel
    job["scene"]["ground"]["size"] = 100
    job["image"].update(tileSize=32)
    job["camera"] = camera_keys((1, [0, 1.2, 5], [0, 0.6, 0]), (3, [0.5, 1.2, 5], [0.1, 0.6, 0]))
    return job

# Above only the sky and spheres, below only the ground and spheres: beside spheres all sites of a pixel see the same.
SKY, GROUND = 10, 34
PLATE = {"files": "shot.###.png", "offset": 10}


def rendered(programs, folder, job, **options):
    job["output"]["directory"] = str(folder / "frames")
    told = programs.render(write_job(folder.parent / f"{folder.name}.json", job), folder.parent / "work", **options).stderr
    return told, [read_frame(file) for file in sorted((folder / "frames").glob("*.exr"))]


def over(frame, number, x, y, channel):
    """A pixel laid over the plate by hand, as docs/plates.md says."""
    i = (y - frame.window[1]) * frame.width + x - frame.window[0]
    texel = [light_of((u % 256, (2 * v) % 256, 20 * number % 256)["RGB".index(channel)])
             for v in (2 * y, 2 * y + 1) for u in (2 * x, 2 * x + 1)]
    return frame.channels[channel][i] + (1 - frame.channels["A"][i]) * frame.channels[f"shadow.{channel}"][i] * sum(texel) / 4


def test_numbered_plates_reach_their_frames(programs, folder):
    """Frame by frame, in any tiles; with overscan there is no plate beside the picture."""
    plates_of_a_shot(folder)
    _, open_frames = rendered(programs, folder / "open", shot(folder, background="transparent"))
    job = shot(folder, background="plate", plate=PLATE)
    job["image"].update(overscan=[3, 0, 5, 2], tileSize=23)
    _, laid = rendered(programs, folder / "laid", job, workers=2)
    for number, (frame, under) in enumerate(zip(laid, open_frames), start=11):
        for y in (*range(SKY), *range(GROUND, HEIGHT)):
            for x in range(WIDTH):
                for channel in "RGB":
                    got = frame.channels[channel][y * frame.width + x + 3]
                    expected = over(under, number, x, y, channel)
                    check(abs(got - expected) < 1e-5 + 1e-5 * expected, f"{number}: {channel} at {x},{y}: {got}, {expected}")
        beside = [frame.channels["A"][y * frame.width + x] for y in range(20) for x in (0, 1, 2, frame.width - 1)]
        check_equal(set(beside), {0.0}, "alpha beside the plate")


def test_other_plates_write_frames_anew(programs, folder):
    plates_of_a_shot(folder)
    job = shot(folder, background="plate", plate=PLATE)
    rendered(programs, folder / "shot", job)
    before = programs.pixels(folder / "shot/frames")
    write_png(folder / "shot.012.png", lambda x, y: (9, 99, 199))
    told, _ = rendered(programs, folder / "shot", job)
    check("frames 1,3 are kept" in told and "output.plate has changed" in told, told)
    after = programs.pixels(folder / "shot/frames")
    check_equal([name for name in before if before[name] != after[name]], ["frame.0002.exr"], "other frames")
    # Without the plate all are others. Films that stay, for another sweep, are those of frames with and without it.
    job["output"]["background"] = "transparent"
    job["quality"]["refinable"] = True
    told, _ = rendered(programs, folder / "shot", job)
    check("are kept" not in told and "output.background" in told, told)
    job["output"]["background"] = "plate"
    told, _ = rendered(programs, folder / "shot", job)
    check("frames 1-3 are put together from what is rendered" in told, told)
    check_equal(programs.pixels(folder / "shot/frames"), after, "pixels over the plates again")


def test_shadows_in_alpha(programs, folder):
    """A compositor that only lays over gets grey shadows; frames have no other channels for them."""
    shadows, = rendered(programs, folder / "channels", shot(folder, background="transparent"))[1][:1]
    alpha, = rendered(programs, folder / "alpha", shot(folder, background="transparent", shadows="alpha"))[1][:1]
    check_equal(set(alpha.channels), set("RGBA"), "channels")
    check_equal(alpha.channels["G"].tobytes(), shadows.channels["G"].tobytes(), "colours")
    dark = 0
    for i, a in enumerate(shadows.channels["A"]):
        if a != 0 or i // WIDTH < GROUND:
            continue
        grey = sum(w * shadows.channels[f"shadow.{c}"][i] for c, w in zip("RGB", (0.2126, 0.7152, 0.0722)))
        check(abs(1 - grey - alpha.channels["A"][i]) < 1e-5, f"pixel {i}: {alpha.channels['A'][i]}, {1 - grey}")
        dark += grey < 0.7
    check(dark > 50, f"{dark} pixels in shadow")


def test_pixels_that_are_odd(programs, folder):
    """NaN counts as 0 and is told, what is below zero stays and is not Baton's own."""
    folder.mkdir(parents=True, exist_ok=True)
    rows = [array("f", [-0.5, 0.25, 2.0] * WIDTH) for _ in range(HEIGHT)]
    for y in range(HEIGHT):
        rows[y][3 * 48 + 1] = math.nan  # a column through sky, spheres and ground
    write_exr(folder / "odd.exr", WIDTH, rows)
    job = shot(folder, background="plate", plate="odd.exr")
    job["frames"] = "1"
    path = write_job(folder / "job.json", job)
    told = f"odd.exr: {HEIGHT} pixels are NaN or infinite and count as 0"
    check_equal(programs.run("baton", "check", path).stdout.count(told), 1, "warnings")
    result = programs.render(path, folder / "work")
    check("below zero" not in result.stdout and "WRONG" not in result.stdout, result.stdout)
    check(any(told in log.read_text(encoding="utf-8") for log in (folder / "work").glob("worker-*.log")), "in no worker's log")
    frame = read_frame(folder / "frames/frame.0001.exr")
    at = 3 * WIDTH + 48  # in the sky
    check_equal([frame.channels[c][at + 1] for c in "RGB"], [-0.5, 0.25, 2.0], "the plate's own colours")
    check_equal([frame.channels[c][at] for c in "RGB"], [-0.5, 0.0, 2.0], "what is repaired")


def test_values_without_effect_are_told(programs, folder):
    plates_of_a_shot(folder)
    for output, told in [({"background": "transparent", "plate": PLATE}, "output.plate: no effect"),
                         ({"background": "transparent", "shadows": "alpha"}, 'output.shadows: "alpha" has no effect')]:
        job = shot(folder, **output)
        del job["scene"]["ground"]["catcher"]
        path = write_job(folder / "job.json", job)
        check(told in programs.run("baton", "check", path).stdout, told)
    for output in ({"background": "plate", "plate": PLATE}, {"background": "transparent", "shadows": "alpha"}):
        path = write_job(folder / "job.json", shot(folder, **output))
        check("no effect" not in programs.run("baton", "check", path).stdout, f"{output}")


def test_faults_name_file_and_place(programs, folder):
    plates_of_a_shot(folder)
    (folder / "text.png").write_text("no picture", encoding="ascii")
    (folder / "small.png").write_bytes(png(WIDTH // 2, HEIGHT // 2, lambda x, y: (1, 2, 3)))
    cases = [({"background": "plate"}, "$.output.plate: expected a picture or numbered pictures, as background is plate"),
             ({"background": "plate", "plate": "none.png"}, "none.png"),
             ({"background": "plate", "plate": {**PLATE, "offset": 9}}, "shot.010.png"),
             ({"background": "plate", "plate": "text.png"}, "text.png: not an image"),
             ({"background": "plate", "plate": "small.png"}, f"expected a plate of the picture's {WIDTH} x {HEIGHT} pixels"),
             ({"background": "plate", "plate": "job.mov"}, "$.output.plate"),
             ({"background": "plate", "plate": {**PLATE, "first": 5, "last": 4}}, "$.output.plate.last: expected at least first, 5"),
             ({"background": "plate", "plate": {**PLATE, "beyond": "loop"}}, "$.output.plate.last"),
             ({"shadows": "alpha"}, "$.output.shadows: expected channels, as background is not transparent")]
    for output, expected in cases:
        path = write_job(folder / "job.json", shot(folder, **output))
        for command in ("check", "render"):
            programs.refuses(command, path, says=expected)


if __name__ == "__main__":
    run_tests()

"""Movies and numbered PNGs of a sequence, as ffmpeg and its reader see them."""

import os
import re
import subprocess

from farm import BAD_INPUT, OK, check, check_equal, run_tests
from jobs import camera_keys, make_job, write_job
from png_files import read_png, srgb

IO_ERROR = 74


def rendered(programs, folder, aovs=("depth",), **changes):
    """The file of a job of six frames of 81x47 pixels, rendered; a lamp that turns."""
    job = make_job(folder, frames="1-6", sampling={"method": "bidirectional", "numParticles": 2, "numCandidates": 4},
                   image={"width": 81, "height": 47}, **changes)
    job["output"].update(aovs=list(aovs), framesPerSecond=12)
    programs.render_in(folder, job, threads=2)
    return folder / "job.json"


def probe(movie):
    """Width, height, frames and rate of a movie."""
    command = ["ffprobe", "-v", "error", "-count_frames", "-select_streams", "v:0", "-show_entries",
               "stream=width,height,nb_read_frames,r_frame_rate,color_space", "-of", "default=noprint_wrappers=1", str(movie)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return dict(line.split("=") for line in done.stdout.splitlines())


def decoded(movie, width, height):
    """The RGB bytes of each frame of a movie."""
    command = ["ffmpeg", "-v", "error", "-i", str(movie), "-vf", "scale=in_color_matrix=bt709:flags=accurate_rnd+full_chroma_int", "-f", "rawvideo",
               "-pix_fmt", "rgb24", "-"]
    data = subprocess.run(command, capture_output=True, check=True).stdout
    size = 3 * width * height
    return [data[i:i + size] for i in range(0, len(data), size)]


def test_a_movie_shows_what_view_shows(programs, folder):
    job = rendered(programs, folder)
    frames = folder / "frames"
    done = programs.run("baton", "movie", job, "--curve", "filmic", "--exposure", "-1")
    movie = frames / "preview.mp4"
    check_equal(done.stdout, f"{movie}  6 frames at 12 a second, 81x47, exposure -1 stops (x0.5), filmic curve\n", "stdout")
    facts = probe(movie)
    check_equal((facts["width"], facts["height"], facts["nb_read_frames"], facts["r_frame_rate"], facts["color_space"]),
                ("82", "48", "6", "12/1", "bt709"), "the movie")
    check(not list(frames.glob("*.part")), "nothing unfinished is left")
    programs.run("baton", "view", frames / "frame.0004.exr", "--curve", "filmic", "--exposure", "-1", "--out", folder / "4.png")
    width, height, rows = read_png(folder / "4.png")
    shown = decoded(movie, 82, 48)[3]
    # Colours have half the size in a movie, so green, which is most of the brightness, is nearest; no channel is shifted.
    for channel, most in ((0, 8), (1, 4), (2, 8)):
        off = [shown[3 * (82 * y + x) + channel] - rows[y][3 * x + channel] for y in range(height) for x in range(width)]
        mean, size = sum(off) / len(off), sum(map(abs, off)) / len(off)
        check(abs(mean) < 1 and size < most, f"channel {channel} of frame 4 is off by {mean}, in size by {size}")
    for y in range(height):  # the odd column is there twice
        check(abs(shown[3 * (82 * y + 81)] - shown[3 * (82 * y + 80)]) < 40, f"row {y}")

    # From the folder alone, at the rate that the header has.
    programs.run("baton", "movie", frames, "--out", folder / "new/look.webm", "--frames", "2-5x3")
    facts = probe(folder / "new/look.webm")
    check_equal((facts["nb_read_frames"], facts["r_frame_rate"]), ("2", "12/1"), "a movie of two frames")
    programs.run("baton", "movie", frames, "--out", folder / "look.webp", "--fps", 5)
    check_equal((folder / "look.webp").read_bytes()[8:12], b"WEBP", "a WebP file")


def test_the_filmic_curve(programs, folder):
    """As it is published, beside what is shown without a curve."""
    rendered(programs, folder)
    frame = folder / "frames/frame.0001.exr"
    programs.run("baton", "view", frame, "--exposure", 2, "--curve", "filmic", "--out", folder / "a.png")
    rows = read_png(folder / "a.png")[2]
    for i, v in enumerate(programs.values(frame, "G")):
        x = 4 * v
        wanted = srgb(x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14))
        check(abs(rows[i // 81][3 * (i % 81) + 1] - wanted) <= 1, f"pixel {i}: {rows[i // 81][3 * (i % 81) + 1]}, {wanted}")


def test_pngs_need_no_ffmpeg(programs, folder):
    job = rendered(programs, folder)
    command = [programs.path("baton"), "movie", str(job)]
    bare = {**os.environ, "PATH": str(folder)}
    done = subprocess.run([*command, "--out", str(folder / "pngs")], capture_output=True, text=True, env=bare, check=False)
    check_equal(done.returncode, OK, done.stderr)
    check_equal(sorted(path.name for path in (folder / "pngs").iterdir()), [f"frame.{f:04}.png" for f in range(1, 7)], "files")
    programs.run("baton", "view", folder / "frames/frame.0003.exr", "--out", folder / "3.png")
    check_equal((folder / "pngs/frame.0003.png").read_bytes(), (folder / "3.png").read_bytes(), "frame 3")
    done = subprocess.run(command, capture_output=True, text=True, env=bare, check=False)
    check_equal(done.returncode, IO_ERROR, "exit code without ffmpeg")
    check("preview.mp4: the program ffmpeg, of Debian's package ffmpeg, is not there" in done.stderr, done.stderr)
    check_equal(done.stderr.count("\n"), 1, "lines of the error")
    check(not list((folder / "frames").glob("preview*")), "nothing is begun")


def test_an_aov_means_the_same_in_all_frames(programs, folder):
    """As the first frame has it: depth under a camera that moves away."""
    job = rendered(programs, folder, camera=camera_keys((1, [0, 1.2, 5], [0, 0.6, 0]), (6, [0, 1.2, 9], [0, 0.6, 0])))
    programs.run("baton", "movie", job, "--aov", "depth", "--out", folder / "depth")
    first, last = (folder / f"frames/frame.000{f}.exr" for f in (1, 6))
    told = programs.run("baton", "view", first, "--aov", "depth", "--out", folder / "1.png").stdout
    near, far = re.search(r"depth (\S+) \(white\) to (\S+) \(dark", told).groups()
    check_equal(read_png(folder / "depth/frame.0001.png"), read_png(folder / "1.png"), "frame 1")
    programs.run("baton", "view", last, "--aov", "depth", "--range", near, far, "--out", folder / "6.png")
    shown, wanted = (read_png(path)[2] for path in (folder / "depth/frame.0006.png", folder / "6.png"))
    check(all(abs(a - b) <= 1 for row, other in zip(shown, wanted) for a, b in zip(row, other)), "frame 6")
    programs.run("baton", "view", last, "--aov", "depth", "--out", folder / "own.png")
    check(read_png(folder / "own.png")[2] != shown, "frame 6 has other values")


def test_motion_is_seen_as_colors(programs, folder):
    """What stands still is grey; the camera goes to the right, so all of the scene goes to the left."""
    rendered(programs, folder, aovs=["motion"], camera=camera_keys((1, [0, 1.2, 5], [0, 1.2, 0]), (6, [2, 1.2, 5], [2, 1.2, 0])))
    told = programs.run("baton", "view", folder / "frames/frame.0003.exr", "--aov", "forward", "--out", folder / "1.png").stdout
    check("u red, v green, -" in told, told)
    row = read_png(folder / "1.png")[2][-1]
    check(max(row[0::3]) < 120 and all(abs(v - 128) < 8 for v in row[2::3]), f"the ground goes to the left: {row[:9]}")


def test_faults(programs, folder):
    job = rendered(programs, folder)
    frames = folder / "frames"
    for path in (frames / "frame.0002.exr", frames / "frame.0003.exr"):
        path.unlink()
    done = programs.run("baton", "movie", job, expect=BAD_INPUT)
    check_equal(done.stderr, f"{frames}: frames 2-3 are missing; --skip-missing does without them\n", "stderr")
    programs.run("baton", "movie", job, "--skip-missing")
    check_equal(probe(frames / "preview.mp4")["nb_read_frames"], "4", "frames that are there")
    programs.run("baton", "movie", frames)
    for options, code, text in [
            ([job, "--out", "a.gif"], 64, "--out a.gif: expected a name that ends in .mp4, .webm or .webp"),
            ([job, "--frames", "2-3"], BAD_INPUT, f"{frames}: none of the frames 2-3 is there"),
            ([frames, "--frames", "5,7"], BAD_INPUT, "frames 7 are missing"),
            ([frames, "--aov", "dept"], BAD_INPUT, "frame.0001.exr: --aov dept: no such AOV in the file"),
            ([frames, "--range", 2, 1], 64, "--range: 2 1: expected a larger second number"),
            ([frames, "--curve", "film"], 64, "film"),
            ([folder, "--frames", "1"], BAD_INPUT, f"{folder}: no frames, such as frame.0001.exr")]:
        programs.refuses("movie", *options, says=text, expect=code)
    (frames / "other.0001.exr").write_bytes((frames / "frame.0001.exr").read_bytes())
    programs.refuses("movie", frames, says="frames named frame.#.exr and other.#.exr, expected one sequence")
    (frames / "frame.0004.exr").write_bytes(b"no frame")
    done = programs.run("baton", "movie", job, "--skip-missing", "--out", folder / "b.mp4", expect=BAD_INPUT)
    check("frame.0004.exr" in done.stderr and not (folder / "b.mp4").exists(), done.stderr)
    check(not list(folder.glob("*.part")), "nothing unfinished is left")


def test_check_tells_of_exposures_of_maps(programs, folder):
    """A map that says its exposure lights as one that is stored as it is."""
    job = make_job(folder, frames="1")
    path = write_job(folder / "job.json", job)
    plain = programs.run("baton", "check", path).stdout
    check("converted" not in plain, plain)
    whole = (folder / "lamp.hdr").read_bytes()
    (folder / "lamp.hdr").write_bytes(whole.replace(b"rgbe\n", b"rgbe\nEXPOSURE=0.5\n", 1))
    told = programs.run("baton", "check", path).stdout
    check("converted: divided by its exposure, 0.5" in told, told)


if __name__ == "__main__":
    run_tests()

#!/usr/bin/env python3
"""A job whose settings change keeps what is right; one whose picture changes is refused.

Bytes are those of the whole job rendered at once, in a folder of its own.
"""

import json
import os

from farm import BAD_INPUT, OK, USAGE, Farm, check, check_equal, check_says, run_tests, wait_until
from jobs import camera_keys, make_job, write_job

KINDS = {
    "rest": {},
    "motion": {"camera": camera_keys((1, [0, 1.2, 5], [0, 0.6, 0]), (6, [0.5, 1.3, 4.8], [0, 0.6, 0]))},
    "second-pass": {"visibility": {"correlated": True, "dilate": 1}},
}
METHODS = {"pool": {"method": "pool", "numParticles": 8},
           "sequential": {"method": "sequential", "numParticles": 8, "numCandidates": 32, "numDistributions": 3}}
FOLDER = "frames"


def small_job(folder, frames, **changes):
    """A job of 96 x 64 pixels in two tiles. changes: as make_job's, `sampling` in place of its own."""
    sampling = changes.pop("sampling", METHODS["pool"])
    job = make_job(folder, frames=frames, **changes)
    job["image"] = {"width": 96, "height": 64, "tileSize": 64, **changes.get("image", {})}
    job["sampling"] = sampling
    job["state"] = {"checkpointEvery": 12, **changes.get("state", {})}
    job["output"] = {"directory": str(folder / FOLDER), **changes.get("output", {})}
    return job


def render(programs, folder, job, *extra, expect=OK):
    """Renders in the folder's own farm; returns what was said on stderr."""
    return programs.render_in(folder, job, extra=extra, expect=expect).stderr


def files(folder):
    """Bytes of each frame, by number."""
    return {int(file.name[6:10]): file.read_bytes() for file in sorted((folder / FOLDER).glob("*.exr"))}


def stamps(folder):
    """When each frame was written."""
    return {file.name: os.stat(file).st_mtime_ns for file in (folder / FOLDER).glob("*.exr")}


def rewritten(before, folder):
    """Names of frames that are not the file that they were."""
    after = stamps(folder)
    return sorted(name for name, time in before.items() if after.get(name) != time)


def witness(programs, folder, frames, **changes):
    """The pixels of the whole job."""
    return programs.rendered(folder, small_job(folder, frames, **changes))


def each_kind():
    for kind, changes in KINDS.items():
        for method, sampling in METHODS.items():
            if kind == "second-pass" and method == "pool":
                continue  # its rays are not its samples
            yield f"{kind}-{method}", {**changes, "sampling": sampling}


def more_frames_and_other_tiles(programs, folder):
    """Frames 1-4, then 1-6: the first four are left alone, the rest goes on from their last states, which are cut and
    joined where tiles are others."""
    for name, changes in each_kind():
        expected = witness(programs, folder / f"whole-{name}", "1-6", **changes)
        for tile_size, told in ((64, ""), (32, ", cut into tiles of 32 pixels")):
            place = folder / f"{name}-{tile_size}"
            render(programs, place, small_job(place, "1-4", **changes))
            before = stamps(place)
            text = render(programs, place, small_job(place, "1-6", image={"tileSize": tile_size}, **changes))
            check_says(text, "frames 1-4 are kept", "frames 5-6 are rendered, going on from the states of frame 4" + told)
            check_equal(rewritten(before, place), [], f"frames of {name} written again")
            check_equal(programs.pixels(place / FOLDER), expected, f"pixels of {name} in tiles of {tile_size}")


def settings_alone(programs, folder):
    """Fewer frames, priority, names, metadata, retries, checkpoints, what is kept: nothing is made again."""
    job = small_job(folder, "1-6")
    render(programs, folder, job)
    before = stamps(folder)
    for changes in [{"frames": "1-3"}, {"priority": 80}, {"maxRetriesPerTask": 1}, {"name": "other"},
                    {"metadata": {"shot": "7"}}, {"state": {"checkpointEvery": 2, "keep": "all"}},
                    {"image": {**job["image"], "tileSize": 32}}, {}]:
        text = render(programs, folder, {**job, **changes})
        check_says(text, "are kept")
        check("rendered" not in text, f"{changes}: {text}")
        check_equal(rewritten(before, folder), [], f"frames written again for {changes}")
    check_says(render(programs, folder, {**job, "metadata": {"shot": "8"}}), "keep their headers")


def what_is_written_otherwise(programs, folder):
    """Other channels and formats are written anew, and the program says why."""
    job = small_job(folder, "1-3")
    render(programs, folder, job)
    before = stamps(folder)
    changed = {**job, "output": {**job["output"], "aovs": ["depth"], "compression": "piz"}}
    check_says(render(programs, folder, changed), "written anew: output.aovs, output.compression have changed")
    check_equal(len(rewritten(before, folder)), 3, "frames written again")


def one_frame_is_gone_or_damaged(programs, folder):
    """Only that one is written; damage that keeps the size is noticed."""
    job = small_job(folder, "1-4")
    render(programs, folder, job)
    expected = files(folder)
    for number, damage in [(2, False), (3, True)]:
        frame = folder / FOLDER / f"frame.{number:04}.exr"
        before = stamps(folder)
        if damage:
            content = bytearray(frame.read_bytes())
            content[len(content) // 2] ^= 1
            frame.write_bytes(content)
        else:
            frame.unlink()
        text = render(programs, folder, job)
        check_says(text, f"frame {number} is rendered", f"{frame} is gone, or not as it was last written")
        check_equal(rewritten(before, folder), [frame.name], "frames written again")
        check(files(folder) == expected, f"frame {number} is not what it was")


def another_picture(programs, folder):
    """Refused with what differs; --from-frame keeps the frames before, --restart replaces all."""
    job = small_job(folder, "1-6")
    render(programs, folder, job)
    before, first = stamps(folder), programs.pixels(folder / FOLDER)
    other = {**job, "seed": 8}
    text = render(programs, folder, other, expect=BAD_INPUT)
    check_says(text, "what differs: $.seed", "--restart", "--from-frame")
    check_equal(rewritten(before, folder), [], "frames that a refused job has touched")

    # As a job that begins there.
    later = witness(programs, folder / "later", "4-6", seed=8)
    render(programs, folder, other, "--from-frame", "4")
    now = programs.pixels(folder / FOLDER)
    for number in range(1, 7):
        name = f"frame.{number:04}.exr"
        check_equal(now[name], first[name] if number < 4 else later[name], name)
    check_equal(len(rewritten(before, folder)), 3, "frames replaced from frame 4 on")
    check_says(render(programs, folder, other, "--from-frame", "4"), "frames 4-6 are kept")
    render(programs, folder, other, "--from-frame", "9", expect=USAGE)

    check_says(render(programs, folder, other, "--restart"), "are replaced: $.seed differs")
    check_equal(programs.pixels(folder / FOLDER), witness(programs, folder / "all", "1-6", seed=8), "pixels")


def a_folder_has_one_name(programs, folder):
    """However a document writes it: the same job, whose locks hold, and no second writer."""
    names = ["frames", "frames/", "./frames/.", "../one/frames", "link"]
    place = folder / "one"
    place.mkdir(parents=True)
    (place / "link").symlink_to(place / "frames")
    with Farm(programs, place / "farm") as farm:
        def submit(output, *extra, expect=OK, **changes):
            job = small_job(place, "1-2", **changes)
            job["output"]["directory"] = f"{place}/{output}"
            return farm.baton("job", "submit", write_job(place / "job.json", job), "--json", *extra, expect=expect)

        worker = farm.start_worker()
        ident = json.loads(submit(names[0]).stdout)["id"]
        farm.wait_for(ident)
        before = files(place)
        for name in names[1:]:
            check_says(submit(name).stdout, ident, "frames 1-2 are kept")
            farm.wait_for(ident)
        check_equal(files(place), before, "frames")

        # Nobody else writes there.
        worker.terminate()
        worker.wait()
        submit("link/", seed=9, expect=BAD_INPUT)
        submit("frames", "--restart", seed=9)
        check_says(submit("./frames", name="another", seed=10, expect=None).stderr, "frames")
        farm.baton("job", "cancel", ident)
        farm.baton("job", "lock", ident, "--frames", "2")
        check_says(submit("link", "--restart", name="another", seed=10, expect=BAD_INPUT).stderr, "are locked in job")
        farm.start_worker()
        submit("frames/", "--restart", seed=9)
        farm.wait_for(ident)
        check_equal(files(place)[2], before[2], "the locked frame")
        check(files(place)[1] != before[1], "the other frame is of another picture")


def a_folder_that_was_moved_is_the_same(programs, folder):
    """A link stands in its place, from the first or later: job, frames and locks stay, for whoever names the new place, too."""
    for how in ("a link later", "a link from the first"):
        place = folder / how.replace(" ", "-")
        place.mkdir(parents=True)
        if how == "a link from the first":
            (place / "disk1").mkdir()
            (place / FOLDER).symlink_to(place / "disk1")
        painted = None
        with Farm(programs, place / "farm", workers=1) as farm:
            def submit(frames, *extra, expect=OK, **changes):
                job = small_job(place, frames)
                job["output"]["directory"] = changes.pop("output", job["output"]["directory"])
                return farm.baton("job", "submit", write_job(place / "job.json", {**job, **changes}), "--json", *extra, expect=expect)

            ident = json.loads(submit("1-3").stdout)["id"]
            farm.wait_for(ident)
            before = files(place)
            (place / FOLDER / "frame.0003.exr").write_bytes(painted := before[1])
            farm.baton("job", "lock", ident, "--frames", "3")
            moved = place / FOLDER if how == "a link later" else place / "disk1"
            moved.rename(place / "disk2")
            (place / FOLDER).unlink(missing_ok=True)
            (place / FOLDER).symlink_to(place / "disk2")

            check_says(submit("1-5").stdout, ident, "frames 1-3 are kept")
            farm.wait_for(ident)
            another = {"name": "another", "seed": 9, "output": str(place / "disk2"), "expect": BAD_INPUT}
            check_says(submit("1-3", "--restart", **another).stderr, "are locked in job")
            submit("1-5", "--restart", seed=9)
            farm.wait_for(ident)
            check_equal((place / "disk2/frame.0003.exr").read_bytes(), painted, "the locked frame")
            check(files(place)[1] != before[1], "the other frames are of another picture")

            # What it wrote there is its own still when the link leads elsewhere.
            (place / FOLDER).unlink()
            (place / "elsewhere").mkdir()
            (place / FOLDER).symlink_to(place / "elsewhere")
            check_says(submit("1-3", "--restart", **another).stderr, "are locked in job")


def a_deleted_job_may_come_again(programs, folder):
    """Its frames are those of its own document; its history can be asked for by its ID."""
    with Farm(programs, folder / "farm") as farm:
        farm.start_worker()
        path = write_job(folder / "job.json", small_job(folder, "1-2"))
        ident = farm.submit(path)
        farm.wait_for(ident)
        before = programs.pixels(folder / FOLDER)
        farm.baton("job", "delete", ident)
        check_says(farm.baton("farm", "events", "--job", ident).stdout, "job deleted")
        farm.baton("farm", "events", "--job", "0123456789abcdef", expect=BAD_INPUT)
        farm.wait_for(farm.submit(path))
        check_equal(programs.pixels(folder / FOLDER), before, "pixels")


def a_key_of_later_frames(programs, folder):
    """A changed key leaves the frames before it as they are."""
    keys = [{"frame": frame, "position": [0.1 * frame, 1.2, 5], "lookAt": [0, 0.6, 0]} for frame in (1, 3, 6)]
    moving = {"motion": {"curve": "linear", "maxPx": 8}}
    render(programs, folder, small_job(folder, "1-6", camera={"keys": keys}, **moving))
    before = stamps(folder)
    keys[2]["position"][1] = 1.4
    job = small_job(folder, "1-6", camera={"keys": keys}, **moving)
    text = render(programs, folder, job, expect=BAD_INPUT)
    check_says(text, "$.camera.keys at frame 4", "frames before 4 are the same and stay")
    render(programs, folder, job, "--restart")
    check_equal(rewritten(before, folder), [f"frame.{n:04}.exr" for n in (4, 5, 6)], "frames written again")
    expected = witness(programs, folder / "whole", "1-6", camera={"keys": keys}, **moving)
    check_equal(programs.pixels(folder / FOLDER), expected, "pixels")


def an_open_job_is_extended(programs, folder):
    """On a farm: a job that runs makes way for a longer one of its picture, and its work is kept."""
    slow = {"method": "sequential", "numParticles": 16, "numCandidates": 512, "numDistributions": 48}
    changes = {**KINDS["motion"], "sampling": slow, "image": {"tileSize": 32}}
    expected = witness(programs, folder / "whole", "1-6", **changes)
    place = folder / "changed"
    with Farm(programs, folder / "farm", workers=1, threads=2) as farm:
        first = farm.submit(write_job(place / "job.json", small_job(place, "1-4", **changes)))
        wait_until(lambda: farm.show(first)["framesDone"] >= 1, "the first frame is written")
        longer = write_job(place / "longer.json", small_job(place, "1-6", **changes))
        answer = json.loads(farm.baton("job", "submit", longer, "--json").stdout)
        check_says(answer["plan"], "kept")
        farm.wait_for(answer["id"])
        check_equal((answer["id"], answer["version"], farm.show(first)["status"]), (first, 2, "done"), "the same job")
        check("0 jobs" in farm.baton("job", "list").stdout, "jobs that have ended are listed")
        listed = json.loads(farm.baton("job", "list", "--all", "--json").stdout)["jobs"]
        check_equal([job["id"] for job in listed], [first], "jobs with --all")

        # Another job, of other frames: not while this one is written, which nobody does now.
        farm.workers[0].terminate()
        farm.workers[0].wait()
        farm.baton("job", "pause", farm.submit(write_job(place / "longest.json", small_job(
            place, "1-8", **changes))))
        other = write_job(place / "other.json", small_job(place, "20-21", seed=9, name="other", **changes))
        check_says(farm.baton("job", "submit", other, expect=BAD_INPUT).stderr, "writes into", "wait for its end")
        check_says(farm.baton("job", "resume", "system test").stderr, " are kept",
            "going on from the states of frame ")
    check_equal({name: line for name, line in programs.pixels(place / FOLDER).items() if name < "frame.0007"},
                expected, "pixels")


if __name__ == "__main__":
    run_tests()

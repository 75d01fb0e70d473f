#!/usr/bin/env python3
"""Bad input of every kind: one clear error that names the place, the right exit code, and a farm that goes on."""

import shutil
import socket

from farm import BAD_INPUT, FAILED, IO, OK, Farm, check, check_equal, check_says, run_tests
from jobs import make_job, write_job


# What is said of a job with these changes: each fault is named, all in one go.
FAULTS = [
    ({"image": {"widht": 100}}, ["job.json", "$.image.widht", "width"]),
    ({"image": {"width": "wide"}}, ["$.image.width", "integer"]),
    ({"image": {"height": -96}}, ["$.image.height", "-96"]),
    ({"frames": "1-999999999", "image": {"width": 1e12}, "sampling": {"numParticles": 1000000}},
     ["$.image.width", "$.sampling.numParticles", "$.frames"]),
]


def wrong_keys_types_and_values(programs, folder):
    for changes, words in FAULTS:
        programs.refuses("check", write_job(folder / "job.json", make_job(folder, **changes)), says=words)


def fails(programs, *command, says, codes):
    """The command ends with one of the exit codes and says so on stderr."""
    done = programs.run("baton", *command, expect=None)
    check(done.returncode in codes, f"exit code {done.returncode}, expected {codes}\n{done.stderr}")
    check_says(done.stderr, says)


def text_that_is_no_json(programs, folder):
    folder.mkdir(parents=True)
    path = folder / "job.json"
    path.write_text('{"name": "cut off', encoding="utf-8")
    programs.refuses("check", path, says="job.json")


def a_missing_job(programs, folder):
    programs.refuses("render", folder / "nothing.json", says="nothing.json: no such file")


def a_missing_mesh(programs, folder):
    changes = {"scene": {**make_job(folder)["scene"], "meshes": {"sphere": str(folder / "gone.off")}}}
    path = write_job(folder / "job.json", make_job(folder, **changes))
    for command in [["check", path], ["render", path, "--work-dir", folder / "work"]]:
        fails(programs, *command, says="gone.off", codes=[BAD_INPUT, IO])


def maps_that_are_none(programs, folder):
    """An EXR that was cut in the middle, as a broken copy leaves it, and text."""
    programs.render_in(folder / "good", make_job(folder / "good", frames="1"))
    whole = (folder / "good/frames/frame.0001.exr").read_bytes()
    for name, content in {"cut.exr": whole[: len(whole) // 2], "text.exr": b"this is no picture\n" * 20}.items():
        (folder / name).write_bytes(content)
        job = make_job(folder, frames="1", environment={"keys": [{"frame": 1, "map": str(folder / name)}]})
        fails(programs, "render", write_job(folder / "job.json", job), "--work-dir", folder / "work", says=name,
              codes=[BAD_INPUT, IO, FAILED])


def a_damaged_state(programs, folder):
    """One changed byte anywhere is found by `baton state verify`."""
    programs.render_in(folder, make_job(folder, frames="1-2"))
    state = next(f for f in (folder / "work").rglob("*.blob") if f.read_bytes()[:4] == _state_magic(programs, folder))
    copy = folder / "copy.bst"
    shutil.copyfile(state, copy)
    programs.run("baton", "state", "verify", copy)
    whole = bytearray(state.read_bytes())
    for position in [0, 5, 20, len(whole) // 3, len(whole) // 2, len(whole) - 1]:
        damaged = bytearray(whole)
        damaged[position] ^= 1
        copy.write_bytes(damaged)
        programs.refuses("state", "verify", copy, says="copy.bst")
    copy.write_bytes(whole[: len(whole) // 2])
    programs.refuses("state", "verify", copy, says="copy.bst")


def _state_magic(programs, folder):
    """The first four bytes of a blob that `baton state verify` accepts."""
    for blob in sorted((folder / "work").rglob("*.blob")):
        if programs.run("baton", "state", "verify", blob, expect=None).returncode == OK:
            return blob.read_bytes()[:4]
    check(False, "no blob is a state")
    return b""


def a_live_coordinator_survives_any_message(programs, folder):
    """Messages of another version, cut, too long or of no meaning, and plain bytes: the next job is rendered."""
    with Farm(programs, folder / "farm", workers=None) as farm:
        farm.insecure = True
        farm.start_coordinator()
        worker = farm.start_worker()
        for kind in ["version", "garbage", "empty", "short", "many"]:
            answer = programs.run("send_raw", farm.endpoint, kind).stdout
            check(not answer.startswith("message"), f"{kind}: was taken for a message: {answer}")
            if kind == "version":
                check("version 127" in answer, f"the refusal does not name the version: {answer}")

        # Answers that nobody reads.
        programs.run("send_raw", farm.endpoint, "unread")
        check(farm.coordinator.alive(), f"the coordinator died\n{farm.coordinator.log()}")

        # Bytes that are not even ZeroMQ.
        host, port = farm.endpoint.removeprefix("tcp://").split(":")
        for raw in [b"GET / HTTP/1.1\r\n\r\n", bytes(range(256)) * 64, b""]:
            with socket.create_connection((host, int(port)), timeout=10) as connection:
                connection.sendall(raw)

        job = farm.submit(write_job(folder / "job.json", make_job(folder, frames="1-2")))
        farm.wait_for(job)
        check(worker.alive() and farm.coordinator.alive(), "a program died")
        check_equal(len(programs.pixels(folder / "frames")), 2, "frames")


def a_failing_job_leaves_the_farm_alone(programs, folder):
    """A mesh that disappears after submission fails its job with its name; the next job is rendered."""
    with Farm(programs, folder / "farm") as farm:
        bad_path = write_job(folder / "bad/job.json", make_job(folder / "bad", maxRetriesPerTask=0))
        bad = farm.submit(bad_path)
        (folder / "bad/sphere.off").unlink()
        worker = farm.start_worker()
        farm.baton("job", "wait", bad, expect=FAILED)
        check(any("sphere.off" in failure for failure in farm.show(bad)["failures"]), "the failure names no file")

        good = farm.submit(write_job(folder / "good/job.json", make_job(folder / "good", frames="1-2")))
        farm.wait_for(good)
        check(worker.alive(), "the worker died")


if __name__ == "__main__":
    run_tests()

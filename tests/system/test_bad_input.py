#!/usr/bin/env python3
"""Bad input of every kind: one clear error that names the place, the right exit code, and a farm that goes on."""

import shutil
import socket

from farm import BAD_INPUT, FAILED, IO, OK, Farm, check, check_equal, run_tests
from jobs import make_job, write_job


def check_error(done, exit_codes, *parts):
    """The program ended with one of the exit codes and said every part on stderr."""
    check(done.returncode in exit_codes, f"exit code {done.returncode}, expected {exit_codes}\n{done.stderr}")
    for part in parts:
        check(part in done.stderr, f"expected {part!r} in:\n{done.stderr}")


def check_job(programs, folder, exit_codes, *parts, **changes):
    """`baton check` of a job with the changes."""
    path = write_job(folder / "job.json", make_job(folder, **changes))
    check_error(programs.run("baton", "check", path, expect=None), exit_codes, *parts)


def a_misspelt_key(programs, folder):
    check_job(programs, folder, [BAD_INPUT], "job.json", "$.image.widht", "width", image={"widht": 100})


def a_wrong_type(programs, folder):
    check_job(programs, folder, [BAD_INPUT], "$.image.width", "integer", image={"width": "wide"})


def a_negative_resolution(programs, folder):
    check_job(programs, folder, [BAD_INPUT], "$.image.height", "-96", image={"height": -96})


def absurd_values(programs, folder):
    """Each fault is named, all in one go."""
    check_job(programs, folder, [BAD_INPUT], "$.image.width", "$.sampling.numParticles", "$.frames",
              frames="1-999999999", image={"width": 1e12}, sampling={"numParticles": 1000000})


def text_that_is_no_json(programs, folder):
    folder.mkdir(parents=True)
    path = folder / "job.json"
    path.write_text('{"name": "cut off', encoding="utf-8")
    check_error(programs.run("baton", "check", path, expect=None), [BAD_INPUT], "job.json")


def a_missing_job(programs, folder):
    done = programs.run("baton", "render", folder / "nothing.json", expect=None)
    check_error(done, [BAD_INPUT], "nothing.json: no such file")


def a_missing_mesh(programs, folder):
    changes = {"scene": {**make_job(folder)["scene"], "meshes": {"sphere": str(folder / "gone.off")}}}
    path = write_job(folder / "job.json", make_job(folder, **changes))
    for command in [["check"], ["render", "--work-dir", folder / "work"]]:
        done = programs.run("baton", command[0], path, *command[1:], expect=None)
        check_error(done, [BAD_INPUT, IO], "gone.off")


def render_with_map(programs, folder, map_path):
    """`baton render` of a job lit by the map."""
    keys = {"keys": [{"frame": 1, "map": str(map_path)}]}
    path = write_job(folder / "job.json", make_job(folder, frames="1", environment=keys))
    return programs.run("baton", "render", path, "--work-dir", folder / "work", expect=None)


def a_truncated_map(programs, folder):
    """An EXR that was cut in the middle, as a broken copy leaves it."""
    good = write_job(folder / "good/job.json", make_job(folder / "good", frames="1"))
    programs.render(good, folder / "good/work")
    whole = (folder / "good/frames/frame.0001.exr").read_bytes()
    (folder / "cut.exr").write_bytes(whole[: len(whole) // 2])
    check_error(render_with_map(programs, folder, folder / "cut.exr"), [BAD_INPUT, IO, FAILED], "cut.exr")


def text_named_exr(programs, folder):
    folder.mkdir(parents=True)
    (folder / "text.exr").write_text("this is no picture\n" * 20, encoding="ascii")
    check_error(render_with_map(programs, folder, folder / "text.exr"), [BAD_INPUT, IO, FAILED], "text.exr")


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
        check_error(programs.run("baton", "state", "verify", copy, expect=None), [BAD_INPUT], "copy.bst")
    copy.write_bytes(whole[: len(whole) // 2])
    check_error(programs.run("baton", "state", "verify", copy, expect=None), [BAD_INPUT], "copy.bst")


def _state_magic(programs, folder):
    """The first four bytes of a blob that `baton state verify` accepts."""
    for blob in sorted((folder / "work").rglob("*.blob")):
        if programs.run("baton", "state", "verify", blob, expect=None).returncode == OK:
            return blob.read_bytes()[:4]
    check(False, "no blob is a state")
    return b""


def a_live_coordinator_survives_any_message(programs, folder):
    """Messages of another version, cut, too long or of no meaning, and plain bytes: the next job is rendered."""
    with Farm(programs, folder / "farm") as farm:
        worker = farm.start_worker()
        for kind in ["version", "garbage", "empty", "short", "many"]:
            answer = programs.run("send_raw", farm.endpoint, kind).stdout
            check(not answer.startswith("message"), f"{kind}: was taken for a message: {answer}")
            if kind == "version":
                check("version 127" in answer, f"the refusal does not name the version: {answer}")

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
        check_error(farm.baton("job", "wait", bad, expect=None), [FAILED])
        check(any("sphere.off" in failure for failure in farm.show(bad)["failures"]), "the failure names no file")

        good = farm.submit(write_job(folder / "good/job.json", make_job(folder / "good", frames="1-2")))
        farm.wait_for(good)
        check(worker.alive(), "the worker died")


if __name__ == "__main__":
    run_tests()

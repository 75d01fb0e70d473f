#!/usr/bin/env python3
"""What a person sees who gets something wrong: one clear message, the right exit code, nothing on stdout."""

import json
import math
import os
import re
import shlex
import shutil
import signal
import subprocess
from array import array
from pathlib import Path

from assets import write_exr, write_hdr
from farm import BAD_INPUT, DEADLINE_S, IO, OK, UNAVAILABLE, USAGE, check, check_equal, check_says, run_tests, wait_until
from jobs import write_job

CUBE = Path(__file__).resolve().parents[2] / "jobs/examples/meshes/cube.obj"
CUBE_JOB = {
    "name": "cube",
    "image": {"width": 16, "height": 16, "tileSize": 8},
    "scene": {
        "materials": {"clay": {"type": "diffuse"}},
        "meshes": {"cube": "cube.obj"},
        "objects": [{"mesh": "cube", "material": "clay"}],
    },
    "environment": {"map": "sky.hdr"},
}


def names_steer_no_terminal(programs, folder):
    """What is printed of names, on either stream, is legible; what is written has the name that was meant."""
    folder.mkdir(parents=True)
    frame = folder / "\x1b[31mred\u202egpj.exr"
    write_exr(frame, 2, [array("f", [1] * 6)] * 2)
    for words, expect, stream in ((["view", frame], OK, "stdout"), (["view", str(frame) + ".none"], IO, "stderr")):
        told = getattr(programs.run("baton", *words, expect=expect), stream)
        check("\\x1b[31mred\\u202egpj" in told and "\x1b" not in told and "\u202e" not in told, repr(told))
    check(frame.with_suffix(".png").exists(), "the picture")
    for program, *words in (["baton"], ["baton", "config"], ["baton-coordinator", "--work-dir", folder],
                            ["baton-worker", "--coordinator", "tcp://127.0.0.1:1"]):
        told = programs.run(program, *words, "\x1b[31mred\u202egpj", expect=USAGE).stderr
        check("\\x1b[31mred\\u202egpj" in told and "\x1b" not in told, repr(told))


def grey_map(path, width, height):
    write_hdr(path, width, [bytes([128, 128, 128, 129]) * width] * height)


class Desk:
    """A folder with a cube and a map, where a person types."""

    def __init__(self, programs, folder):
        self.folder, self.program = folder, programs.bin.resolve() / "baton"
        folder.mkdir(parents=True)
        shutil.copy(CUBE, folder / "cube.obj")
        grey_map(folder / "sky.hdr", 4, 2)

    def baton(self, *arguments, **variables):
        own = {k: v for k, v in os.environ.items() if not k.startswith("BATON_")}
        environment = own | {"BATON_CONFIG_DIR": ""} | variables
        return subprocess.run([self.program, *map(str, arguments)], cwd=self.folder, env=environment, capture_output=True,
                              text=True, timeout=DEADLINE_S, check=False)

    def job(self, **changes):
        return write_job(self.folder / "job.json", {**CUBE_JOB, **changes})

    def expect(self, code, *arguments, says=()):
        """Runs `baton`; the exit code, what is on stderr, and where it is an error nothing on stdout."""
        done = self.baton(*arguments)
        check_equal(done.returncode, code, f"exit code of {arguments}, which says\n{done.stderr}")
        check_says(done.stderr, *([says] if isinstance(says, str) else says))
        check(code == OK or done.stdout == "", f"on stdout: {done.stdout}")
        return done


def a_good_job_passes(programs, folder):
    desk = Desk(programs, folder)
    done = desk.expect(OK, "check", desk.job())
    check_says(done.stdout, "12 triangles")
    check_equal(done.stderr, "", "stderr")
    summary = json.loads(desk.baton("check", "job.json", "--json", "--explain").stdout)
    check_equal(summary["tiles"], 4, "tiles")
    given = {s["path"]: s["given"] for s in summary["settings"]}
    check(given["$.image.width"] and not given["$.image.sites"], "what is given")


def wrong_command_lines(programs, folder):
    desk = Desk(programs, folder)
    for words, code, says in [
            ([], USAGE, "subcommand is required"),
            (["rendr", "job.json"], USAGE, 'baton rendr: no such command; did you mean "render"?'),
            (["job", "lst"], USAGE, 'job lst: no such command; did you mean "list"?'),
            (["rendr"], USAGE, ""),
            (["render", "job.json", "--frame", "3"], USAGE, 'render: no option --frame; did you mean "--frames"?'),
            (["render", "job.json", "--threads=2"], USAGE, 'no option --threads; did you mean "--threads-per-worker"?'),
            (["check", "--explian"], USAGE, 'check: no option --explian; did you mean "--explain"?'),
            (["--verison"], USAGE, 'baton: no option --verison; did you mean "--version"?'),
            (["farm", "slurm", "job.json", "--node", "2"], USAGE, 'slurm: no option --node; did you mean "--nodes"?'),
            (["check"], USAGE, "JOB is required"),
            (["job", "wait", "abc", "--timeout", "-1"], USAGE, "--timeout"),
            (["view", "a.exr", "--curve", "foo"], USAGE, "--curve: foo not in {none,filmic}"),
            (["key", "add", "keys", "anna", "--role", "boss"], USAGE, "--role: boss not in {worker,viewer,user,admin}"),
            (["job", "list", "--coordinator", "nonsense"], USAGE, "nonsense"),
            (["job", "list", "--coordinator", "tcp://127.0.0.1:1"], UNAVAILABLE,
             "tcp://127.0.0.1:1: no coordinator listens there"),
            (["check", "missing.json"], BAD_INPUT, "missing.json: no such file")]:
        desk.expect(code, *words, says=says)


def command_help(desk, command=()):
    """Every command with its --help, by walking the table."""
    text = desk.baton(*command, "--help").stdout
    names = re.findall(r"^  ([a-z]+)  ", text.partition("Subcommands:")[2].partition("\n\n")[0], re.MULTILINE)
    yield command, text
    for name in names:
        yield from command_help(desk, (*command, name))


def what_is_typed_beats_the_environment(programs, folder):
    """Siblings must not hand each other what the environment says: a key of the environment acted in place of the one that was typed."""
    desk, seen = Desk(programs, folder), 0
    job = str(desk.job())
    for command, text in command_help(desk):
        usage = re.search(r"^Usage: .*$", text, re.MULTILINE)[0]
        if "--key" not in text or "--coordinator" not in text or command == ("farm", "slurm"):  # which asks Slurm first
            continue
        seen += 1
        words = [*command, *([job] if " JOB" in usage else ["name"] if re.search(r" (ID|NAME)\b", usage) else [])]
        if " SETTING" in usage:
            words += ["priority=1"]
        if re.search(r"--frames .*REQUIRED", text):
            words += ["--frames", "1"]
        typed = desk.baton(*words, "--key", "typed.key", BATON_KEY="environment.key")
        check_says(typed.stderr, "typed.key")
        check("environment.key" not in typed.stderr, f"{command} reads the key of the environment: {typed.stderr}")
        alone = desk.baton(*words, BATON_KEY="environment.key")
        check_says(alone.stderr, "environment.key")
        typed = desk.baton(*words, "--coordinator", "typed://here", BATON_COORDINATOR="environment://here")
        check_says(typed.stderr, "typed://here")
        alone = desk.baton(*words, BATON_COORDINATOR="environment://here")
        check_says(alone.stderr, "environment://here")
    check(seen >= 13, f"only {seen} commands ask a coordinator")


def a_sequence_of_maps_is_one_line(programs, folder):
    desk = Desk(programs, folder)
    for frame in range(1, 8):
        grey_map(folder / f"night.{frame:04}.hdr", 4, 2 if frame < 6 else 4)
    grey_map(folder / "dusk.hdr", 4, 2)
    desk.job(frames="1-7", environment={"frames": "night.####.hdr"})
    said = desk.expect(OK, "check", "job.json").stdout
    maps = [line.split(" ", 1)[1].replace(f"{folder}/", "").strip() for line in said.splitlines() if line.startswith("map ")]
    check_equal(maps, ["night.0001.hdr to night.0005.hdr, 5 maps (4x2)", "night.0006.hdr to night.0007.hdr, 2 maps (4x4)"], "maps")
    desk.job(frames="1-7", environment={"keys": [{"frame": 1, "map": "night.0001.hdr"}, {"frame": 7, "map": "dusk.hdr"}]})
    check_equal(desk.expect(OK, "check", "job.json").stdout.count("\nmap "), 2, "maps of two names")


def what_keys_say_otherwise_is_told(programs, folder):
    desk = Desk(programs, folder)
    keys = [{"frame": f, "position": [f, 1, 4], "lookAt": [0, 0, 0]} for f in (1, 2)]
    for camera, idle in [({"position": [9, 9, 9]}, ["position"]), ({"lookAt": [1, 1, 1]}, ["lookAt"]), ({"up": [1, 1, 0]}, []),
                         ({"position": [1, 1, 4]}, []), ({}, [])]:
        desk.job(frames="1-2", camera={**camera, "keys": keys})
        said = desk.expect(OK, "check", "job.json").stdout
        found = [line for line in said.splitlines() if "no effect, as every key of camera.keys has its own" in line]
        check_equal(found, [f"warning    camera.{key}: no effect, as every key of camera.keys has its own" for key in idle], str(camera))


def job_faults_come_all_at_once(programs, folder):
    desk = Desk(programs, folder)
    path = desk.job(image={"widht": 3}, priority="high", frames="4-1")
    desk.expect(BAD_INPUT, "check", path,
                says=[f'{path}: $.priority: expected an integer in [0, 100], got "high"',
                      f'{path}: $.image.widht: unknown key; did you mean "width"?',
                      f"{path}: $.frames: expected a last frame not before the first"])
    path.write_text('{\n  "name": "x",\n}')
    desk.expect(BAD_INPUT, "check", path, says=f"{path}: line 3, column 1: syntax error")


def missing_and_broken_assets_are_all_named(programs, folder):
    desk = Desk(programs, folder)
    (folder / "cube.obj").write_text("no mesh at all\n")
    (folder / "sky.hdr").write_bytes(b"no picture")
    desk.expect(BAD_INPUT, "check", desk.job(), says=["cube.obj", "sky.hdr"])
    # Motion is settled from the meshes; that they are missing hides nothing.
    keys = [{"frame": f, "position": [f, 1, 4], "lookAt": [0, 0, 0]} for f in (1, 2)]
    desk.job(camera={"keys": keys}, environment={"map": "gone.exr"})
    (folder / "cube.obj").unlink()
    desk.expect(BAD_INPUT, "check", "job.json", says=["cube.obj", "gone.exr: no such file"])


def check_and_render_warn_alike(programs, folder):
    desk = Desk(programs, folder)
    grey_map(folder / "sky.hdr", 6, 2)
    objects = [{"mesh": "cube", "material": "clay", "translate": [0, 0, z]} for z in (0, 50)]
    objects += [{"mesh": "cube", "material": "clay", "translate": [99, 0, 0]},
                {"mesh": "cube", "material": "clay", "scale": 1e-4}]
    job = desk.job(scene={**CUBE_JOB["scene"], "objects": objects}, output={"aovs": ["acceptance", "variance"]},
                   sampling={"method": "pool"})
    warnings = ["sky.hdr: no texel is brighter than 1 (1)",
                "sky.hdr: 6x2 texels, a lat-long map is twice as wide as high",
                "object 1 (cube) is behind the camera in every frame",
                "object 2 (cube) is outside of the picture in every frame",
                "object 3 (cube) is smaller than a pixel in every frame",
                "output.aovs: acceptance says nothing here: only `sequential` fills it",
                "output.aovs: variance of a single round draws each pixel twice; with quality.rounds 2 the same time "
                "halves the variance"]
    checked, rendered = desk.expect(OK, "check", job), desk.expect(OK, "render", job)
    for warning in warnings:
        check_equal((checked.stdout.count(warning), rendered.stderr.count(warning)), (1, 1), warning)
    check_equal(checked.stdout.count("warning "), len(warnings), checked.stdout)
    told = json.loads(desk.baton("check", job, "--json").stdout)["warnings"]
    check_equal(len(told), len(warnings), f"{told}")

    # Where frames cannot go.
    check_says(desk.baton("check", desk.job(output={"directory": "sky.hdr/frames"})).stdout, "sky.hdr cannot be written")
    many = desk.job(image={"width": 8192, "height": 8192, "tileSize": 512}, frames="1-3000", output={"pixelType": "float"})
    check_says(desk.baton("check", many).stdout, " are free, and frames may take ")


def a_film_of_odd_maps_does_not_flood_the_terminal(programs, folder):
    desk = Desk(programs, folder)
    for frame in range(1, 31):
        grey_map(folder / f"film.{frame:04}.hdr", 4, 2)
    job = desk.job(environment={"frames": "film.####.hdr"}, frames="1-30", sampling={"method": "pool"})
    odd, more = "no texel is brighter than 1", "there is more: `baton check` tells all"
    told = desk.baton("render", job).stderr
    check_equal((told.count(odd), told.count(more)), (20, 1), told)
    check_equal(desk.baton("check", job).stdout.count(odd), 30, "warnings of check")


def texels_that_are_no_light_are_counted(programs, folder):
    desk = Desk(programs, folder)
    rows = [array("f", [2.0] * 9 + [math.nan, -1.0, math.inf]), array("f", [2.0] * 12)]
    write_exr(folder / "sky.exr", 4, rows)
    job = desk.job(environment={"map": "sky.exr"}, sampling={"method": "pool"})
    warning = "sky.exr: 1 texels are negative, NaN or infinite and count as 0"
    check_says(desk.baton("check", job).stdout, warning)
    check_says(desk.baton("render", job).stderr, warning)


def what_auto_will_look_at_is_told(programs, folder):
    desk = Desk(programs, folder)
    job = desk.job(sampling={"method": "auto"}, frames="1-48")
    told = desk.expect(OK, "check", job).stdout
    check(re.search(r"pilot +before the first frame: \d+ candidates at both ends of the job, "
                    r"some \d+ frames of \d+ pixels, about [\dms]+ of CPU time", told), told)
    check(json.loads(desk.baton("check", job, "--json").stdout)["pilot"]["cpuSeconds"] > 0, "it costs something")
    check("pilot" not in desk.baton("check", desk.job(sampling={"method": "pool"})).stdout, "of a job without one")


def maps_that_are_none_or_of_two_sizes(programs, folder):
    desk = Desk(programs, folder)
    grey_map(folder / "small.hdr", 2, 1)
    keys = [{"frame": 1, "map": "sky.hdr"}, {"frame": 2, "map": "small.hdr"}]
    desk.expect(BAD_INPUT, "check", desk.job(environment={"keys": keys}), says="small.hdr: expected 4x2 texels")
    (folder / "sky.hdr").write_bytes(b"no picture")
    done = desk.baton("render", desk.job())
    check_equal(done.returncode, BAD_INPUT, "exit code")
    check_says(done.stderr, "sky.hdr: neither an EXR nor a Radiance HDR picture")


def files_that_are_no_states(programs, folder):
    desk = Desk(programs, folder)
    (folder / "empty.bst").write_bytes(b"")
    (folder / "text.bst").write_text("this is no sample state")
    desk.expect(BAD_INPUT, "state", "show", "text.bst", says="text.bst")
    desk.expect(BAD_INPUT, "state", "verify", "empty.bst", "text.bst", says=["empty.bst", "text.bst"])


def replace_programs(desk, coordinator, worker="sleep 60"):
    """baton gets, beside it, scripts in place of the other programs; coordinator: None: the true one."""
    if coordinator is None:
        coordinator = f'exec {shlex.quote(str(Path(desk.program).parent / "baton-coordinator"))} "$@"'
    (desk.folder / "bin").mkdir()
    shutil.copy(desk.program, desk.folder / "bin/baton")
    desk.program = desk.folder / "bin/baton"
    for name, text in {"baton-coordinator": coordinator, "baton-worker": worker}.items():
        (desk.folder / "bin" / name).write_text("#!/bin/sh\n" + text + "\n")
        (desk.folder / "bin" / name).chmod(0o755)


def render_names_the_log_of_a_coordinator_that_fails(programs, folder):
    desk = Desk(programs, folder)
    replace_programs(desk, "echo the disk is on fire; exit 3")
    log = folder / "cube-frames/.baton/coordinator.log"
    desk.expect(IO, "render", desk.job(), says=["the coordinator did not start (exit code 3)", str(log)])
    check_says(log.read_text(), "the disk is on fire")


def render_does_not_repeat_what_a_worker_cannot_be_told(programs, folder):
    """Such as an instruction set that this machine does not have."""
    desk = Desk(programs, folder)
    replace_programs(desk, None, "echo 2026-11-30T12:00:00 baton-worker error: --isa: none; exit 64")
    desk.expect(USAGE, "render", desk.job(), says="worker-1 ended (exit code 64): error: --isa: none")


def children_die_with_a_killed_parent(programs, folder):
    desk, pid_file = Desk(programs, folder), folder / "pid"
    replace_programs(desk, f"echo $$ > {pid_file}.new; mv {pid_file}.new {pid_file}; exec sleep 60")
    render = subprocess.Popen([desk.program, "render", desk.job()], cwd=folder)
    wait_until(pid_file.exists, "a child runs")
    child = int(pid_file.read_text())
    render.send_signal(signal.SIGKILL)
    render.wait(timeout=DEADLINE_S)
    wait_until(lambda: not is_running(child), "the child ends")


def is_running(pid):
    """A zombie that nobody has waited for yet has ended."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except (FileNotFoundError, ProcessLookupError):
        return False


if __name__ == "__main__":
    run_tests()

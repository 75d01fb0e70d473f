"""What a person sees who gets something wrong: one clear message, the right exit code, nothing on stdout."""

import argparse
import json
import math
import os
import pathlib
import shutil
import signal
import subprocess
import tempfile
import time
import unittest
from array import array

from assets import write_exr

PATIENCE = int(os.environ.get("BATON_PATIENCE", "1"))
OK, USAGE, BAD_INPUT, UNAVAILABLE, IO = 0, 64, 65, 69, 74
BIN = SOURCE = None

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


def radiance_hdr(width, height):
    """A grey lat-long map, Radiance HDR without run lengths."""
    header = f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n"
    return header.encode() + bytes([128, 128, 128, 129]) * (width * height)


class CliErrors(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="baton-cli-"))
        self.addCleanup(shutil.rmtree, self.folder)
        shutil.copy(SOURCE / "jobs/examples/meshes/cube.obj", self.folder / "cube.obj")
        (self.folder / "sky.hdr").write_bytes(radiance_hdr(4, 2))

    def baton(self, *arguments, program=None):
        environment = {k: v for k, v in os.environ.items() if not k.startswith("BATON_")}
        return subprocess.run(
            [program or BIN / "baton", *map(str, arguments)],
            cwd=self.folder, env=environment, capture_output=True, text=True, timeout=120 * PATIENCE)

    def job(self, **changes):
        path = self.folder / "job.json"
        path.write_text(json.dumps({**CUBE_JOB, **changes}))
        return path

    def expect(self, result, code, *texts):
        self.assertEqual(result.returncode, code, result.stderr)
        for text in texts:
            self.assertIn(text, result.stderr)
        if code != OK:
            self.assertEqual(result.stdout, "")

    def test_a_good_job_passes(self):
        self.job()
        result = self.baton("check", "job.json")
        self.expect(result, OK)
        self.assertIn("12 triangles", result.stdout)
        self.assertEqual(result.stderr, "")
        summary = json.loads(self.baton("check", self.job(), "--json", "--explain").stdout)
        self.assertEqual(summary["tiles"], 4)
        given = {s["path"]: s["given"] for s in summary["settings"]}
        self.assertTrue(given["$.image.width"])
        self.assertFalse(given["$.image.sites"])

    def test_wrong_command_lines(self):
        self.expect(self.baton(), USAGE, "subcommand is required")
        self.expect(self.baton("rendr", "job.json"), USAGE, "baton rendr: no such command; did you mean \"render\"?")
        self.expect(self.baton("job", "lst"), USAGE, "job lst: no such command; did you mean \"list\"?")
        self.expect(self.baton("rendr"), USAGE)
        self.expect(self.baton("check"), USAGE, "JOB is required")
        self.expect(self.baton("job", "wait", "abc", "--timeout", "-1"), USAGE, "--timeout")
        self.expect(self.baton("job", "list", "--coordinator", "nonsense"), USAGE, "nonsense")

    def test_job_faults_come_all_at_once(self):
        path = self.job(image={"widht": 3}, priority="high", frames="4-1")
        self.expect(self.baton("check", path), BAD_INPUT,
                    f'{path}: $.priority: expected an integer in [0, 100], got "high"',
                    f'{path}: $.image.widht: unknown key; did you mean "width"?',
                    f"{path}: $.frames: expected a last frame not before the first")

    def test_broken_json_names_line_and_column(self):
        path = self.folder / "job.json"
        path.write_text('{\n  "name": "x",\n}')
        self.expect(self.baton("check", path), BAD_INPUT, f"{path}: line 3, column 1: syntax error")

    def test_missing_and_broken_assets_are_all_named(self):
        (self.folder / "cube.obj").write_text("no mesh at all\n")
        (self.folder / "sky.hdr").write_bytes(b"no picture")
        self.expect(self.baton("check", self.job()), BAD_INPUT, "cube.obj", "sky.hdr")
        self.expect(self.baton("check", "missing.json"), BAD_INPUT, "missing.json: no such file")
        # Motion is settled from the meshes; that they are missing hides nothing.
        keys = [{"frame": f, "position": [f, 1, 4], "lookAt": [0, 0, 0]} for f in (1, 2)]
        self.job(camera={"keys": keys}, environment={"map": "gone.exr"})
        (self.folder / "cube.obj").unlink()
        self.expect(self.baton("check", "job.json"), BAD_INPUT, "cube.obj", "gone.exr: no such file")

    def test_check_and_render_warn_alike(self):
        (self.folder / "sky.hdr").write_bytes(radiance_hdr(6, 2))
        objects = [{"mesh": "cube", "material": "clay", "translate": [0, 0, z]} for z in (0, 50)]
        objects += [{"mesh": "cube", "material": "clay", "translate": [99, 0, 0]},
                    {"mesh": "cube", "material": "clay", "scale": 1e-4}]
        job = self.job(scene={**CUBE_JOB["scene"], "objects": objects}, output={"aovs": ["acceptance", "variance"]},
                       sampling={"method": "pool"})
        warnings = ["sky.hdr: no texel is brighter than 1 (1)",
                    "sky.hdr: 6x2 texels, a lat-long map is twice as wide as high",
                    "object 1 (cube) is behind the camera in every frame",
                    "object 2 (cube) is outside of the picture in every frame",
                    "object 3 (cube) is smaller than a pixel in every frame",
                    "output.aovs: acceptance says nothing here: only `sequential` fills it",
                    "output.aovs: variance of a single round draws each pixel twice; with quality.rounds 2 the same time "
                    "halves the variance"]
        check, render = self.baton("check", job), self.baton("render", job)
        self.expect(check, OK)
        self.expect(render, OK)
        for warning in warnings:
            self.assertEqual(check.stdout.count(warning), 1, check.stdout)
            self.assertEqual(render.stderr.count(warning), 1, render.stderr)
        self.assertEqual(check.stdout.count("warning "), len(warnings), check.stdout)
        told = json.loads(self.baton("check", job, "--json").stdout)["warnings"]
        self.assertEqual(len(told), len(warnings), told)

        # Where frames cannot go.
        result = self.baton("check", self.job(output={"directory": "sky.hdr/frames"}))
        self.assertIn("sky.hdr cannot be written", result.stdout)
        result = self.baton("check", self.job(
            image={"width": 8192, "height": 8192, "tileSize": 512}, frames="1-3000", output={"pixelType": "float"}))
        self.assertIn(" are free, and frames may take ", result.stdout)

    def test_a_film_of_odd_maps_does_not_flood_the_terminal(self):
        for frame in range(1, 31):
            (self.folder / f"film.{frame:04}.hdr").write_bytes(radiance_hdr(4, 2))
        job = self.job(environment={"frames": "film.####.hdr"}, frames="1-30", sampling={"method": "pool"})
        odd, more = "no texel is brighter than 1", "there is more: `baton check` tells all"
        told = self.baton("render", job).stderr
        self.assertEqual((told.count(odd), told.count(more)), (20, 1), told)
        self.assertEqual(self.baton("check", job).stdout.count(odd), 30)

    def test_texels_that_are_no_light_are_counted(self):
        rows = [array("f", [2.0] * 9 + [math.nan, -1.0, math.inf]), array("f", [2.0] * 12)]
        write_exr(self.folder / "sky.exr", 4, rows)
        job = self.job(environment={"map": "sky.exr"}, sampling={"method": "pool"})
        warning = "sky.exr: 1 texels are negative, NaN or infinite and count as 0"
        self.assertIn(warning, self.baton("check", job).stdout)
        self.assertIn(warning, self.baton("render", job).stderr)

    def test_check_tells_of_the_pilot(self):
        job = self.job(sampling={"method": "auto"}, frames="1-48")
        told = self.baton("check", job)
        self.expect(told, OK)
        self.assertRegex(told.stdout, r"pilot +before the first frame: \d+ candidates at both ends of the job, "
                                      r"some \d+ frames of \d+ pixels, about [\dms]+ of CPU time")
        pilot = json.loads(self.baton("check", job, "--json").stdout)["pilot"]
        self.assertGreater(pilot["cpuSeconds"], 0)
        self.assertNotIn("pilot", self.baton("check", self.job(sampling={"method": "pool"})).stdout)

    def test_rendering_a_file_that_is_no_picture(self):
        (self.folder / "sky.hdr").write_bytes(b"no picture")
        result = self.baton("render", self.job())
        self.assertEqual(result.returncode, BAD_INPUT, result.stderr)
        self.assertIn("sky.hdr: neither an EXR nor a Radiance HDR picture", result.stderr)

    def test_maps_that_cannot_be_mixed(self):
        (self.folder / "small.hdr").write_bytes(radiance_hdr(2, 1))
        keys = [{"frame": 1, "map": "sky.hdr"}, {"frame": 2, "map": "small.hdr"}]
        self.expect(self.baton("check", self.job(environment={"keys": keys})), BAD_INPUT,
                    "small.hdr: expected 4x2 texels")

    def test_no_coordinator(self):
        result = self.baton("job", "list", "--coordinator", "tcp://127.0.0.1:1")
        self.expect(result, UNAVAILABLE, "tcp://127.0.0.1:1: no coordinator listens there")

    def test_files_that_are_no_states(self):
        (self.folder / "empty.bst").write_bytes(b"")
        (self.folder / "text.bst").write_text("this is no sample state")
        self.expect(self.baton("state", "show", "text.bst"), BAD_INPUT, "text.bst")
        self.expect(self.baton("state", "verify", "empty.bst", "text.bst"), BAD_INPUT, "empty.bst", "text.bst")

    def fake_programs(self, coordinator):
        """A folder with baton and, beside it, scripts in place of the other programs."""
        folder = self.folder / "bin"
        folder.mkdir()
        shutil.copy(BIN / "baton", folder / "baton")
        for name, text in {"baton-coordinator": coordinator, "baton-worker": "sleep 60"}.items():
            (folder / name).write_text("#!/bin/sh\n" + text + "\n")
            (folder / name).chmod(0o755)
        return folder / "baton"

    def test_render_names_the_log_of_a_coordinator_that_fails(self):
        program = self.fake_programs("echo the disk is on fire; exit 3")
        result = self.baton("render", self.job(), program=program)
        log = self.folder / "cube-frames/.baton/coordinator.log"
        self.expect(result, IO, "the coordinator did not start (exit code 3)", str(log))
        self.assertIn("the disk is on fire", log.read_text())

    def test_children_die_with_a_killed_parent(self):
        pid_file = self.folder / "pid"
        program = self.fake_programs(f"echo $$ > {pid_file}.new; mv {pid_file}.new {pid_file}; exec sleep 60")
        render = subprocess.Popen([program, "render", self.job()], cwd=self.folder)
        self.wait_until(pid_file.exists)
        child = int(pid_file.read_text())
        render.send_signal(signal.SIGKILL)
        render.wait(timeout=30 * PATIENCE)
        self.wait_until(lambda: not is_running(child))

    def wait_until(self, condition):
        deadline = time.monotonic() + 30 * PATIENCE
        while not condition():
            self.assertLess(time.monotonic(), deadline, "waited in vain")
            time.sleep(0.02)


def is_running(pid):
    """A zombie that nobody has waited for yet has ended."""
    try:
        return pathlib.Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except (FileNotFoundError, ProcessLookupError):
        return False


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--bin", type=pathlib.Path, required=True)
    parser.add_argument("--source", type=pathlib.Path, required=True)
    known, rest = parser.parse_known_args()
    BIN, SOURCE = known.bin.resolve(), known.source.resolve()
    unittest.main(argv=[__file__, *rest])

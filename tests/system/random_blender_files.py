"""Run by Blender: draws small files, renders each with Cycles and exports it, all in one process.

blender -b --factory-startup -P random_blender_files.py -- SOURCE OUT SEED NUMBER...

SOURCE: root of the project. OUT gets a folder a number: file.blend, cycles.SEED.FRAME.exr of two seeds, job/ and told.json: the
traits that were drawn and the report. Direct light only. A number below 0 is the trait of that place from the end, alone."""

import argparse
import json
import shutil
import sys
import traceback
from pathlib import Path

import bpy

sys.dont_write_bytecode = True
SOURCE, OUT = (Path(text) for text in sys.argv[sys.argv.index("--") + 1:][:2])
sys.path[:0] = [str(SOURCE / "jobs/exporters/blender"), str(SOURCE / "jobs/lab/peers"), str(Path(__file__).resolve().parent)]
import cycles_settings  # noqa: E402
from baton_exporter import job  # noqa: E402
from blender_stage import LitStage  # noqa: E402
from blender_traits import draw_traits  # noqa: E402

SEEDS = (1, 2)
SPP = 24


def render(scene, folder):
    """Each frame with each seed."""
    for seed in SEEDS:
        cycles_settings.set_light(scene, argparse.Namespace(spp=SPP, seed=seed, threads=2))
        scene.cycles.use_animated_seed = True
        for frame in range(scene.frame_start, scene.frame_end + 1):
            scene.frame_set(frame)
            scene.render.filepath = str(folder / f"cycles.{seed}.{frame:04}.exr")
            bpy.ops.render.render(write_still=True)


def make(seed, number, folder):
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    stage = LitStage(folder)
    told = {"traits": [], "report": []}
    for name, build, draw in draw_traits(seed, number):
        build(stage, draw)
        told["traits"].append(name)
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "file.blend"), copy=True)
    render(stage.scene, folder)
    shown = stage.scene.render
    told["transparent"], told["cropped"] = shown.film_transparent, shown.use_border and shown.use_crop_to_border
    try:
        told["report"] = [": ".join(entry) for entry in job.export(folder / "job").entries]
    except job.CannotExport as fault:
        told["report"] = [str(fault)]
    except Exception:
        told["fault"] = traceback.format_exc()
    (folder / "told.json").write_text(json.dumps(told, indent=1), encoding="utf-8")


def main():
    seed, *numbers = sys.argv[sys.argv.index("--") + 3:]
    for number in map(int, numbers):
        make(seed, number, OUT / str(number))


main()

"""Renders a Blender file with Cycles as Baton renders its job: direct light, no denoiser, linear EXR of 32 bits.

blender -b shot.blend -P cycles_file.py -- OUT --frames 1,12,24 [--spp 64] [--seed 1] [--threads 2]

OUT gets cycles.####.exr.
"""

import argparse
import sys
from pathlib import Path

import bpy

sys.dont_write_bytecode = True
HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parents[1] / "exporters/blender")]
import cycles_settings  # noqa: E402
from baton_exporter import keys  # noqa: E402


def main():
    parser = argparse.ArgumentParser(prog="cycles_file.py")
    parser.add_argument("out", type=Path)
    parser.add_argument("--frames", required=True)
    parser.add_argument("--spp", type=int, default=64)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--threads", type=int, default=2)
    options = parser.parse_args(sys.argv[sys.argv.index("--") + 1:])
    scene = bpy.context.scene
    cycles_settings.set_light(scene, options)
    scene.cycles.use_animated_seed = True
    for frame in keys.parse_frames(options.frames):
        scene.frame_set(frame)
        scene.render.filepath = str(options.out.resolve() / f"cycles.{frame:04}.exr")
        bpy.ops.render.render(write_still=True)


if __name__ == "__main__":
    main()

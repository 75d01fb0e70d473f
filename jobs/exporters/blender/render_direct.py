"""Renders a Blender file with Cycles as Baton renders its job: direct light, no denoiser, linear EXR of 32 bits.

blender -b shot.blend -P render_direct.py -- OUT --frames 1,12,24 [--spp 64] [--seed 1] [--threads 2]

OUT gets cycles.####.exr.
"""

import argparse
import sys
from pathlib import Path

import bpy

sys.dont_write_bytecode = True
sys.path.insert(0, str(Path(__file__).resolve().parent))
from baton_exporter import keys  # noqa: E402


def set_direct_light(scene, options):
    cycles, render = scene.cycles, scene.render
    render.engine, cycles.device = "CYCLES", "CPU"
    render.threads_mode, render.threads = "FIXED", options.threads
    cycles.samples, cycles.seed = options.spp, options.seed
    cycles.use_animated_seed = True
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.time_limit = 0
    # Rays that leave the first surface count where they reach the map.
    for name in ("max", "diffuse", "glossy", "transmission", "volume"):
        setattr(cycles, f"{name}_bounces", 0)
    cycles.transparent_max_bounces = 64
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0
    cycles.blur_glossy = cycles.light_sampling_threshold = 0
    cycles.use_fast_gi = False
    render.use_compositing = render.use_sequencer = False
    render.dither_intensity = 0
    image = render.image_settings
    image.file_format, image.color_mode, image.color_depth, image.exr_codec = "OPEN_EXR", "RGBA", "32", "ZIP"


def main():
    parser = argparse.ArgumentParser(prog="render_direct.py")
    parser.add_argument("out", type=Path)
    parser.add_argument("--frames", required=True)
    parser.add_argument("--spp", type=int, default=64)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--threads", type=int, default=2)
    options = parser.parse_args(sys.argv[sys.argv.index("--") + 1:])
    scene = bpy.context.scene
    set_direct_light(scene, options)
    for frame in keys.parse_frames(options.frames):
        scene.frame_set(frame)
        scene.render.filepath = str(options.out.resolve() / f"cycles.{frame:04}.exr")
        bpy.ops.render.render(write_still=True)


if __name__ == "__main__":
    main()

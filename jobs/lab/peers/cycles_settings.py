"""Settings of Cycles for what Baton renders; runs inside Blender 3.4."""


def set_light(scene, options, bounces=0):
    """Cycles as its defaults are, but for what would not be light by so many surfaces beside the one that is seen, or fixed
    samples, with float frames. options: spp, seed, threads."""
    cycles, render = scene.cycles, scene.render
    render.engine, cycles.device = "CYCLES", "CPU"
    render.threads_mode, render.threads = "FIXED", options.threads
    cycles.samples, cycles.seed = options.spp, options.seed
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.time_limit = 0

    # With 0, rays that leave the first surface count where they reach the map.
    for name in ("max", "diffuse", "glossy", "transmission", "volume"):
        setattr(cycles, f"{name}_bounces", bounces)
    # Holes are gone through.
    cycles.transparent_max_bounces = 64
    # Nothing that trades energy for less noise.
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0
    cycles.blur_glossy = cycles.light_sampling_threshold = 0
    cycles.use_fast_gi = False

    render.use_compositing = render.use_sequencer = False
    render.dither_intensity = 0
    image = render.image_settings
    image.file_format, image.color_depth, image.exr_codec = "OPEN_EXR", "32", "NONE"
    image.color_mode = "RGBA" if render.film_transparent else "RGB"

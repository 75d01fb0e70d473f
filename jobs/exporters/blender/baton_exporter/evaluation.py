"""Evaluates a scene as renders do, frame by frame; runs inside Blender.

What the viewport shows may differ: levels and visibility of modifiers, numbers of particles, resolutions of curves, nodes such
as Is Viewport. Blender hands what renders show to render engines alone, so one that renders nothing takes it."""

import bpy


def take_frames(scene, view_layer, numbers, take):
    """Calls take(depsgraph) in each frame. Changes how the scene is rendered."""
    prepare(scene, view_layer)
    faults = []

    class Engine(bpy.types.RenderEngine):
        bl_idname, bl_label = "BATON_EXPORT", "Baton exporter"

        def render(self, depsgraph):
            try:
                take(depsgraph)
            except Exception as fault:  # Blender would print it and go on
                faults.append(fault)

    bpy.utils.register_class(Engine)
    scene.render.engine = Engine.bl_idname
    for number in numbers:
        scene.frame_set(number)
        bpy.ops.render.render()
        if faults:
            raise faults[0]
    bpy.utils.unregister_class(Engine)


def prepare(scene, view_layer):
    """Leaves one evaluation a frame, and nothing that follows it."""
    for layer in scene.view_layers:
        layer.use = layer == view_layer
    for name in ("compositing", "sequencer", "freestyle", "multiview", "motion_blur"):
        setattr(scene.render, f"use_{name}", False)

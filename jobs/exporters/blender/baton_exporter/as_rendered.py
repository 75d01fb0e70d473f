"""Makes the scene that Blender evaluates, its viewport's, what renders show; runs inside Blender."""

import bpy

VIEWPORT_OF = {"hide_render": "hide_viewport", "show_render": "show_viewport",
               "show_instancer_for_render": "show_instancer_for_viewport"}


def as_rendered(scene, view_layer):
    scene.render.use_simplify, simplify = False, scene.render.use_simplify
    key_as_rendered()
    for item in bpy.data.objects:
        item.hide_viewport = item.hide_render
        if item.name in view_layer.objects:
            item.hide_set(False, view_layer=view_layer)
        item.show_instancer_for_viewport = item.show_instancer_for_render
        for modifier in item.modifiers:
            modifier.show_viewport = modifier.show_render
            show_as_rendered(modifier)
            if simplify and modifier.type == "SUBSURF":
                modifier.levels = min(modifier.levels, scene.render.simplify_subdivision_render)
        for system in item.particle_systems:
            system.settings.display_percentage = 100
    for collection in (scene.collection, *bpy.data.collections):
        collection.hide_viewport = collection.hide_render
    for layer in layer_collections(view_layer.layer_collection):
        layer.hide_viewport = False
    for curve in bpy.data.curves:
        curve.resolution_u = curve.render_resolution_u or curve.resolution_u
        curve.resolution_v = curve.render_resolution_v or curve.resolution_v
    for ball in bpy.data.metaballs:
        ball.resolution = ball.render_resolution


def key_as_rendered():
    """Keys and drivers of what renders show, in place of those of what the viewport shows."""
    animated = [item.animation_data for item in bpy.data.objects if item.animation_data]
    for curves in [action.fcurves for action in bpy.data.actions] + [data.drivers for data in animated]:
        for curve in [curve for curve in curves if name_of(curve) in VIEWPORT_OF.values()]:
            curves.remove(curve)
        for curve in curves:
            name = name_of(curve)
            if name in VIEWPORT_OF:
                curve.data_path = curve.data_path[:-len(name)] + VIEWPORT_OF[name]


def name_of(curve):
    """Of the property: `show_render` of `modifiers["bend"].show_render`."""
    return curve.data_path.rpartition(".")[2]


def show_as_rendered(modifier):
    for viewport, render in (("levels", "render_levels"), ("viewport_resolution", "resolution")):
        if modifier.type in ("SUBSURF", "MULTIRES", "OCEAN") and hasattr(modifier, render):
            setattr(modifier, viewport, getattr(modifier, render))


def layer_collections(layer):
    yield layer
    for child in layer.children:
        yield from layer_collections(child)

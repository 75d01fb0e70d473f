"""Renders a glTF file that Blender's own importer reads, with its camera, under a map, as Baton does: direct light; runs
inside Blender 3.4:

blender -b --factory-startup -P cycles_gltf.py -- SCENE.glb MAP.exr OUT.exr --frame 7 --width 480 --height 270 --spp 64
    --seed 1 --threads 2 [--catcher NODE [--unblocked]]

Of each material the images, their places and holes are the importer's; the Principled BSDF, which models other surfaces
than glTF does, gives way to a diffuse one and, as far as it is metal, to a white GGX lobe.

--catcher: the node is white and diffuse and blocks nothing, all else is black: the picture is the catcher's light, as far
as it is seen. --unblocked: the other nodes block nothing either, but hide as much.
"""

import argparse
import math
import sys
from pathlib import Path

import bpy
import numpy

sys.dont_write_bytecode = True
sys.path.insert(0, str(Path(__file__).resolve().parent))
import cycles_scene  # noqa: E402
import cycles_settings  # noqa: E402


def parse_arguments():
    parser = argparse.ArgumentParser(prog="cycles_gltf.py")
    for name in ("scene", "map", "out"):
        parser.add_argument(name, type=Path)
    for name in ("frame", "width", "height", "spp", "seed", "threads"):
        parser.add_argument(f"--{name}", type=int, required=True)
    parser.add_argument("--catcher")
    parser.add_argument("--unblocked", action="store_true")
    return parser.parse_args(sys.argv[sys.argv.index("--") + 1:])


def replace_principled(material):
    """As Baton's model with `specular` 0: diffuse where it is no metal, else a mirror of white facets."""
    nodes, links = material.node_tree.nodes, material.node_tree.links
    principled = next((node for node in nodes if node.type == "BSDF_PRINCIPLED"), None)
    if principled is None:
        return

    def feed(name, socket):
        """What the importer has put into an input, put into another."""
        given = principled.inputs[name]
        if given.is_linked:
            links.new(given.links[0].from_socket, socket)
        else:
            socket.default_value = given.default_value

    diffuse, glossy = nodes.new("ShaderNodeBsdfDiffuse"), nodes.new("ShaderNodeBsdfGlossy")
    glossy.distribution = "GGX"
    glossy.inputs["Color"].default_value = (1, 1, 1, 1)
    feed("Base Color", diffuse.inputs["Color"])
    feed("Roughness", glossy.inputs["Roughness"])
    if principled.inputs["Normal"].is_linked:
        for bsdf in (diffuse, glossy):
            feed("Normal", bsdf.inputs["Normal"])
    metal = nodes.new("ShaderNodeMixShader")
    feed("Metallic", metal.inputs["Fac"])
    links.new(diffuse.outputs[0], metal.inputs[1])
    links.new(glossy.outputs[0], metal.inputs[2])
    holes, nothing = nodes.new("ShaderNodeMixShader"), nodes.new("ShaderNodeBsdfTransparent")
    feed("Alpha", holes.inputs["Fac"])
    links.new(nothing.outputs[0], holes.inputs[1])
    links.new(metal.outputs[0], holes.inputs[2])
    glow, both = nodes.new("ShaderNodeEmission"), nodes.new("ShaderNodeAddShader")
    feed("Emission", glow.inputs["Color"])
    # What glows is seen, and lights nothing.
    seen, strength = nodes.new("ShaderNodeLightPath"), nodes.new("ShaderNodeMath")
    strength.operation = "MULTIPLY"
    links.new(seen.outputs["Is Camera Ray"], strength.inputs[0])
    feed("Emission Strength", strength.inputs[1])
    links.new(strength.outputs[0], glow.inputs["Strength"])
    links.new(glow.outputs[0], both.inputs[0])
    links.new(holes.outputs[0], both.inputs[1])
    output = next(node for node in nodes if node.type == "OUTPUT_MATERIAL")
    links.new(both.outputs[0], output.inputs["Surface"])
    material.cycles.sample_as_light = False


def blacken(material):
    """No light from a material of replace_principled, whose holes stay."""
    nodes, links = material.node_tree.nodes, material.node_tree.links
    output = next(node for node in nodes if node.type == "OUTPUT_MATERIAL")
    holes = output.inputs["Surface"].links[0].from_node.inputs[1].links[0].from_node
    black = nodes.new("ShaderNodeBsdfDiffuse")
    black.inputs["Color"].default_value = (0, 0, 0, 1)
    links.new(black.outputs[0], holes.inputs[2])
    links.new(holes.outputs[0], output.inputs["Surface"])


def catch(scene, name, unblocked):
    """Light of the catcher alone, and what blocks it."""
    catcher = scene.objects[name]
    for material in bpy.data.materials:
        if material.use_nodes:
            blacken(material)
    white = bpy.data.materials.new("catcher")
    white.use_nodes = True
    nodes, links = white.node_tree.nodes, white.node_tree.links
    nodes.clear()
    surface = nodes.new("ShaderNodeBsdfDiffuse")
    surface.inputs["Color"].default_value = (1, 1, 1, 1)
    links.new(surface.outputs[0], nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    catcher.data.materials.clear()
    catcher.data.materials.append(white)
    for shown in scene.objects:
        if shown == catcher or unblocked:
            shown.visible_shadow = shown.visible_diffuse = False
    scene.render.film_transparent = True


def main():
    options = parse_arguments()
    for collection in (bpy.data.objects, bpy.data.meshes, bpy.data.cameras, bpy.data.lights):
        for item in list(collection):
            collection.remove(item)
    scene = bpy.context.scene
    numpy.bool = bool  # which the importer of Debian's Blender needs and Debian's numpy no longer has
    bpy.ops.import_scene.gltf(filepath=str(options.scene))
    for material in bpy.data.materials:
        if material.use_nodes:
            replace_principled(material)
    for shown in scene.objects:
        if shown.type == "CAMERA":
            scene.camera = shown
        # Shadow rays start at the surface that is seen, not at a smoothed one.
        shown.cycles.shadow_terminator_geometry_offset = 0
        shown.cycles.shadow_terminator_offset = 0
    cycles_scene.set_picture(scene, {"width": options.width, "height": options.height})
    if options.catcher:
        catch(scene, options.catcher, options.unblocked)
    cycles_settings.set_light(scene, options)
    sky = cycles_scene.Sky(scene, options.map.parent, {"maps": [options.map.name], "bilinear": True}, None)
    sky.show({"map": 0, "rotation": [1, 0, 0, 0, 1, 0, 0, 0, 1]})
    # The importer makes x, -z, y of x, y, z; conventions.py has z, x, y.
    sky.turn.inputs["Rotation"].default_value = (0, 0, math.pi / 2)
    scene.frame_set(options.frame)
    scene.render.filepath = str(options.out.resolve())
    bpy.ops.render.render(write_still=True)


if __name__ == "__main__":
    main()

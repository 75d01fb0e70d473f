"""Traits of materials: images and how they are read and placed, constants, alpha, outputs, nodes."""

import bpy
from blender_stage import keyed
from blender_trait import trait
from blender_traits_of_worlds import write_png

HOLES = [(0, 0), (2, 3), (3, 1)]


def file_of(stage, name, draw, depth=8):
    """A PNG of 4 x 4 dull colours with alpha that is 0, 1 or between."""
    rows = [[(0.2 + 0.15 * x, 0.3 + 0.12 * y, 0.4, draw.choice((0, 1, 1, 0.5, 0.8))) for x in range(4)] for y in range(4)]
    (stage.folder / name).write_bytes(write_png(rows, depth))
    return bpy.data.images.load(str(stage.folder / name))


@trait("paint")
def image_with_alpha(stage, draw):
    image = file_of(stage, "chart.png", draw, 16 if draw.random() < 0.2 else 8)
    image.alpha_mode = draw.choice(("STRAIGHT", "PREMUL", "CHANNEL_PACKED", "NONE"))
    stage.paint(image)


@trait("paint")
def generated_image(stage, draw):
    image = stage.chart("chart", alpha=(lambda x, y: 0.2 + 0.2 * x) if draw.random() < 0.5 else None)
    if draw.random() < 0.5:
        image.pack()
    stage.paint(image)


def mapped(stage, node, kind):
    tree = stage.plaster.node_tree
    mapping, coordinates = tree.nodes.new("ShaderNodeMapping"), tree.nodes.new("ShaderNodeTexCoord")
    mapping.vector_type = kind
    tree.links.new(coordinates.outputs["UV"], mapping.inputs["Vector"])
    tree.links.new(mapping.outputs["Vector"], node.inputs["Vector"])
    return mapping.inputs


@trait("paint")
def mapping(stage, draw):
    inputs = mapped(stage, stage.paint(stage.chart("chart")), draw.choice(("TEXTURE", "TEXTURE", "POINT", "VECTOR", "NORMAL")))
    if "Location" in inputs:
        inputs["Location"].default_value = (draw.uniform(-1, 1), draw.uniform(-1, 1), 0)
    inputs["Rotation"].default_value = (draw.choice((0, 0, 0, 0.5)), 0, draw.choice((0, 0.7, 1.5707963)))
    inputs["Scale"].default_value = draw.choice(((1, 1, 1), (2, 2, 2), (0.5, 2, 1), (-1, 1.5, 1), (1.2, -1.2, 3)))


@trait("paint")
def extension(stage, draw):
    node = stage.paint(stage.chart("chart"))
    node.extension = draw.choice(("REPEAT", "EXTEND", "CLIP"))
    mapped(stage, node, "POINT")["Scale"].default_value = (1.7, 1.7, 1)


@trait("paint")
def texel_filter(stage, draw):
    image = stage.chart("chart")
    image.colorspace_settings.name = "sRGB"
    image.pixels.foreach_set([0.5] * 32 + [0.6] * 32)
    stage.paint(image).interpolation = draw.choice(("Linear", "Cubic", "Smart", "Closest"))


@trait("paint")
def color_beyond_one(stage, draw):
    color = stage.plaster.node_tree.nodes["Diffuse BSDF"].inputs["Color"]
    value = (draw.choice((0.5, 1.6)), 0.4, draw.choice((0.3, -0.5)), 1)
    if draw.random() < 0.5:
        color.default_value = value
        return
    given = stage.plaster.node_tree.nodes.new("ShaderNodeRGB")
    given.outputs[0].default_value = value
    stage.plaster.node_tree.links.new(given.outputs[0], color)


@trait("paint")
def colors_by_nodes(stage, draw):
    """An image times a colour, mixed with one, or through another node."""
    tree = stage.plaster.node_tree
    node = stage.paint(stage.chart("chart"))
    kind = draw.choice(("multiply", "multiply", "bright", "mix", "gamma", "invert", "group"))
    if kind in ("multiply", "mix", "bright"):
        mix = tree.nodes.new("ShaderNodeMix")
        mix.data_type, mix.blend_type = "RGBA", "MIX" if kind == "mix" else "MULTIPLY"
        factor, one, other = (next(item for item in mix.inputs if item.enabled and item.name == name) for name in ("Factor", "A", "B"))
        factor.default_value = draw.choice((1, 1, 0.5))
        other.default_value = (0.8, 0.5, 1.5 if kind == "bright" else 0.9, 1)
        tree.links.new(node.outputs[0], one)
        made = next(item for item in mix.outputs if item.enabled)
    elif kind == "group":
        group = bpy.data.node_groups.new("colors", "ShaderNodeTree")
        group.outputs.new("NodeSocketColor", "Color")
        inner = group.nodes.new("ShaderNodeRGB")
        inner.outputs[0].default_value = (0.1, 0.6, 0.2, 1)
        group.links.new(inner.outputs[0], group.nodes.new("NodeGroupOutput").inputs[0])
        holder = tree.nodes.new("ShaderNodeGroup")
        holder.node_tree = group
        made = holder.outputs[0]
    else:
        other = tree.nodes.new("ShaderNodeGamma" if kind == "gamma" else "ShaderNodeInvert")
        if kind == "gamma":
            other.inputs["Gamma"].default_value = 2
        tree.links.new(node.outputs[0], other.inputs["Color"])
        made = other.outputs[0]
        other.mute = draw.random() < 0.3
    tree.links.new(made, tree.nodes["Diffuse BSDF"].inputs["Color"])


@trait("paint")
def two_outputs_of_a_material(stage, draw):
    """Of Eevee and of Cycles, which is meant, in either order."""
    tree = stage.plaster.node_tree
    own, other = tree.nodes["Material Output"], tree.nodes.new("ShaderNodeOutputMaterial")
    surface = tree.nodes.new(draw.choice(("ShaderNodeBsdfPrincipled", "ShaderNodeBsdfDiffuse")))
    tree.links.new(surface.outputs[0], other.inputs["Surface"])
    surface.inputs[0].default_value = (0.05, 0.1, 0.8, 1)
    own.target, other.target = draw.choice((("CYCLES", "EEVEE"), ("ALL", "EEVEE")))
    other.is_active_output = draw.random() < 0.5


@trait("paint")
def culling(stage, _draw):
    stage.plaster.use_backface_culling = True
    stage.post.data.flip_normals()
    stage.post.data.update()


@trait("paint")
def other_surfaces(stage, draw):
    tree = stage.plaster.node_tree
    kind = draw.choice(("BsdfGlossy", "BsdfTransparent", "Emission", "BsdfVelvet", "EeveeSpecular", "none", "mute"))
    if kind == "none":
        stage.post.data.materials.clear()
    elif kind == "mute":
        tree.nodes["Diffuse BSDF"].mute = True
    else:
        tree.links.new(tree.nodes.new(f"ShaderNode{kind}").outputs[0], tree.nodes["Material Output"].inputs["Surface"])


@trait("paint")
def rough_diffuse(stage, _draw):
    stage.plaster.node_tree.nodes["Diffuse BSDF"].inputs["Roughness"].default_value = 0.8


@trait("paint")
def keyed_color(stage, _draw):
    stage.scene.frame_end = 3
    keyed(stage.plaster.node_tree.nodes["Diffuse BSDF"].inputs["Color"], "default_value", {1: (0.1, 0.1, 0.1, 1), 3: (0.9, 0.9, 0.9, 1)})


@trait("paint")
def material_of_the_object(stage, draw):
    stage.post.material_slots[0].link = "OBJECT"
    stage.post.material_slots[0].material = stage.diffuse("own", (0.7, 0.6, 0.1)) if draw.random() < 0.7 else None


@trait("paint")
def bumps(stage, draw):
    tree = stage.plaster.node_tree
    kind = draw.choice(("Bump", "NormalMap", "Displacement"))
    node, noise = tree.nodes.new(f"ShaderNode{kind}"), tree.nodes.new("ShaderNodeTexNoise")
    tree.links.new(noise.outputs[0], node.inputs["Color" if kind == "NormalMap" else "Height"])
    if kind == "Displacement":
        tree.links.new(node.outputs[0], tree.nodes["Material Output"].inputs["Displacement"])
    else:
        tree.links.new(node.outputs[0], tree.nodes["Diffuse BSDF"].inputs["Normal"])


@trait("metal")
def alpha(stage, draw):
    """A constant or an image, with any blend mode."""
    stage.material.blend_method = draw.choice(("OPAQUE", "CLIP", "HASHED", "BLEND"))
    stage.material.alpha_threshold = draw.choice((0.2, 0.7))
    if draw.random() < 0.4:
        stage.surface["Alpha"].default_value = draw.choice((0, 0.4, 0.9))
        return
    image = file_of(stage, "holes.png", draw)
    image.alpha_mode = draw.choice(("STRAIGHT", "NONE", "CHANNEL_PACKED", "PREMUL"))
    node = stage.paint(image, "Alpha", stage.material)
    stage.material.node_tree.links.new(node.outputs["Alpha"], stage.surface["Alpha"])


@trait("metal")
def alpha_by_a_mask(stage, draw):
    """The grey of one image, with colours of another or none."""
    mask = stage.chart("mask", 8)
    mask.pixels.foreach_set([value for texel in range(64) for value in [0 if texel % 3 else 1] * 3 + [1]])
    mask.colorspace_settings.name = "Non-Color"
    stage.paint(mask, "Alpha", stage.material)
    if draw.random() < 0.5:
        white = stage.chart("white", draw.choice((4, 8)))
        white.pixels.foreach_set([0.999] * 3 * 4 + [1] * (len(white.pixels) - 12))
        stage.paint(white, "Base Color", stage.material)


@trait("metal")
def metal_by_image(stage, draw):
    image = stage.chart("rough")
    image.colorspace_settings.name = draw.choice(("Non-Color", "Non-Color", "sRGB"))
    tree, node = stage.material.node_tree, stage.paint(image, "Roughness", stage.material)
    if draw.random() < 0.7:
        parts = tree.nodes.new("ShaderNodeSeparateColor")
        tree.links.new(node.outputs[0], parts.inputs[0])
        tree.links.new(parts.outputs[draw.choice(("Green", "Green", "Red"))], stage.surface["Roughness"])


@trait("metal")
def roughness(stage, draw):
    stage.surface["Roughness"].default_value = draw.choice((0.25, 0.4, 0.7, 1))


@trait("metal")
def roughness_by_a_value(stage, draw):
    given = stage.material.node_tree.nodes.new("ShaderNodeValue")
    given.outputs[0].default_value = draw.choice((0.3, 1.7))
    stage.material.node_tree.links.new(given.outputs[0], stage.surface["Roughness"])


@trait("metal")
def other_inputs(stage, draw):
    name, value = draw.choice((("Sheen", 1), ("Anisotropic", 0.8), ("Emission Strength", 1), ("Transmission", 0.8), ("Subsurface", 0.5)))
    if name == "Emission Strength":
        stage.surface["Emission"].default_value = (0.3, 0.1, 0.1, 1)
    if name in ("Transmission", "Subsurface", "Sheen"):
        stage.surface["Metallic"].default_value = 0
    stage.surface[name].default_value = value


@trait("metal")
def another_distribution(stage, draw):
    node = stage.material.node_tree.nodes["Principled BSDF"]
    node.distribution = draw.choice(("GGX", "MULTI_GGX"))
    stage.surface["Roughness"].default_value = 0.8


@trait("metal")
def mixed_shaders(stage, _draw):
    tree = stage.material.node_tree
    mix, clear = tree.nodes.new("ShaderNodeMixShader"), tree.nodes.new("ShaderNodeBsdfTransparent")
    tree.links.new(tree.nodes["Principled BSDF"].outputs[0], mix.inputs[1])
    tree.links.new(clear.outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], tree.nodes["Material Output"].inputs["Surface"])

"""A small scene that tests change, and what it looks like to Cycles; runs inside Blender."""

import math
import struct

import bpy
from baton_exporter import exr


class Stage:
    """A file with a camera, a plane "floor", a ball with an own material, and an image as world."""

    def __init__(self, folder):
        self.folder = folder
        bpy.ops.wm.read_factory_settings(use_empty=True)
        scene = self.scene = bpy.context.scene
        scene.render.engine, scene.frame_start, scene.frame_end = "CYCLES", 1, 4
        scene.render.resolution_x, scene.render.resolution_y = 96, 54
        scene.render.image_settings.file_format = "OPEN_EXR"
        self.camera = self.add("camera", bpy.data.cameras.new("camera"))
        self.camera.location, self.camera.rotation_euler.x, scene.camera = (0, -6, 2), math.radians(75), self.camera
        bpy.ops.mesh.primitive_plane_add(size=10)
        bpy.context.object.name = "floor"
        bpy.ops.mesh.primitive_uv_sphere_add(segments=8, ring_count=6, location=(0, 0, 1))
        self.ball = bpy.context.object
        self.ball.name = "ball"
        self.material = bpy.data.materials.new("paint")
        self.material.use_nodes = True
        self.ball.data.materials.append(self.material)
        self.surface = self.material.node_tree.nodes["Principled BSDF"].inputs
        self.world = scene.world = bpy.data.worlds.new("sky")
        self.world.use_nodes = True
        self.background = self.world.node_tree.nodes["Background"]
        self.sky = self.environment(self.background, "sky.0001.exr")

    def add(self, name, data):
        item = bpy.data.objects.new(name, data)
        self.scene.collection.objects.link(item)
        return item

    def mesh(self, name, places, faces):
        data = bpy.data.meshes.new(name)
        data.from_pydata(places, [], faces)
        return self.add(name, data)

    def exr(self, name, value=2.0):
        exr.write(self.folder / name, 8, 4, [struct.pack("<24f", *[value] * 24)] * 4)
        return bpy.data.images.load(str(self.folder / name))

    def environment(self, background, name):
        texture = self.world.node_tree.nodes.new("ShaderNodeTexEnvironment")
        texture.image = self.exr(name)
        self.world.node_tree.links.new(texture.outputs[0], background.inputs["Color"])
        return texture

    def seen_by_camera(self):
        """Another Background, by Is Camera Ray."""
        tree = self.world.node_tree
        seen, mix, path = (tree.nodes.new(f"ShaderNode{kind}") for kind in ("Background", "MixShader", "LightPath"))
        for given, socket in ((path.outputs["Is Camera Ray"], mix.inputs[0]), (self.background.outputs[0], mix.inputs[1]),
                              (seen.outputs[0], mix.inputs[2]), (mix.outputs[0], tree.nodes["World Output"].inputs[0])):
            tree.links.new(given, socket)
        return seen

    def texture(self, image=None, name="Base Color", uv_map=None, material=None):
        tree = (material or self.material).node_tree
        node = tree.nodes.new("ShaderNodeTexImage")
        node.image = image or bpy.data.images.new("chart", 8, 8)
        tree.links.new(node.outputs["Color"], tree.nodes["Principled BSDF"].inputs[name])
        if uv_map:
            chosen = tree.nodes.new("ShaderNodeUVMap")
            chosen.uv_map = uv_map
            tree.links.new(chosen.outputs[0], node.inputs["Vector"])
        return node

    def modify_by_nodes(self, *kinds):
        """Geometry nodes that join what each kind makes of the mesh; None: the mesh itself."""
        tree = self.ball.modifiers.new("nodes", "NODES").node_group = bpy.data.node_groups.new("nodes", "GeometryNodeTree")
        start, end, join = (tree.nodes.new(kind) for kind in ("NodeGroupInput", "NodeGroupOutput", "GeometryNodeJoinGeometry"))
        tree.inputs.new("NodeSocketGeometry", "Geometry")
        tree.outputs.new("NodeSocketGeometry", "Geometry")
        tree.links.new(join.outputs[0], end.inputs[0])
        for kind in kinds:
            made = start
            if kind:
                made = tree.nodes.new(kind)
                tree.links.new(start.outputs[0], made.inputs[0])
            tree.links.new(made.outputs[0], join.inputs[0])


def keyed(owner, name, values, index=-1):
    """values: by frame."""
    for frame, value in values.items():
        if index < 0:
            setattr(owner, name, value)
        else:
            getattr(owner, name)[index] = value
        owner.keyframe_insert(name, frame=frame, index=index)


class LitStage(Stage):
    """The same under a sky of smooth light, with surfaces on which Baton and Cycles agree but for noise: a ball of white metal,
    a floor and a post of grey plaster. Everything of it is carried over."""

    WIDTH, HEIGHT = 64, 40

    def __init__(self, folder):
        super().__init__(folder)
        scene = self.scene
        scene.frame_end = 1
        scene.render.resolution_x, scene.render.resolution_y = self.WIDTH, self.HEIGHT
        scene.render.image_settings.color_depth = "32"
        scene.cycles.pixel_filter_type = "BOX"
        self.sky.image = self.sky_image("sky.exr")
        # As fine as the sky is: by itself Blender takes 4096 columns, which cost more than the picture.
        self.world.cycles.sampling_method, self.world.cycles.sample_map_resolution = "MANUAL", 64
        self.surface["Base Color"].default_value, self.surface["Metallic"].default_value = (1, 1, 1, 1), 1
        self.ball.location.x = -0.9
        bpy.ops.mesh.primitive_cube_add(size=1, location=(1.4, 0.4, 0.9))
        self.post = bpy.context.object
        self.post.name, self.post.scale = "post", (0.9, 0.9, 1.8)
        self.plaster = self.diffuse("plaster", (0.5, 0.4, 0.3))
        self.post.data.materials.append(self.plaster)

    def sky_image(self, name, light=1.0):
        """Bluish above, brown below, and a soft warm sun."""
        exr.write(self.folder / name, 32, 16, [struct.pack("<96f", *sky_row(row, light)) for row in range(16)])
        return bpy.data.images.load(str(self.folder / name))

    def diffuse(self, name, color):
        made = bpy.data.materials.new(name)
        made.use_nodes = True
        tree = made.node_tree
        tree.nodes.clear()
        surface = tree.nodes.new("ShaderNodeBsdfDiffuse")
        surface.inputs["Color"].default_value = (*color, 1)
        tree.links.new(surface.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
        return made

    def paint(self, image, socket="Color", material=None):
        """An Image Texture with hard texels on the plaster's colour, or on another input."""
        tree = (material or self.plaster).node_tree
        node = tree.nodes.new("ShaderNodeTexImage")
        node.image, node.interpolation = image, "Closest"
        surface = next(item for item in tree.nodes if item.type.startswith("BSDF"))
        tree.links.new(node.outputs["Color"], surface.inputs[socket])
        return node

    def chart(self, name, size=4, alpha=None, **options):
        """A generated image of dull colours, another in each texel; alpha(x, y): where it is not 1."""
        image = bpy.data.images.new(name, size, size, alpha=alpha is not None, **options)
        texels = [(0.2 + 0.6 * x / size, 0.2 + 0.6 * y / size, 0.3, alpha(x, y) if alpha else 1)
                  for y in range(size) for x in range(size)]
        image.pixels.foreach_set([value for texel in texels for value in texel])
        return image


def sky_row(row, light):
    """Blue, green, then red of a row from above."""
    up = (7.5 - row) / 8
    below, above = (0.12, 0.1, 0.08), (0.9 + 0.4 * up, 0.6 + 0.3 * up, 0.4 + 0.3 * up)
    colors = []
    for column in range(32):
        sun = 9 * math.exp(-((column - 9) / 3) ** 2 - ((row - 4) / 2) ** 2)
        color = above if up > 0 else below
        colors.append([light * (part + sun * tint) for part, tint in zip(color, (0.5, 0.8, 1.0))])
    return [color[channel] for channel in range(3) for color in colors]

"""The world of a scene as the environment of a job; runs inside Blender.

What is carried over: Background, Environment Texture, Mapping, Texture Coordinate (Generated), and a plain colour."""

from . import conventions, images, keys, nodes
from .camera import number, numbers

BAKE = "bake the world into one image and use that"
TURN_TOLERANCE_DEG = 2e-3
SCALE_TOLERANCE = 1e-5
DARK = (0.0, 0.0, 0.0)


class World:
    """Finds the nodes of the world, then collects their values frame by frame."""

    def __init__(self, scene, report):
        self.scene, self.report = scene, report
        self.world = scene.world
        self.background = self.texture = self.mapping = None
        self.scales, self.colors, self.rotations = [], [], []
        self.reported = False
        if self.world and self.world.use_nodes:
            self.find_nodes()

    def add(self, what, remedy=BAKE):
        self.report.add(f'world "{self.world.name}"', what, remedy)

    def find_nodes(self):
        output = nodes.active_output(self.world.node_tree, "OUTPUT_WORLD")
        if output is None:
            return
        if nodes.source(output.inputs["Volume"]):
            self.add("its volume", "remove it")
        surface = nodes.source(output.inputs["Surface"])
        if surface is None:
            return
        if surface.node.type != "BACKGROUND" or surface.node.mute:
            self.add(f'node "{surface.node.name}": only a Background is read')
            surface = next((s for s in [n.outputs[0] for n in nodes.feeding(output.inputs["Surface"])]
                            if s.node.type == "BACKGROUND"), None)
            if surface is None:
                return
        self.background = surface.node
        strength = nodes.source(self.background.inputs["Strength"])
        if strength is not None:
            self.add(f'node "{strength.node.name}" on the strength', "key the strength itself")
        color = nodes.source(self.background.inputs["Color"])
        if color is None:
            return
        if color.node.type != "TEX_ENVIRONMENT" or color.node.mute:
            self.add(f'node "{color.node.name}": only an Environment Texture is read')
            color = next((n.outputs[0] for n in nodes.feeding(self.background.inputs["Color"])
                          if n.type == "TEX_ENVIRONMENT"), None)
            if color is None:
                return
        self.take_texture(color.node)

    def take_texture(self, texture):
        if texture.image is None:
            self.add(f'node "{texture.name}" has no image', "choose one")
            return
        self.texture = texture
        if texture.projection != "EQUIRECTANGULAR":
            self.add("its mirror ball", "convert it to an equirectangular image")
        if not nodes.is_identity(texture.texture_mapping):
            self.add("the texture's own mapping", "use a Mapping node")
        vector = nodes.source(texture.inputs["Vector"])
        if vector is not None and vector.node.type == "MAPPING" and not vector.node.mute:
            self.mapping = vector.node
            for name in ("Location", "Rotation", "Scale"):
                given = nodes.source(self.mapping.inputs[name])
                if given is not None:
                    self.add(f'node "{given.node.name}" on the mapping', "key the Mapping node itself")
            vector = nodes.source(self.mapping.inputs["Vector"])
            if vector is None:
                self.add("a Mapping node without a direction", "connect Texture Coordinate, Generated")
        if vector is not None and (vector.node.type, vector.name) != ("TEX_COORD", "Generated"):
            self.add(f'node "{vector.node.name}" ({vector.name}) as direction', "use Texture Coordinate, Generated")

    def take(self, depsgraph):
        """The values of one frame."""
        exposure = self.scene.cycles.film_exposure if hasattr(self.scene, "cycles") else 1.0
        if self.world is None:
            self.scales.append(0.0)
            self.colors.append(DARK)
            return
        evaluated = self.world.evaluated_get(depsgraph)
        tree = evaluated.node_tree
        if self.world.use_nodes:
            background = tree.nodes[self.background.name] if self.background else None
            strength = background.inputs["Strength"].default_value if background else 0.0
            self.colors.append(tuple(background.inputs["Color"].default_value)[:3] if background else DARK)
        else:
            strength = 1.0
            self.colors.append(tuple(evaluated.color))
        self.scales.append(max(strength, 0.0) * exposure)
        if self.texture:
            self.rotations.append(conventions.map_rotation(self.lookup(tree)))

    def lookup(self, tree):
        """Rotation from the world to the map."""
        if self.mapping is None:
            return conventions.euler_matrix((0, 0, 0))
        mapping = tree.nodes[self.mapping.name]
        location, angles, scale = (tuple(mapping.inputs[name].default_value) if name in mapping.inputs else (0, 0, 0)
                                   for name in ("Location", "Rotation", "Scale"))
        try:
            return conventions.mapping_lookup(mapping.vector_type, location, angles, scale)
        except conventions.NotARotation as fault:
            self.add(f'node "{mapping.name}": {fault}', "change the image itself, and only turn it here")
            return conventions.mapping_lookup(mapping.vector_type, (0, 0, 0), angles, (1, 1, 1))

    def job(self, folder, frames):
        """`environment` of the job; its images go to the folder."""
        if self.texture is None or max(self.scales) == 0:
            return self.plain(folder, frames)
        environment = images.export(self.texture, folder, frames, self.add)
        environment.update(self.scale(frames))
        rotation = self.rotation(frames)
        if rotation:
            environment["rotation"] = rotation
        return environment

    def plain(self, folder, frames):
        """A world of one colour."""
        light = [[c * scale for c in color] for color, scale in zip(self.colors, self.scales)]
        if keys.is_constant(light, SCALE_TOLERANCE * max(map(max, light))):
            return {"map": images.write_plain(folder / "sky.exr", light[0])}
        kept = keys.reduce_linear(frames, light, SCALE_TOLERANCE * max(map(max, light)))
        return {"keys": [{"frame": frames[i], "map": images.write_plain(folder / f"sky.{frames[i]:04}.exr", light[i])}
                         for i in kept]}

    def scale(self, frames):
        rows = [[scale] for scale in self.scales]
        kept = keys.reduce_linear(frames, rows, SCALE_TOLERANCE * max(self.scales))
        if len(kept) == 1:
            return {} if self.scales[0] == 1 else {"scale": number(self.scales[0])}
        return {"scaleKeys": [{"frame": frames[i], "scale": number(self.scales[i])} for i in kept]}

    def rotation(self, frames):
        """About up where it can be said so; else one axis, at rest."""
        angles = [conventions.up_angle(rotation) for rotation in self.rotations]
        if None in angles:
            axis, degrees = conventions.axis_angle(self.rotations[0])
            if not keys.is_constant([sum(r, []) for r in self.rotations], 1e-6):
                self.add("it turns, but not about the vertical alone", "turn it about z only; tilt the image itself")
            return {"axis": numbers(axis), "startDeg": number(degrees)}
        angles = keys.unwrapped(angles)
        # The first angle in (-180, 180], however it is said in Blender.
        speed = keys.constant_speed(frames, angles, TURN_TOLERANCE_DEG)
        if speed is None:
            kept = keys.reduce_linear(frames, [[angle] for angle in angles], TURN_TOLERANCE_DEG)
            return {"keys": [{"frame": frames[i], "deg": round(angles[i], 5)} for i in kept]}
        if abs(speed) <= 1e-7:
            return {"startDeg": round(angles[0], 5)} if abs(angles[0]) > 1e-6 else {}
        return {"startFrame": frames[0], "startDeg": round(angles[0], 5), "degPerFrame": round(speed, 7)}

"""A Background node of the world: its colour or image, and its values frame by frame; runs inside Blender."""

from . import conventions, keys, nodes

BAKE = "bake the world into one image and use that"
DARK = (0.0, 0.0, 0.0)
TOLERANCE = 1e-5


class Background:
    """add(what, remedy=BAKE): reports. Without a node: the colour of a world without nodes, or dark."""

    def __init__(self, node, add):
        self.node, self.add = node, add
        self.texture = self.mapping = None
        self.scales, self.colors, self.rotations = [], [], []
        self.users = []  # which image of a sequence is shown: start, length, offset, cyclic
        if node is not None:
            self.find_nodes()

    def find_nodes(self):
        strength = nodes.source(self.node.inputs["Strength"])
        if strength is not None:
            self.add(f'node "{strength.node.name}" on the strength', "key the strength itself")
        color = nodes.source(self.node.inputs["Color"])
        if color is None:
            return
        if color.node.type != "TEX_ENVIRONMENT" or color.node.mute:
            self.add(f'node "{color.node.name}": only an Environment Texture is read')
            color = next((n.outputs[0] for n in nodes.feeding(self.node.inputs["Color"])
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

    def take(self, tree, exposure, plain):
        """The values of one frame. tree: the world's, evaluated; plain: the colour without a node."""
        strength, color = 1.0, plain
        if self.node is not None:
            inputs = tree.nodes[self.node.name].inputs
            strength, color = inputs["Strength"].default_value, tuple(inputs["Color"].default_value)[:3]
        self.colors.append(color)
        self.scales.append(max(strength, 0.0) * exposure)
        if self.texture:
            user = tree.nodes[self.texture.name].image_user
            self.users.append((user.frame_start, user.frame_duration, user.frame_offset, user.use_cyclic))
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

    def shows_texture(self):
        return self.texture is not None and max(self.scales) > 0

    def light(self):
        """Colours times strength, without an image."""
        return [[c * scale for c in color] for color, scale in zip(self.colors, self.scales)]

    def is_constant(self):
        """But for how it is turned."""
        if self.shows_texture():
            rows, moves = [[scale] for scale in self.scales], self.texture.image.source in ("SEQUENCE", "MOVIE")
        else:
            rows, moves = self.light(), False
        return not moves and keys.is_constant(rows, TOLERANCE * max(map(max, rows)))

"""Materials: what Blender's glTF exporter or Baton would drop is reported; runs inside Blender.

Carried over: a Principled BSDF with constants, images, normal maps, a coat and cut-outs, and a Diffuse BSDF. The glTF exporter
reads Principled ones alone, so a Diffuse one becomes one of these."""

from . import conventions, images, nodes

# Inputs of the Principled BSDF that change nothing at these values.
NEUTRAL = {"Subsurface": 0, "Specular Tint": 0, "Anisotropic": 0, "Sheen": 0, "Transmission": 0}
WITH_NEUTRAL = {"Subsurface Radius", "Subsurface Color", "Subsurface IOR", "Subsurface Anisotropy", "Anisotropic Rotation",
                "Sheen Tint", "Clearcoat Normal", "Transmission Roughness", "IOR", "Tangent",
                "Emission Strength", "Weight"}
BAKE = "bake it into an image (Render Properties > Bake)"
FILES = {"PNG", "JPEG"}  # other images become PNG
# Of an image: where glTF has what an input takes.
CHANNELS = {"Metallic": "Blue", "Roughness": "Green", "Clearcoat": "Red", "Clearcoat Roughness": "Green"}


class Materials:
    def __init__(self, report):
        self.report = report
        self.diffuse = set()  # names of those that are diffuse alone

    def check(self, materials):
        for material in materials:
            self.check_one(material)

    def check_one(self, material):
        where = f'material "{material.name}"'

        def add(what, remedy=BAKE):
            self.report.add(where, what, remedy)

        if not material.use_nodes:
            add("it has no nodes", "switch Use Nodes on")
            return
        if nodes.is_animated(material):
            add("its values change, but stay as in the first frame", "keep them constant")
        output = nodes.active_output(material.node_tree, "OUTPUT_MATERIAL")
        if output is None:
            add("it has no output", "add a Material Output")
            return
        material.use_backface_culling = False  # Cycles does not heed it
        nodes.keep_output(material.node_tree, output)
        for name in ("Volume", "Displacement"):
            if nodes.source(output.inputs[name]):
                add(f"its {name.lower()}", "model it, or bake a normal map" if name == "Displacement" else "remove it")
        drop_tiled(material, output, add)
        surface = nodes.source(output.inputs["Surface"])
        if surface is None:
            add("it has no surface, so Cycles shows it black", "connect a Principled BSDF")
        elif surface.node.type == "BSDF_PRINCIPLED" and not surface.node.mute:
            Surface(material, surface.node, add).check_principled()
        elif surface.node.type == "BSDF_DIFFUSE" and not surface.node.mute:
            Surface(material, surface.node, add).check_diffuse()
            replace_diffuse(material, surface.node)
            self.diffuse.add(material.name)
        else:
            for node in [n for n in nodes.feeding(output.inputs["Surface"]) if n.outputs and n.outputs[0].type == "SHADER"]:
                if node.type != "BSDF_PRINCIPLED":
                    add(f'node "{node.name}"', "use one Principled BSDF")


class Surface:
    """The inputs of a BSDF."""

    def __init__(self, material, bsdf, add):
        self.material, self.bsdf, self.add = material, bsdf, add

    def check_principled(self):
        inputs = self.bsdf.inputs
        for name, neutral in NEUTRAL.items():
            if nodes.source(inputs[name]) or inputs[name].default_value != neutral:
                if name == "Specular Tint" and not nodes.source(inputs[name]):
                    continue  # the glTF exporter makes it a colour of the reflection
                self.add(f"{name} of the Principled BSDF", "set it to 0")
        for name in sorted(WITH_NEUTRAL & set(inputs.keys())):
            if nodes.source(inputs[name]) and name != "Emission Strength":
                self.add(f"{name} of the Principled BSDF is connected", "disconnect it")
        if nodes.source(inputs["Specular"]):
            self.add("Specular of the Principled BSDF is connected", "set it to one value")
        self.check_emission(inputs["Emission"], inputs["Emission Strength"])
        self.check_input(inputs["Base Color"], {"MIX"})
        for name in ("Metallic", "Roughness", "Clearcoat", "Clearcoat Roughness"):
            self.check_input(inputs[name], {"SEPARATE_COLOR", "SEPRGB", "MATH"})
        self.check_pair(inputs["Base Color"], inputs["Alpha"])
        self.check_pair(inputs["Metallic"], inputs["Roughness"])
        self.check_normal(inputs["Normal"])
        self.check_alpha(inputs["Alpha"])
        self.part_from_color(inputs["Base Color"], inputs["Alpha"])
        if self.bsdf.distribution != "GGX":
            self.add("its distribution Multiscatter GGX is read as GGX", "choose GGX")

    def check_diffuse(self):
        inputs = self.bsdf.inputs
        self.material.blend_method = "OPAQUE"
        if nodes.source(inputs["Roughness"]) or inputs["Roughness"].default_value != 0:
            self.add("Roughness of the Diffuse BSDF", "set it to 0")
        self.check_input(inputs["Color"], {"MIX"})
        self.check_normal(inputs["Normal"])

    def check_emission(self, color, strength):
        if nodes.source(strength):
            self.add("Emission Strength of the Principled BSDF is connected", "set it to one value")
        glows = nodes.source(strength) or strength.default_value != 0
        if glows and (nodes.source(color) or max(color.default_value[:3]) > 0):
            self.add("it glows: what finds it by chance is lit by it", "put lights into the world's image")
            self.check_input(color, {"MIX"})

    def check_input(self, socket, helpers):
        """A constant, an image, or an image times a constant."""
        given = nodes.source(socket)
        what, is_color = f"{socket.name} of {self.bsdf.name}", socket.type == "RGBA"
        self.check_constants(socket, what)
        if given is None or given.node.type in ("RGB", "VALUE"):
            return
        if given.node.type in helpers and not given.node.mute:
            if given.node.type == "MIX" and not is_product(given.node):
                self.add(f'node "{given.node.name}"')
                return
            if given.node.type == "MATH" and given.node.operation != "MULTIPLY":
                self.add(f'node "{given.node.name}"')
                return
            behind = [nodes.source(s) for s in given.node.inputs if s.enabled]
            behind = [s for s in behind if s is not None and s.node.type not in ("RGB", "VALUE")]
            if given.node.type in ("SEPARATE_COLOR", "SEPRGB"):
                wanted = CHANNELS[socket.name]
                if given.name[0] != wanted[0]:
                    self.add(f"{what} takes {given.name} of an image", f"put it into the image's {wanted.lower()}")
            for behind_socket in behind:
                self.check_image(behind_socket, what, is_color, 1)
            if len(behind) > 1:
                self.add(f'node "{given.node.name}" of two images')
            return
        self.check_image(given, what, is_color)

    def check_constants(self, socket, what):
        """Constants of glTF are from 0 to 1. Cycles cuts numbers, too, but neither colours nor what an image is multiplied by."""
        given = nodes.source(socket)
        is_cut_by_both = socket.type == "VALUE" and (given is None or given.node.type == "VALUE")
        for holder in nodes.constants(socket) if socket.name != "Emission" else ():
            is_color = holder.type == "RGBA"
            value = list(holder.default_value)[:3] if is_color else [holder.default_value]
            cut = [min(max(v, 0), 1) for v in value]
            if value == cut:
                continue
            if not is_cut_by_both:
                self.add(f"{what}, which is above 1 or below 0, is cut", "keep it from 0 to 1")
            holder.default_value = (*cut, 1) if is_color else cut[0]

    def check_image(self, given, what, is_color, depth=0):
        """The output of an Image Texture with coordinates of UVs."""
        node = given.node
        if depth == 1 and node.type in ("SEPARATE_COLOR", "SEPRGB"):
            behind = nodes.source(node.inputs[0])
            if behind is not None:
                self.check_image(behind, what, is_color, 2)
            return
        if node.type != "TEX_IMAGE" or node.mute:
            self.add(f'node "{node.name}" ({what})')
            return
        if node.image is None:
            self.add(f'node "{node.name}" has no image', "choose one")
            return
        image, where = node.image, f'image "{node.image.name}"'
        if image.source in ("SEQUENCE", "MOVIE"):
            self.add(f"{where} changes, but stays as it is first", "use one image")
            image = node.image = image.copy()  # the world may show it, too
            image.source = "FILE"
        if not images.is_readable(image):
            self.add(f"{where} cannot be read", "find the file (File > External Data)")
            return
        self.check_space(image, given, where, what, is_color)
        if image.is_float or image.file_format not in FILES and image.depth > 32:
            self.add(f"{where} becomes a PNG of 8 bits", "use an image of 8 bits")
        if node.projection != "FLAT":
            self.add(f'node "{node.name}": projection {node.projection.lower()}', "unwrap the mesh, use UVs")
        if node.interpolation in ("Cubic", "Smart"):
            self.add(f'node "{node.name}": interpolation {node.interpolation}, read as Linear', "choose Linear")
        if node.extension == "CLIP":
            self.add(f'node "{node.name}": extension Clip', "use Repeat or Extend")
        if not nodes.is_identity(node.texture_mapping):
            self.add(f'node "{node.name}": its own mapping', "use a Mapping node")
        self.check_coordinates(node)
        is_alpha_used = nodes.is_taken(self.bsdf.inputs, node.outputs["Alpha"])
        if is_alpha_used and image.packed_file and image.alpha_mode == "PREMUL":
            self.add(f"{where}: alpha mode Premultiplied, read as Straight", "save it as straight, choose Straight")
        node.image = images.as_shown(image, is_alpha_used)

    def check_space(self, image, given, where, what, is_color):
        """glTF says by an image's place whether it holds colours in sRGB or plain numbers. Floats: they are reported anyway."""
        space = image.colorspace_settings.name
        if given.name == "Alpha":
            if is_color:
                self.add(f"{what} takes Alpha of {where}", BAKE)
        elif not image.is_float and space not in ({"sRGB"} if is_color else images.LINEAR):
            read = "sRGB" if is_color else "Non-Color"
            self.add(f"{where} of colour space {space} ({what}): it is read as {read}", f"convert the image, and set {read}")

    def check_pair(self, *sockets):
        """Two inputs that glTF has in one image."""
        textures = [next((n for n in nodes.feeding(socket) if n.type == "TEX_IMAGE"), None) for socket in sockets]
        if None not in textures and coordinates(textures[0]) != coordinates(textures[1]):
            self.add(f"{sockets[1].name} has other coordinates than {sockets[0].name}: glTF has one image for both",
                     "give both the same UV map and Mapping")

    def check_coordinates(self, node):
        vector = nodes.source(node.inputs["Vector"])
        if vector is not None and vector.node.type == "MAPPING" and not vector.node.mute:
            mapping = vector.node
            connected = [s.name for s in mapping.inputs if s.name != "Vector" and nodes.source(s)]
            turned = mapping.inputs["Rotation"].default_value
            if connected or turned[0] or turned[1] or not becomes_point(mapping):
                self.add(f'node "{mapping.name}"', "let it move, scale, and turn about z only, by constants, in this order of Point")
            vector = nodes.source(mapping.inputs["Vector"])
        if vector is None or vector.node.type == "UVMAP" or (vector.node.type, vector.name) == ("TEX_COORD", "UV"):
            return
        self.add(f'node "{vector.node.name}" ({vector.name}) as coordinates', "unwrap the mesh, use UVs")

    def check_normal(self, socket):
        given = nodes.source(socket)
        if given is None:
            return
        node = given.node
        if node.type != "NORMAL_MAP" or node.mute:
            self.add(f'node "{node.name}" on the normal', "bake a normal map")
            return
        if node.space != "TANGENT" or nodes.source(node.inputs["Strength"]):
            self.add(f'node "{node.name}"', "use a normal map in tangent space with a constant strength")
        color = nodes.source(node.inputs["Color"])
        if color is not None:
            self.check_image(color, "normal map", is_color=False)

    def check_alpha(self, socket):
        """Cycles shows alpha whatever the blend mode."""
        is_opaque = nodes.source(socket) is None and socket.default_value == 1
        self.material.blend_method = "OPAQUE" if is_opaque else "BLEND"
        if not is_opaque:
            self.check_input(socket, {"MATH"})

    def part_from_color(self, color, alpha):
        """Where alpha is that of an image and the colour a constant: glTF's exporter would show the image's colours."""
        given = next((n for n in nodes.feeding(alpha) if n.type == "TEX_IMAGE" and n.image), None)
        if given is None or not nodes.is_taken([alpha], given.outputs["Alpha"]) \
                or any(n.type == "TEX_IMAGE" for n in nodes.feeding(color)):
            return
        if nodes.is_taken(self.bsdf.inputs, given.outputs["Color"]):
            self.add(f'node "{given.name}", whose Alpha and Color go to different inputs', "use two images")
        given.image = images.alpha_alone(given.image)


def becomes_point(mapping):
    """Makes the type of a Mapping node Point, which glTF has; whether it does the same then."""
    kind, values = mapping.vector_type, {name: mapping.inputs[name].default_value for name in ("Rotation", "Scale")}
    if kind == "NORMAL":
        return False
    place = conventions.uv_mapping(kind, mapping.inputs["Location"].default_value[:2] if kind != "VECTOR" else (0, 0),
                                   values["Rotation"][2], values["Scale"][:2])
    if place is None:
        return False
    mapping.vector_type = "POINT"
    location, values["Rotation"][2], values["Scale"][:2] = place
    mapping.inputs["Location"].default_value[:2] = location
    return True


def is_product(mix):
    """Whether a Mix node multiplies, wholly."""
    factor = mix.inputs[0]
    return (mix.data_type == "RGBA" and mix.blend_type == "MULTIPLY" and not nodes.source(factor)
            and factor.default_value == 1)


def coordinates(texture):
    """What places an Image Texture: name of the UV map, values of the Mapping."""
    vector = nodes.source(texture.inputs["Vector"])
    placed = []
    if vector is not None and vector.node.type == "MAPPING" and not vector.node.mute:
        placed = [tuple(s.default_value) for s in vector.node.inputs if s.name != "Vector"]
        vector = nodes.source(vector.node.inputs["Vector"])
    return vector.node.uv_map if vector is not None and vector.node.type == "UVMAP" else "", placed


def drop_tiled(material, output, add):
    """Removes images of tiles, at which Blender's glTF exporter fails."""
    used = nodes.feeding(output.inputs["Surface"])
    for node in [n for n in material.node_tree.nodes if n.type == "TEX_IMAGE" and n.image and n.image.source == "TILED"]:
        if node in used:
            add(f'image "{node.image.name}" of tiles (UDIM): the material is without it',
                'give the job a material of this name with "name.<UDIM>.exr" as texture (docs/scenes.md, Textures)')
        material.node_tree.nodes.remove(node)


def replace_diffuse(material, diffuse):
    """A Principled BSDF without reflection in place of a Diffuse BSDF."""
    tree = material.node_tree
    principled = tree.nodes.new("ShaderNodeBsdfPrincipled")
    for name, value in (("Metallic", 0), ("Specular", 0), ("Roughness", 1)):
        principled.inputs[name].default_value = value
    principled.inputs["Base Color"].default_value = diffuse.inputs["Color"].default_value
    for name, wanted in (("Color", "Base Color"), ("Normal", "Normal")):
        given = nodes.source(diffuse.inputs[name])
        if given is not None:
            tree.links.new(given, principled.inputs[wanted])
    for link in list(diffuse.outputs["BSDF"].links):
        tree.links.new(principled.outputs["BSDF"], link.to_socket)


def used_materials(geometry):
    """Those of all shapes, by name; linked ones become local, so that they can be changed."""
    found = {m for mesh in geometry.meshes.values() if mesh for m in mesh.materials if m}
    return sorted((m.make_local() if m.library else m for m in found), key=lambda m: m.name)

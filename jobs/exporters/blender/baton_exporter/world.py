"""The world of a scene as the environment of a job; runs inside Blender.

What is carried over: Background, Environment Texture, Mapping, Texture Coordinate (Generated), a plain colour, and what the
camera sees instead: nothing (Ray Visibility), or another Background (a Mix Shader by Is Camera Ray)."""

from . import conventions, images, keys, nodes
from .background import BAKE, DARK, TOLERANCE, Background
from .camera import number, numbers

TURN_TOLERANCE_DEG = 2e-3


class World:
    """Finds the backgrounds of the world, then collects their values frame by frame."""

    def __init__(self, scene, report):
        self.scene, self.report = scene, report
        self.world = scene.world
        self.light, self.seen = None, None  # seen: by the camera, where it is another
        self.is_in_picture = not scene.render.film_transparent
        if self.world and self.world.use_nodes:
            self.find_backgrounds()
        self.light = self.light or Background(None, self.add)
        if self.world:
            self.check_rays()

    def add(self, what, remedy=BAKE):
        self.report.add(f'world "{self.world.name}"', what, remedy)

    def find_backgrounds(self):
        output = nodes.active_output(self.world.node_tree, "OUTPUT_WORLD")
        if output is None:
            return
        if nodes.source(output.inputs["Volume"]):
            self.add("its volume", "remove it")
        surface = nodes.source(output.inputs["Surface"])
        if surface is None:
            return
        if is_background(surface):
            self.light = Background(surface.node, self.add)
        elif is_camera_mix(surface.node):
            light, seen = map(nodes.source, surface.node.inputs[1:])
            self.light = Background(light and light.node, self.add)
            if self.is_in_picture:
                self.seen = Background(seen and seen.node, self.add)
        else:
            taken = next((node for node in nodes.feeding(output.inputs["Surface"]) if node.type == "BACKGROUND"), None)
            self.light = Background(taken, self.add)
            self.add(f'node "{surface.node.name}": only a Background is read, '
                     + (f'"{taken.name}" is taken' if taken else "so the world is dark"))

    def check_rays(self):
        """Ray Visibility of the world, which Cycles has."""
        rays = getattr(self.world, "cycles_visibility", None)
        if rays and not rays.camera and self.is_in_picture:
            self.seen = Background(None, self.add)
        for name in ("diffuse", "glossy"):
            if rays and not getattr(rays, name):
                self.add(f"it is hidden from {name} rays", "let all rays see it (Ray Visibility)")

    def take(self, depsgraph):
        """The values of one frame."""
        exposure = self.scene.cycles.film_exposure if hasattr(self.scene, "cycles") else 1.0
        world = self.world.evaluated_get(depsgraph) if self.world else None
        tree = world.node_tree if world else None
        self.light.take(tree, exposure, tuple(world.color) if world and not world.use_nodes else DARK)
        if self.seen:
            self.seen.take(tree, exposure, DARK)

    def job(self, folder, frames):
        """`environment` of the job; its images go to the folder."""
        light = self.light
        turned = next((b for b in (light, self.seen) if b and b.shows_texture()), None)
        if not light.shows_texture():
            environment = self.plain(folder, frames)
        else:
            environment = images.export(light.texture, light.users, folder, frames, self.add)
            environment.update(self.scale(frames))
        if self.seen:
            environment.update(self.camera_map(folder))
        rotation = self.rotation(turned.rotations, frames) if turned else {}
        if rotation:
            environment["rotation"] = rotation
        return environment

    def camera_map(self, folder):
        """`cameraMap`: what the camera sees in place of the light."""
        light, seen = self.light, self.seen
        if not seen.is_constant() or not turn_alike(light, seen):
            self.add(f'node "{seen.node.name}", which the camera alone sees: it sees '
                     + (f'the light of "{light.node.name}"' if light.node else "darkness"),
                     "give it one colour or image, of constant strength, mapped as that of the light")
            return {}
        if not seen.shows_texture():
            return {"cameraMap": images.write_plain(folder / "backdrop.exr", seen.light()[0])}
        images.check(seen.texture, self.add)
        name, scale = images.copy(seen.texture.image, folder, "backdrop", self.add), number(seen.scales[0])
        return {"cameraMap": name if scale == 1 else {"file": name, "scale": scale}}

    def plain(self, folder, frames):
        """A world of one colour."""
        light = self.light.light()
        if self.light.is_constant():
            return {"map": images.write_plain(folder / "sky.exr", light[0])}
        kept = keys.reduce_linear(frames, light, TOLERANCE * max(map(max, light)))
        return {"keys": [{"frame": frames[i], "map": images.write_plain(folder / f"sky.{frames[i]:04}.exr", light[i])}
                         for i in kept]}

    def scale(self, frames):
        scales = self.light.scales
        kept = keys.reduce_linear(frames, [[scale] for scale in scales], TOLERANCE * max(scales))
        if len(kept) == 1:
            return {} if scales[0] == 1 else {"scale": number(scales[0])}
        return {"scaleKeys": [{"frame": frames[i], "scale": number(scales[i])} for i in kept]}

    def rotation(self, rotations, frames):
        """About up where it can be said so; else one axis, at rest."""
        angles = [conventions.up_angle(rotation) for rotation in rotations]
        if None in angles:
            axis, degrees = conventions.axis_angle(rotations[0])
            if not keys.is_constant([sum(r, []) for r in rotations], 1e-6):
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


def is_background(socket):
    return socket is None or (socket.node.type == "BACKGROUND" and not socket.node.mute)


def is_camera_mix(node):
    """Whether a node shows the camera one Background, and all other rays another."""
    if node.type != "MIX_SHADER" or node.mute:
        return False
    factor, *mixed = map(nodes.source, node.inputs)
    return (factor is not None and (factor.node.type, factor.name) == ("LIGHT_PATH", "Is Camera Ray")
            and all(map(is_background, mixed)))


def turn_alike(light, seen):
    """Whether two backgrounds can share the job's rotation and filter."""
    if not (light.shows_texture() and seen.shows_texture()):
        return True
    nearest = [b.texture.interpolation == "Closest" for b in (light, seen)]
    pairs = zip(light.rotations, seen.rotations)
    return nearest[0] == nearest[1] and all(keys.is_constant([sum(a, []), sum(b, [])], TOLERANCE) for a, b in pairs)

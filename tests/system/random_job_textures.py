"""Images of the materials of random jobs."""


class Textures:
    """What random_job_draws.Draw draws of textures."""

    def texture_hands(self):
        """Textures of materials: only the ground's, since the meshes here have no texture coordinates."""
        hands = {}
        for key in ("colorTexture", "normalTexture", "emissionTexture", "metallicRoughnessTexture", "clearcoatTexture",
                    "clearcoatRoughnessTexture", "clearcoatNormalTexture"):
            at = f"scene.materials.*.{key}"
            hands.update({
                at: lambda key=key: self.texture(key) if self.on_ground and self.chance(0.6) else None,
                f"{at}.file": lambda: self.image, f"{at}.image": lambda: self.pick(None, -1),
                f"{at}.uv": lambda: self.pick(None, 0), f"{at}.offset": lambda: self.pick(None, [0.3, -7.0]),
                f"{at}.scale": lambda: self.pick(None, 3.5, [0.2, -40.0]),
                f"{at}.rotateDeg": lambda: self.pick(None, 33.0, -1e6), f"{at}.strength": lambda: self.pick(None, 0.4, 2.0)})
        return hands

    def tiles(self):
        """Four tiles of different sizes, and a ground that lies across their corners."""
        for number in (1001, 1002, 1011, 1012):
            self.files[f"tile.{number}.png"] = {"kind": "image", "width": self.pick(1, 3, 16), "height": self.pick(1, 2, 8)}
        return {"file": "tile.<UDIM>.png", "scale": 0.018, "offset": [1.0, 0.0],
                "filter": self.pick("linear", "nearest")}

    def texture(self, key):
        if self.chance(0.2):
            return self.tiles()
        definition = "normalTexture" if "ormalTexture" in key else "texture"
        form = self.schema.schema["definitions"][definition]["oneOf"][1]
        drawn = self.schema.object(form, f"scene.materials.*.{key}")
        return self.image if self.chance(0.2) else drawn

    def textured(self, node):
        """A material with images of its own."""
        self.image = "image" + self.pick(".png", ".tga")
        self.files[self.image] = {"kind": "image", "width": self.pick(1, 3, 16), "height": self.pick(1, 2, 8)}
        self.on_ground = True
        material = self.material(node)
        self.on_ground = False
        return material

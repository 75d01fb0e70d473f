"""Random cameras, and what moves."""

from random_job_rules import mend_view


class Motion:
    """Draws with the random numbers, the frames and the schema of the job that it is a part of."""

    def number_keys(self, name, low, high):
        return [{"frame": frame, name: round(self.rng.uniform(low, high), 3)} for frame in self.key_frames()]

    def key_frames(self):
        """Ascending frames, at times between those of the job or beyond them."""
        last = self.first_frame + self.step * self.count
        frames = {float(self.first_frame), round(self.rng.uniform(self.first_frame, last), 2), float(last)}
        return sorted(frames)[: self.pick(1, 2, 2, 3)]

    def object_keys(self):
        size = self.pick(0.05, 0.05, 1.0)
        node = self.schema.schema["definitions"]["objectKey"]
        keys = []
        for frame in self.key_frames():
            key = self.schema.object(node, "objectKey", share=0.1)
            key.update(frame=frame, translate=self.vector(size), rotateDeg=self.vector(200 * size))
            if key.get("quaternion") == [0, 0, 0, 0]:
                del key["quaternion"]
            key.pop("scale", None)
            if self.chance(0.2):
                key["scale"] = self.pick(1.1, [0.9, 1.0, 1.2], 0)
            keys.append(key)
        if self.chance(0.15):
            keys = [{"frame": key["frame"], "matrix": self.matrix()} for key in keys]
        return keys

    def matrix(self):
        """Sheared, sometimes mirrored, far from singular."""
        rows = [[1.1, 0.2, 0.0], [0.0, 0.9, -0.3], [0.1, 0.0, self.pick(1.0, -1.2)]]
        return [n for row in rows for n in [*row, round(self.rng.uniform(-0.5, 0.5), 3)]]

    def camera(self):
        """Mostly outside; inside a mesh, below the ground, far away, with the sky alone in view; still or moving."""
        camera = {"position": [0, 1.2, 4.5], "lookAt": [0, 0.3, 0], "verticalFovDeg": self.pick(30, 40, 60)}
        if not self.plain and self.chance(0.6):
            camera = {"position": self.pick(self.vector(3), self.vector(0.2), [0.5, -2, 3], [0, 2, 400], [0, 1, 4.5]),
                      "lookAt": self.pick([0, 0.3, 0], self.vector(0.5), [0, 0.3, 0], [0.1, 90, 2]),
                      "verticalFovDeg": self.pick(5, 30, 40, 90, 170, 0.01)}
        position, look_at = camera["position"], camera["lookAt"]
        if self.chance(0.2):
            camera["up"] = self.pick([0, 0, 1], [0.3, 1, 0.1], [0, -1, 0])
        if self.chance(0.15):
            camera |= {"projection": "orthographic", "orthographicHeight": self.pick(0.3, 2, 5)}
        if self.chance(0.15):
            camera |= {"shift": self.pick([0.2, 0], [-0.5, 0.3]), "aperture": self.pick(0, 0.05, 1)}
            camera["focusDistance"] = self.pick(0, 0.5, 4)
        if self.chance(0.3):
            size = self.pick(0.05, 0.05, 0.5, 3)
            camera["keys"] = []
            for frame in self.key_frames():
                moved = [round(p + self.rng.uniform(-size, size), 3) for p in position]
                camera["keys"].append({"frame": frame, "position": moved, "lookAt": look_at})
                if "up" in camera:
                    camera["keys"][-1]["up"] = camera["up"]
                if self.chance(0.2):
                    camera["keys"][-1]["verticalFovDeg"] = self.pick(20, 60)
        elif self.chance(0.02):
            own = self.pick({}, {}, {"verticalFovDeg": 60}, {"orthographicHeight": 3})
            lens = {key: camera[key] for key in ("shift", "aperture", "focusDistance") if key in camera}
            return {"gltf": self.gltf("eye"), **lens, **own}
        for view in [camera, *camera.get("keys", [])]:
            mend_view(view, self.rng)
        return camera

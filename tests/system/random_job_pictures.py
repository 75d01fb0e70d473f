"""Random pictures of jobs: maps that light, one that the camera sees, plates. Standard library only."""


class Pictures:
    """A part of Draw (random_job_draws.py)."""

    def maps(self, job):
        """One map, keys or numbered maps, all of one size where they may be mixed."""
        form = self.pick("map", "map", "keys", "keys", "frames")
        width, height = self.pick((1, 1), (2, 1), (3, 7), (4, 2), (16, 8), (32, 16), (64, 32), (33, 17))
        if self.chance(0.01):
            width, height = 2048, 1024
            self.shorten(job, 2)
        ending = self.pick(".hdr", ".exr")

        def add(name):
            kinds = ["sky", "lamp", "lamp", "sun", "dots", "flat", "halves", "black"] + ["wild"] * (ending == ".exr")
            self.files[name] = {"kind": self.rng.choice(kinds), "width": width, "height": height,
                                "seed": self.rng.randrange(1000), "count": self.pick(1, 1, 3, 20),
                                "level": self.pick(1.0, 1.0, 1.0, 1e-3, 100.0)}
            if self.plain and self.chance(0.8):
                self.files[name].update(kind="lamp", level=1.0)
            return name

        environment = job["environment"]
        if form == "map":
            environment["map"] = add("map" + ending)
        elif form == "frames":
            environment["frames"], numbers = self.numbered("map.####" + ending)
            for number in numbers:
                add(f"map.{number:04}{ending}")
        else:
            frames = self.key_frames()
            environment["keys"] = [{"frame": f, "map": add(f"map{i}{ending}")} for i, f in enumerate(frames)]

    def numbered(self, files):
        """What a key of numbered files may say, and the numbers that there must be."""
        if self.chance(0.5):
            return files, self.frame_numbers()
        first = self.rng.randrange(20)
        last = first + self.rng.randrange(4)
        said = {"files": files, "first": first, "last": last, "speed": self.pick(1.0, 0.5, -0.3, 2.0, 0.0),
                "offset": self.rng.randrange(-5, 5), "beyond": self.pick("hold", "loop")}
        return said, range(first, last + 1)

    def plates(self, job):
        """Of the picture's size, or of its shape and larger."""
        if job["output"].get("background") != "plate":
            return
        ending, times = self.pick(".png", ".tga", ".exr", ".hdr"), self.pick(1, 1, 2, 3)
        files, numbers = ("seen" + ending, [None]) if self.chance(0.5) else self.numbered("seen.####" + ending)
        job["output"]["plate"] = files
        for number in numbers:
            name = "seen" + ending if number is None else f"seen.{number:04}{ending}"
            kind = "dots" if ending in (".exr", ".hdr") else "image"
            self.files[name] = {"kind": kind, "width": times * job["image"]["width"], "seed": 1 + (number or 0),
                                "height": times * job["image"]["height"], "count": 20, "level": 2.0}

    def camera_map(self):
        self.files["seen.exr"] = {"kind": "dots", "width": 8, "height": 4, "seed": 1, "count": 3, "level": 2.0}
        form = self.schema.schema["properties"]["environment"]["properties"]["cameraMap"]["oneOf"][1]
        return self.pick("seen.exr", self.schema.object(form, "environment.cameraMap"))

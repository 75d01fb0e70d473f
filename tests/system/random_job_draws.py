"""Random legal jobs: the schema says what a key may be, this file what is meaningful (files, geometry, frames, split).
Standard library only."""

import json
import random

from random_job_means import tame
from random_job_motion import Motion
from random_job_pictures import Pictures
from random_job_rules import mend, spoil, work_of
from random_job_schema import SchemaDraw
from random_job_textures import Textures

# Particles and candidates: every remainder modulo 8, one, powers of two and the most.
NUM_PARTICLES = [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 12, 13, 14, 16, 16, 18, 20, 23, 24, 31, 32, 34, 40, 57, 63, 64]
NUM_CANDIDATES = [1, 2, 7, 8, 9, 13, 16, 24, 25, 27, 33, 50, 64, 70, 100, 128, 130, 257, 400, 1000]
FRESH_METHODS = {"environment", "brdf", "mis", "bidirectional"}
# What no draw may cost, in about 50 ns: surfaces, candidates and moves of all pixels and frames.
MOST_WORK = 5e6


class Draw(Motion, Pictures, Textures):
    """One random case: {"job", "files", "first", "second"}, as random_job_judge.py takes it."""

    def __init__(self, schema, rng, without=None):
        """without: the one of random_job_rules.RULES that the job need not obey."""
        self.rng, self.without = rng, without
        self.files = {}
        self.first_frame, self.step, self.count = 1, 1, 1
        self.on_ground, self.image = False, None
        # Every other job shows spheres on the ground under a lamp, as users' jobs do: penumbras are where much happens.
        self.plain = rng.random() < 0.5
        self.schema = SchemaDraw(schema, rng, self.hand())

    def chance(self, probability):
        return self.rng.random() < probability

    def pick(self, *values):
        return self.rng.choice(values)

    def vector(self, size):
        return [round(self.rng.uniform(-size, size), 3) for _ in range(3)]

    # ---- the whole ------------------------------------------------------------------------------------------

    def case(self):
        """The job, its files, and how both renderings are split."""
        node = self.schema.schema
        keys = node["properties"]
        job = {"name": self.name()}
        job["frames"] = self.frames()
        job["image"] = self.schema.value(keys["image"], "image")
        job["scene"] = self.scene()
        job["camera"] = self.camera()
        if "gltf" in job["scene"] and self.chance(0.4):
            job["camera"] = {"node": self.pick("eye", "*"), **self.pick({}, {}, {"verticalFovDeg": 60}, {"orthographicHeight": 3})}
        for key, inner in keys.items():
            if key in job:
                continue
            always = key in node["required"] or key in ("sampling", "output")
            if always or self.chance(0.5):
                value = self.schema.value(inner, key)
                if value is not None:
                    job[key] = value
        self.maps(job)
        self.by_material(job)
        mend(job, self.rng, self.without)
        self.cheapen(job)
        self.plates(job)
        self.part_of_image(job["image"])
        if '"table.binary"' not in json.dumps(job["scene"]):
            self.files.pop("table.binary", None)
        if self.chance(0.04):
            self.files["scene.json"] = {"kind": "json", "value": job["scene"]}
            job["scene"] = "scene.json"
        first = self.split(job)
        second = {**self.split(job), "compression": self.pick("none", "none", "zip", "rle")}
        if self.chance(0.35):
            second["interruption"] = self.interruption(job)
        if self.chance(0.3):
            second["memory"] = self.pick(1, 2, 4, 16)  # MiB: little or nothing is kept
        return {"job": job, "files": self.files, "first": first, "second": second}

    def hand(self):
        """What the schema cannot say, by path."""
        def nothing():
            return None
        return {
            # Given elsewhere.
            "$schema": lambda: self.pick(None, None, "job.schema.json"), "name": self.name, "frames": self.frames, "scene": nothing, "camera": nothing,
            "environment.map": nothing, "environment.frames": nothing, "environment.keys": nothing,
            "environment.cameraMap": lambda: self.camera_map() if self.chance(0.2) else None,
            "environment.cameraMap.file": lambda: "seen.exr",
            "sampling.byMaterial": nothing, "scene.meshes": nothing, "scene.materials": nothing,
            "scene.objects": nothing, "scene.ground": nothing, "scene.gltf": nothing, "scene.files": nothing,
            "camera.node": nothing, "scene.gltf.file": lambda: "set.glb",
            # Texts and sizes.
            "metadata.*": lambda: self.pick("x", "two words", "a \u00e4 \u4e2d \" \\ text", "long " * 200),
            "image.width": lambda: self.side(), "image.height": lambda: self.side(),
            "image.tileSize": lambda: self.tile_size(), "image.region": nothing, "image.scale": nothing,
            "image.overscan": lambda: self.overscan() if self.chance(0.2) else None,
            "output.directory": nothing, "output.plate": nothing, "output.look": nothing,
            "output.background": lambda: self.pick("environment", "transparent", "transparent", "plate"),
            "output.pattern": lambda: self.pick(None, "f.#.exr", "a b ######.exr", "\u00e4####x.exr"),
            # 16 bits hide what differs in the last ones.
            "output.pixelType": lambda: "half" if self.chance(0.15) else "float",
            # Counts that cost time, and the ways to fail that are meant to fail.
            "sampling.method": self.method,
            "sampling.numParticles": lambda: self.rng.choice(NUM_PARTICLES),
            "sampling.numCandidates": lambda: self.rng.choice(NUM_CANDIDATES),
            "sampling.refreshCandidates": lambda: self.pick(None, 64, 65, 300),
            "sampling.referenceSamples": lambda: self.pick(2, 3, 8, 17),
            "sampling.byMaterial.*.numParticles": lambda: self.rng.choice([None, *NUM_PARTICLES]),
            "sampling.byMaterial.*.numCandidates": lambda: self.rng.choice([None, *NUM_CANDIDATES]),
            "sampling.targetError": lambda: self.pick(None, 0.3), "sampling.timeBudget": lambda: 1.0,
            "quality.rounds": lambda: self.pick(1, 2, 3, 4, 5, 9), "state.preroll": lambda: self.pick(None, 0, 1, 2, 5),
            "quality.adaptiveThreshold": lambda: self.pick(None, None, 1e-3, 0.03, 0.1, 0.5),
            "quality.sweeps": lambda: self.pick(None, 1, 2, 3),
            # These add sweeps by noise and time: tests/system/test_refine.py.
            "quality.noiseThreshold": nothing, "quality.timeLimit": nothing, "quality.maxRounds": nothing,
            "visibility.correlated": lambda: self.chance(0.9),
            "visibility.mask": lambda: self.rng.choice(self.enum("visibility", "mask") + ["same-samples"]),
            "image.maxSites": lambda: self.pick(None, None, None, 4),
            "image.sites": lambda: self.rng.choice(self.enum("image", "sites") + [4]),
            "maxRetriesPerTask": nothing, "maxSecondsPerTask": nothing, "maxFailuresPerWorker": nothing,
            "light.bounces": lambda: self.pick(0, 1, 1, 2, 4),
            # Geometry.
            "scene.materials.*.file": self.table,
            "scene.materials.*.clearcoat": lambda: self.pick(None, None, 0.0, 0.4, 1.0),
            "scene.materials.*.clearcoatRoughness": lambda: self.pick(None, 0.02, 0.3, 1.0),
            "scene.materials.*.emission": lambda: self.pick(None, None, [0.2, 0.5, 3.0]),
            **self.texture_hands(),
            "scene.objects[].translate": lambda: self.vector(1.3),
            "scene.objects[].rotateDeg": lambda: self.pick(None, self.vector(180)),
            "scene.objects[].scale": lambda: self.pick(None, 0.3, 1.7, [0.2, 1, 1.5], 1e-3, 30),
            "scene.objects[].matrix": lambda: self.matrix() if self.chance(0.1) else None, "objectKey.matrix": nothing,
            "scene.meshes.*.mesh": nothing, "scene.meshes.*.primitive": nothing,
            "scene.meshes.*.shapedBy": nothing, "shapedBy.node": lambda: 8, "shapedBy.animation.startFrame": lambda: self.first_frame,
            "shapedBy.animation.fps": lambda: self.pick(4, 24), "shapedBy.places[].node": lambda: self.pick(9, 10, 11, 0),
            "shapedBy.animation.name": lambda: self.pick(None, None, "0"), "scene.gltf.animation": lambda: self.pick(None, None, None, "0"),
            "shapedBy.places[].matrix": self.matrix,
            "scene.objects[].fitHeight": lambda: self.pick(None, None, None, 1.2),
            "scene.objects[].name": lambda: self.pick(None, None, None, "a name", "ground"),
            "scene.objects[].catcher": lambda: self.pick(None, None, None, False, True),
            "scene.objects[].keys": lambda: self.object_keys() if self.chance(0.2) else None,
            "scene.objects[].gltf": lambda: self.gltf("hip") if self.chance(0.03) else None,
            "scene.ground.height": lambda: self.pick(None, -1.0, 0.3),
            "scene.ground.size": lambda: self.pick(None, 2.0, 50.0),
            "environment.scale": lambda: self.pick(None, None, 0.1, 7.0, 1e-9, 1e9, 0),
            "environment.scaleKeys": lambda: self.number_keys("scale", 0.1, 4) if self.chance(0.2) else None,
            "environment.rotation.keys": lambda: self.number_keys("deg", -90, 90) if self.chance(0.2) else None,
            "environment.maxWidth": lambda: self.pick(None, None, 0, 1, 3, 8, 16),
            "environment.rotation.axis": lambda: self.pick(None, [1, 2, 3], [0, 0, -1], [1e-9, 0, 0]),
            "environment.rotation.degPerFrame": lambda: self.pick(0.0, 0.1, 1.5, 20.0, -90.0, 1e6),
        }

    def enum(self, section, key):
        """All values of a key."""
        return self.schema.schema["properties"][section]["properties"][key]["enum"]

    def name(self):
        return self.pick("any", "any", "a name", "\u00e4\u4e2d", "x" * 100)

    def side(self):
        return self.pick(20, 24, 33, 40) if self.plain else self.pick(1, 1, 2, 5, 8, 9, 16, 17, 24, 33, 40)

    def tile_size(self):
        return self.pick(8, 8, 9, 13, 16, 19, 64, 32768)

    def method(self):
        methods = self.enum("sampling", "method")
        plain = [method for method in methods if method != "auto"]
        # The pilots of `auto` are up to 500 renderings.
        return "auto" if "auto" in methods and self.chance(0.001) else self.rng.choice(plain + ["sequential", "pool"])

    def frames(self):
        self.first_frame = self.pick(0, 1, 1, 7, 1001)
        self.step = self.pick(1, 1, 1, 2, 5)
        self.count = self.pick(1, 2, 2, 3, 4, 5, 9)
        first, last = self.first_frame, self.first_frame + self.step * (self.count - 1)
        if self.count == 1:
            return str(first)
        if self.step > 1:
            return f"{first}-{last}x{self.step}"
        return f"{first},{first + 1}-{last}" if self.count > 2 and self.chance(0.2) else f"{first}-{last}"

    def frame_numbers(self):
        return [self.first_frame + self.step * i for i in range(self.count)]

    # ---- geometry -------------------------------------------------------------------------------------------

    def scene(self):
        node = self.schema.resolve(self.schema.schema["definitions"]["scene"])
        keys = node["properties"]
        scene = self.schema.object(node, "scene")
        names = [f"m{i}" for i in range(self.pick(1, 2, 3))]
        scene["materials"] = {name: self.material(keys["materials"]["additionalProperties"]) for name in names}
        if self.plain or self.chance(0.75):
            ground = self.schema.resolve(keys["ground"])
            self.schema.hand["scene.ground.material"] = lambda: self.rng.choice(names)
            scene["ground"] = self.schema.object(ground, "scene.ground")
            if self.chance(0.3):
                scene["materials"]["tiles"] = self.textured(keys["materials"]["additionalProperties"])
                scene["ground"]["material"] = "tiles"
        for material in scene["materials"].values():
            if material.get("kd", 0.5) + material.get("ks", 0.5) > 1:
                material["kd"], material["ks"] = 0.5, 0.4
        if self.chance(0.06):
            scene["gltf"] = self.gltf_set(node, names)
        scene["meshes"] = {}
        count = 2 if self.plain else self.pick(0, 1, 1, 2, 2, 3)
        scene["objects"] = [self.object(scene, keys, names, i) for i in range(count)]
        return scene

    def gltf_set(self, node, names):
        """The set of the examples: instances, some of them mirrored, three kinds of curves."""
        alive = self.chance(0.6)
        self.files["set.glb"] = {"kind": "set", "pillars": self.pick(1, 4), "textured": self.chance(0.5), "alive": alive}
        form = self.schema.resolve(node["properties"]["gltf"])["oneOf"][1]
        self.schema.hand["scene.gltf.nodes"] = lambda: None
        gltf = self.schema.object(form, "scene.gltf")
        gltf.update(file="set.glb", fps=self.pick(4, 24), startFrame=max(self.first_frame - 1, 0))
        override = self.schema.schema["definitions"]["gltfNode"]
        at = "scene.gltf.nodes.*"
        self.schema.hand.update({
            f"{at}.material": lambda: self.rng.choice([None, *names]),
            f"{at}.catcher": lambda: self.pick(None, None, True),
            f"{at}.place.translate": lambda: self.vector(1.3),
            f"{at}.place.rotateDeg": lambda: self.pick(None, self.vector(180)),
            f"{at}.place.scale": lambda: self.pick(None, 0.3, [0.2, 1, 1.5])})
        there = ("ring", "lift", "ball", "pillar.000") + ("reed.0", "reed.1", "drop") * alive
        nodes = [name for name in there if self.chance(0.4)]
        gltf["nodes"] = {name: self.schema.object(override, at) for name in nodes}
        return self.pick("set.glb", gltf, gltf)

    def material(self, node):
        """Seldom a measured one: each process reads its 35 MB."""
        material = self.schema.value(node, "scene.materials.*")
        while "file" in material and self.chance(0.9):
            material = self.schema.value(node, "scene.materials.*")
        if "clearcoat" not in material:
            material.pop("clearcoatTexture", None)
        return material

    def object(self, scene, keys, names, number):
        mesh = f"mesh{number}"
        path = mesh + self.pick(".off", ".obj", ".ply")
        self.files[path] = self.pick(
            {"kind": "sphere", "rings": self.pick(2, 5, 9), "segments": self.pick(3, 6, 13)},
            {"kind": "sphere", "rings": 8, "segments": 12},
            {"kind": "card"}, {"kind": "shards", "count": self.pick(1, 6, 40), "seed": self.rng.randrange(1000)})
        if self.plain:
            self.files[path] = {"kind": "sphere", "rings": 8, "segments": 12}
        smooth = self.pick(None, True, False)
        scene["meshes"][mesh] = path if smooth is None else {"path": path, "smoothNormals": smooth}
        if self.chance(0.08):
            del self.files[path]
            scene["meshes"][mesh] = self.creature(keys["meshes"]["additionalProperties"])
        self.schema.hand["scene.objects[].mesh"] = lambda: mesh
        self.schema.hand["scene.objects[].material"] = lambda: self.rng.choice(names)
        item = self.schema.value(keys["objects"]["items"], "scene.objects[]")
        if self.plain:
            item.pop("placeOnGround", None)
            item.update(translate=[0.9 - 1.8 * number, 0.7, 0.3 * number], scale=0.7)
        return item

    def creature(self, node):
        """A reed on three bones, or a drop, of the set of the examples."""
        self.files["alive.glb"] = {"kind": "set", "pillars": 1, "alive": True}
        form = self.schema.resolve(self.schema.resolve(node)["oneOf"][1]["properties"]["shapedBy"])
        mesh, shown_by = self.pick((4, 8), (4, 8), (5, 12))
        return {"path": "alive.glb", "mesh": mesh, "shapedBy": self.schema.object(form, "shapedBy", share=0.7) | {"node": shown_by}}

    def gltf(self, node):
        self.files["walk.gltf"] = {"kind": "walk", "distance": self.pick(3.0, 5.0)}
        more = {"animation": "0"} if self.chance(0.3) else {}
        return {"file": "walk.gltf", "node": node, "fps": self.pick(4, 24), "startFrame": self.first_frame, **more}

    def table(self):
        # Overwritten when there is a second one; unused when the material is drawn again.
        self.files["table.binary"] = {"kind": "merl", "lobe": self.pick(3, 60), "base": self.pick(0.05, 0.4)}
        return "table.binary"

    def by_material(self, job):
        """Settings of single materials, where the method allows them; names are known only now."""
        sampling = job["sampling"]
        if sampling["method"] not in FRESH_METHODS or not self.chance(0.3):
            return
        node = self.schema.schema["properties"]["sampling"]["properties"]["byMaterial"]["additionalProperties"]
        materials = sorted(job["scene"]["materials"])
        chosen = [name for name in materials if self.chance(0.7)]
        sampling["byMaterial"] = {name: self.schema.value(node, "sampling.byMaterial.*") for name in chosen}
        if sampling["byMaterial"] and self.chance(0.9):
            job.pop("visibility", None)

    # ---- cost and split -------------------------------------------------------------------------------------

    def shorten(self, job, count):
        """At most so many frames."""
        self.count = min(self.count, count)
        last = self.frame_numbers()[-1]
        step = f"x{self.step}" if self.step > 1 else ""
        job["frames"] = str(self.first_frame) if self.count == 1 else f"{self.first_frame}-{last}{step}"

    def cheapen(self, job):
        """Fewer frames, then fewer pixels, until the job is no dearer than MOST_WORK."""
        while work_of(job, self.count) > MOST_WORK and self.count > 2:
            self.shorten(job, self.count - 1)
        while work_of(job, self.count) > MOST_WORK:
            side = max("width", "height", key=lambda key: job["image"].get(key, 1))
            if job["image"][side] == 1:
                return
            job["image"][side] = (job["image"][side] + 1) // 2

    def overscan(self):
        """Now and then as much as the picture itself."""
        return self.pick(0, 1, 9, [self.pick(0, 0, 2, 17) for _ in range(4)])

    def part_of_image(self, image):
        """Sometimes a region and a smaller scale."""
        if self.chance(0.15):
            x, y = (self.rng.randrange(image[side]) for side in ("width", "height"))
            image["region"] = [x, y, self.rng.randint(1, image["width"] - x), self.rng.randint(1, image["height"] - y)]
        if self.chance(0.1):
            image["scale"] = self.pick(1.0, 0.5, 0.37, 0.01)

    def split(self, job):
        """What never changes the picture."""
        split = {"tileSize": self.tile_size(), "workers": self.pick(1, 1, 2), "threads": self.pick(1, 2),
                 "checkpointEvery": self.pick(1, 2, 3, 12, 1000)}
        if job["image"]["width"] * job["image"]["height"] > 600 and split["tileSize"] < 13:
            split["tileSize"] = 16
        return split

    def interruption(self, job):
        """Somebody dies after some seconds; then all is started again, maybe with other tiles."""
        return {"who": self.pick("render", "render", "worker", "worker", "coordinator", "all"),
                "after": round(self.rng.uniform(0.02, 0.4), 3), "tileSize": self.pick(None, None, self.tile_size())}


def draw_case(schema, seed, number):
    """Case `number` of a seed; the same for ever as long as schema and this file stay."""
    rng = random.Random(f"{seed}/{number}")
    case = Draw(schema, rng).case()
    if rng.random() < 0.03:
        case = {**spoil(case, rng), "spoiled": True}
    elif rng.random() < 0.03:
        case = tame(case, rng)
    return case

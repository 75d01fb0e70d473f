"""The test of the random-job test: planted faults are found, the generator draws every key, the shrinker keeps what
matters. Needs no programs."""

import json
import math
import random
import struct
import tempfile
import zlib
from array import array
from pathlib import Path

from exr_frames import Frame, read_frame, unpack_runs
from random_job_draws import NUM_CANDIDATES, NUM_PARTICLES, Draw, draw_case
from assets import rgbe
from random_job_files import write_file
from random_job_judge import FAULT_LINE, Wrong, compare, compare_prediction, judge_frames
from random_job_means import FIRST_LOOK, SECOND_LOOK, significant
from random_job_rules import spoil
from random_job_schema import key_paths
from random_job_shrink import shrink

# Keys that are meant to stay away: what makes a job fail by itself, what is set when it is rendered, and those of
# `auto`, which is rare; what Baton writes itself when it takes a glTF file apart.
NEVER_DRAWN = {"quality.maxRounds", "quality.noiseThreshold", "quality.timeLimit", "scene.files", "scene.files[].path", "scene.meshes.*.mesh", "scene.meshes.*.primitive",
               "maxRetriesPerTask", "maxSecondsPerTask", "maxFailuresPerWorker", "output.directory", "output.look",
               "sampling.targetError", "sampling.timeBudget"}
CASES = 1500


def load_schema(source):
    return json.loads((Path(source) / "jobs/schema/job.schema.json").read_text(encoding="utf-8"))


# ---- the generator ------------------------------------------------------------------------------------------


def every_key_is_drawn(schema):
    """A key that is added to the schema as a text, which nobody can draw, must get a draw of its own."""
    seen, methods, not_drawn = set(), set(), set()
    for number in range(CASES):
        draw = Draw(schema, random.Random(number))
        case = draw.case()
        not_drawn |= draw.schema.not_drawn
        job = case["job"]
        if isinstance(job["scene"], str):
            job["scene"] = case["files"][job["scene"]]["value"]
        seen |= set(paths_of(job))
        methods.add(job["sampling"]["method"])
    missing = key_paths(schema) - seen - NEVER_DRAWN
    assert not missing, f"keys of the schema that no job of {CASES} has: {sorted(missing)}"
    assert not not_drawn, f"texts that need a draw of their own in random_job_draws.py: {sorted(not_drawn)}"
    assert methods >= set(schema["properties"]["sampling"]["properties"]["method"]["enum"]) - {"auto"}, methods
    for numbers in (NUM_PARTICLES, NUM_CANDIDATES):
        assert {n % 8 for n in numbers} == set(range(8)), numbers


def paths_of(value, path=""):
    """Paths as key_paths has them; names that are free are "*"."""
    if isinstance(value, list):
        for item in value:
            yield from paths_of(item, f"{path}[]")
    elif isinstance(value, dict):
        for key, inner in value.items():
            named = path in ("metadata", "scene.materials", "scene.meshes", "scene.gltf.nodes", "sampling.byMaterial")
            at = f"{path}.*" if named else f"{path}.{key}" if path else key
            yield at
            yield from paths_of(inner, at)


def new_keys_take_part(schema):
    """What is added to the schema is drawn without a change here."""
    schema = json.loads(json.dumps(schema))
    schema["properties"]["sampling"]["properties"]["newNumber"] = {"type": "integer", "minimum": 2, "maximum": 9}
    lamp = {"type": "object", "required": ["power"], "properties": {
        "power": {"type": "number", "exclusiveMinimum": 0, "maximum": 5}, "kind": {"enum": ["point", "spot"]}}}
    schema["definitions"]["scene"]["properties"]["lamps"] = {"type": "array", "items": lamp, "maxItems": 4}
    jobs = [Draw(schema, random.Random(n)).case()["job"] for n in range(200)]
    numbers = {job["sampling"]["newNumber"] for job in jobs if "newNumber" in job["sampling"]}
    assert numbers <= set(range(2, 10)) and len(numbers) > 3, numbers
    lamps = [lamp for job in jobs if isinstance(job["scene"], dict) for lamp in job["scene"].get("lamps", [])]
    assert lamps and all(0 < lamp["power"] <= 5 for lamp in lamps), lamps


def cases_are_repeatable(schema):
    """A seed and a number give one case, which survives its JSON."""
    for number in range(50):
        case = draw_case(schema, 5, number)
        assert case == draw_case(schema, 5, number) == json.loads(json.dumps(case)), number


def spoiled_jobs_differ(schema):
    case = draw_case(schema, 5, 1)
    assert any(spoil(case, random.Random(n))["job"] != case["job"] for n in range(5))


# ---- files --------------------------------------------------------------------------------------------------


def frames_are_read(_):
    """Every compression but the foreign one, written here by the book; a wrong number of pixels is seen."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "map.exr"
        write_file(path, {"kind": "sky", "width": 4, "height": 3}, folder)
        frame = read_frame(path)
        assert (frame.width, frame.height, frame.sample_bytes) == (4, 3, 4 * 3 * 12)
        assert all(g == 0.5 for g in frame.channels["G"]), frame.channels["G"]
        plain = path.read_bytes()

        # The same with zlib, rows in blocks of one.
        start = plain.index(b"compression\0compression\0") + 28
        packed = bytearray(plain[:start] + b"\x02" + plain[start + 1:])
        table = len(plain) - 3 * (8 + 48) - 3 * 8
        rows = [plain[table + 24 + 56 * y:][:56] for y in range(3)]
        at, blocks, offsets = table + 24, b"", b""
        for row in rows:
            raw = row[8:]
            halves = raw[0::2] + raw[1::2]
            coded = bytes([halves[0]]) + bytes((b - a + 128) & 255 for a, b in zip(halves, halves[1:]))
            data = zlib.compress(coded)
            data = data if len(data) < len(raw) else raw
            offsets += struct.pack("<Q", at + len(blocks))
            blocks += row[:4] + struct.pack("<i", len(data)) + data
        path.write_bytes(bytes(packed[:table]) + offsets + blocks)
        assert read_frame(path).channels == frame.channels
    assert unpack_runs(bytes([2, 7, 254, 1, 2])) == bytes([7, 7, 7, 1, 2])
    assert rgbe((0, 0, 0)) == bytes(4) and rgbe((1.0, 0.5, 0.25)) == bytes([128, 64, 32, 129])


def wild_maps_hold_what_readers_mend(_):
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "map.exr"
        write_file(path, {"kind": "wild", "width": 4, "height": 2, "count": 1, "seed": 1}, folder)
        values = [v for plane in read_frame(path).channels.values() for v in plane]
        assert any(map(math.isnan, values)) and any(map(math.isinf, values)) and min(v for v in values if v == v) < 0


# ---- the judge ----------------------------------------------------------------------------------------------


def frames_of(*pixels):
    return {"frame.0001.exr": Frame((0, 0, 2, 2), (0, 0, 2, 2), {"R": array("f", pixels), "A": array("f", [1, 1, 1, 1])}, 32)}


def raises(kind, function, *arguments):
    try:
        function(*arguments)
    except Wrong as found:
        assert found.kind == kind, found
        return str(found)
    raise AssertionError(f"{kind}: a planted fault was not found")


def wrong_pixels_are_found(_):
    """One bit of one pixel, a sign of zero, a frame or a channel that is missing."""
    good = frames_of(0.5, 1.0, 0.0, 2.0)
    compare(good, frames_of(0.5, 1.0, 0.0, 2.0))
    detail = raises("split shows", compare, good, frames_of(0.5, 1.0, 0.0, 2.0000002384185791))
    assert "first at (1, 1)" in detail and "1 of 4 pixels of R" in detail, detail
    raises("split shows", compare, good, frames_of(0.5, 1.0, -0.0, 2.0))
    raises("frames", compare, good, {**good, "frame.0002.exr": good["frame.0001.exr"]})
    less = frames_of(0.5, 1.0, 0.0, 2.0)
    del less["frame.0001.exr"].channels["A"]
    raises("channels", compare, good, less)


def wrong_numbers_are_found(_):
    """NaN, infinity, a frame of another size than was predicted."""
    job, predicted = {"image": {"width": 2, "height": 2}}, {"frameBytes": 32}
    judge_frames(frames_of(0, 1, 2, 3), job, predicted)
    # Colours past a half float take two bytes more each.
    bright, narrow = frames_of(0, 1, 2, 3e38), {"frameBytes": 32 - 3 * 2 * 4}
    judge_frames(bright, job, narrow)
    raises("frame bytes", judge_frames, bright, job, predicted)
    judge_frames(bright, {**job, "output": {"pixelType": "float"}}, predicted)
    for bad in (math.nan, math.inf, -math.inf):
        raises("not finite", judge_frames, frames_of(0, 1, bad, 2), job, predicted)
    raises("frame bytes", judge_frames, frames_of(0, 1, 2, 3), job, {"frameBytes": 28})
    raises("size", judge_frames, frames_of(0, 1, 2, 3), {"image": {"width": 4, "height": 1}}, predicted)
    # The same pixels, but one of them around the picture; and where they should be.
    wide = {"image": {"width": 1, "height": 2, "overscan": [1, 0, 0, 0]}}
    raises("size", judge_frames, frames_of(0, 1, 2, 3), wide, predicted)
    frames = frames_of(0, 1, 2, 3)
    frames["frame.0001.exr"].window, frames["frame.0001.exr"].display = (-1, 0, 1, 2), (0, 0, 1, 2)
    judge_frames(frames, wide, predicted)


def wrong_predictions_are_found(_):
    job = {"image": {"width": 2, "height": 2}, "sampling": {"method": "mis"}}
    predicted = {"renderTasks": 2, "secondPassTasks": 0, "assembleTasks": 3, "frames": 3, "runs": 2,
                 "primaryRaysPerPixel": 4, "shadowRaysPerPixel": 8, "motionMaxPx": 0}
    stats = {"pixels": 12, "raysPrimary": 32, "raysShadow": 96}
    compare_prediction(predicted, {"tasksTotal": 5, "stats": stats}, job)
    for kind, key, value in (("predicted pixels", "pixels", 11), ("predicted primary rays", "raysPrimary", 33),
                             ("predicted shadow rays", "raysShadow", 97)):
        raises(kind, compare_prediction, predicted, {"tasksTotal": 5, "stats": {**stats, key: value}}, job)
    raises("predicted tasks", compare_prediction, predicted, {"tasksTotal": 6, "stats": stats}, job)
    assert FAULT_LINE.match("job.json: $.frames: expected x") and not FAULT_LINE.match("Segmentation fault")


def wrong_means_are_found(_):
    """A bias of five standard errors is found; without one, 3000 tries alarm no more often than the level says."""
    rng = random.Random(1)
    count, most = FIRST_LOOK

    def runs(mean, number):
        return [rng.gauss(mean, 0.02) for _ in range(number)]

    assert sum(significant(runs(1.08, count), runs(1, count), most) for _ in range(100)) > 90
    alarms = sum(significant(runs(1, count), runs(1, count), most) for _ in range(3000))
    assert alarms < 0.002 * 3000 + 3 * math.sqrt(6), alarms
    assert significant(runs(1.03, SECOND_LOOK[0]), runs(1, SECOND_LOOK[0]), SECOND_LOOK[1])
    assert not significant([1.0] * 8, [1.0] * 8, most) and significant([1.0] * 8, [1.1] * 8, most)


# ---- the shrinker -------------------------------------------------------------------------------------------


def failures_become_small(schema):
    """Of a failure that needs two keys and an object, nothing else that may go is left."""
    tried = []

    def fails(case):
        tried.append(case)
        job = case["job"]
        return (job.get("sampling", {}).get("numParticles", 16) >= 3 and len(job["scene"].get("objects", [])) >= 1
                and job.get("state", {}).get("carry") is False)

    found = 0
    for number in range(400):
        case = draw_case(schema, 3, number)
        try:
            if not fails(case):
                continue
        except (TypeError, KeyError, AttributeError):
            continue
        found += 1
        small = shrink(case, lambda c: ignoring_nonsense(fails, c), 20)
        job = small["job"]
        assert fails(small) and len(job["scene"]["objects"]) == 1 and job["state"] == {"carry": False}, small
        assert set(job) <= {"name", "image", "scene", "state", "sampling"}, job
        assert job.get("sampling", {}).get("numParticles", 3) == 3, job
        assert "interruption" not in small["second"]
        if found == 3:
            return
    raise AssertionError(f"only {found} of 400 cases have such a failure")


def ignoring_nonsense(fails, case):
    try:
        return fails(case)
    except (TypeError, KeyError, AttributeError):
        return False


def shrinking_ends_in_time(schema):
    """The deadline holds, and what is returned fails."""
    case = draw_case(schema, 3, 2)
    ticks = iter(range(10**6))
    assert shrink(case, lambda _: True, 3, clock=lambda: next(ticks))["job"]
    assert next(ticks) <= 6


TESTS = [every_key_is_drawn, new_keys_take_part, cases_are_repeatable, spoiled_jobs_differ, frames_are_read,
         wild_maps_hold_what_readers_mend, wrong_pixels_are_found, wrong_numbers_are_found,
         wrong_predictions_are_found, wrong_means_are_found, failures_become_small, shrinking_ends_in_time]


def self_test(source):
    """Runs all; the number of failures."""
    schema, failures = load_schema(source), 0
    for test in TESTS:
        try:
            test(schema)
            print(f"{test.__name__}: ok", flush=True)
        except AssertionError as fault:
            failures += 1
            print(f"{test.__name__}: FAILED: {str(fault)[:2000]}", flush=True)
    return failures

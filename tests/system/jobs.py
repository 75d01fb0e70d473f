"""The small job that tests start from. Standard library only."""

import json

from assets import sphere, write_map, write_mesh


def make_job(folder, **changes):
    """A small job as a dict; its assets are written to `folder`. changes: top-level keys, merged one level deep."""
    folder.mkdir(parents=True, exist_ok=True)
    write_mesh(folder / "sphere.off", *sphere())
    write_map(folder / "lamp.hdr")
    job = {
        "specificationVersion": 1,
        "name": "system test",
        "frames": "1-6",
        "seed": 7,
        "image": {"width": 160, "height": 96, "sites": 1, "tileSize": 64},
        "light": {"bounces": 0},
        "camera": {"position": [0, 1.2, 5], "lookAt": [0, 0.6, 0], "verticalFovDeg": 35},
        "scene": {
            "materials": {
                "chalk": {"type": "diffuse", "color": [0.7, 0.7, 0.65]},
                "lacquer": {"type": "phong", "color": [0.6, 0.1, 0.1], "kd": 0.5, "ks": 0.4, "exponent": 50},
            },
            "meshes": {"sphere": str(folder / "sphere.off")},
            "objects": [
                {"mesh": "sphere", "material": "lacquer", "translate": [-0.9, 0.8, 0], "scale": [0.8, 0.8, 0.8]},
                {"mesh": "sphere", "material": "chalk", "translate": [0.9, 0.6, 0.3], "scale": [0.6, 0.6, 0.6]},
            ],
            "ground": {"material": "chalk", "height": 0, "size": 20},
        },
        "environment": {
            "keys": [{"frame": 1, "map": str(folder / "lamp.hdr")}],
            "rotation": {"axis": [0, 1, 0], "startDeg": 0, "degPerFrame": 1.5},
        },
        "sampling": {"method": "sequential", "numParticles": 16, "numCandidates": 64, "numDistributions": 3},
        "output": {
            "directory": str(folder / "frames"),
            "aovs": ["lns", "visibility", "ess", "acceptance", "source", "normal", "depth"],
        },
        "state": {"carry": True, "checkpointEvery": 2, "keep": "all"},
    }
    return merged(job, changes)


def merged(job, changes):
    """A job with the keys of `changes`, whose dicts change keys of the job's own."""
    inner = {key: {**job.get(key, {}), **value} if isinstance(value, dict) else value for key, value in changes.items()}
    return {**job, **inner}


def camera_keys(*views):
    """What makes the camera of a job move. views: (frame, position, place that it looks at)."""
    return {"keys": [{"frame": frame, "position": position, "lookAt": look_at} for frame, position, look_at in views]}


def write_job(path, job):
    """Writes the job file; returns its path."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(job, indent=2), encoding="utf-8")
    return path

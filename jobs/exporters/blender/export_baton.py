"""Exports a Blender file as a Baton job:

blender -b shot.blend -P export_baton.py -- OUT [--strict] [--frames 1-24]

OUT gets scene.glb, the images of the world, job.json for `baton render OUT/job.json`, and report.txt: what is not
carried over. --strict: where something is not, no job is written, and the exit code is 1.
"""

import runpy
from pathlib import Path

runpy.run_path(str(Path(__file__).resolve().parent / "baton_exporter/headless.py"), run_name="__main__")

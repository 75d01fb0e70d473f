"""All traits of Blender files; run by Blender it prints their names as JSON."""

import json
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parents[1] / "jobs/exporters/blender")]
import blender_traits_of_cameras  # noqa: E402, F401
import blender_traits_of_materials  # noqa: E402, F401
import blender_traits_of_shapes  # noqa: E402, F401
import blender_traits_of_worlds  # noqa: E402, F401
from blender_trait import draw_traits, names  # noqa: E402, F401

if __name__ == "__main__":
    print(json.dumps(names()))

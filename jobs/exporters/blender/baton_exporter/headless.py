"""The exporter's command line; runs in a Blender of its own. What it takes and does: ../export_baton.py."""

import argparse
import sys
import traceback
from pathlib import Path


def main():
    parser = argparse.ArgumentParser(prog="export_baton.py", description="Exports a Blender file as a Baton job.")
    parser.add_argument("out", type=Path, help="folder of the job")
    parser.add_argument("--strict", action="store_true", help="write no job where something is not carried over; exit 1")
    parser.add_argument("--frames", help="only these, such as 12, 1-48x2, 1,5,9-12; otherwise those of the scene")
    options = parser.parse_args(sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else [])

    sys.dont_write_bytecode = True
    sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
    from baton_exporter import gltf_file, job
    try:
        report = job.export(options.out, options.strict, options.frames)
    except job.CannotExport as fault:
        print(f"export_baton: {fault}", file=sys.stderr)
        return 65
    except gltf_file.ExporterFailed as fault:
        print(f"export_baton: {fault}", file=sys.stderr)
        return 70
    print(report.text(), end="")
    if options.strict and report.entries:
        print(f"no job is written; {options.out / 'report.txt'} has this list")
        return 1
    print(f"wrote {options.out / 'job.json'}; next: baton render {options.out / 'job.json'}")
    return 0


if __name__ == "__main__":
    try:
        code = main()
    except Exception:  # Blender would end with exit code 0
        traceback.print_exc()
        code = 70
    sys.stdout.flush()
    sys.exit(code)

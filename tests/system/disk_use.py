#!/usr/bin/env python3
"""What a job has in its store at most, beside what `baton check` says.

disk_use.py --bin FOLDER JOB [--workers N] [-- arguments of check and render, such as --scale .25]
"""

import argparse
import json
import os
import subprocess
import tempfile
import threading
from pathlib import Path

from farm import Programs

INTERVAL_S = 0.02
KINDS = {b"BST1": "states", b"BTF1": "films", b"BFS1": "samples"}


class StoreWatch:
    """Looks at a store again and again while it is open. peak: bytes at most; peaks: of each kind of blob."""

    def __init__(self, store):
        self.store = Path(store)
        self.peak = 0
        self.peaks = dict.fromkeys([*KINDS.values(), "other"], 0)
        self.seen = {}
        self.at_end = 0
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._watch)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._stop.set()
        self._thread.join()
        self.at_end = self._look()

    def _watch(self):
        while not self._stop.wait(INTERVAL_S):
            self._look()

    def _look(self):
        sums = dict.fromkeys(self.peaks, 0)
        for folder in self._folders():
            for entry in folder:
                kind, size = self._blob(entry)
                sums[kind] += size
        total = sum(sums.values())
        self.peak = max(self.peak, total)
        for kind, size in sums.items():
            self.peaks[kind] = max(self.peaks[kind], size)
        return total

    def _folders(self):
        for i in range(256):
            try:
                with os.scandir(self.store / f"{i:02x}") as entries:
                    yield [entry for entry in entries if entry.name.endswith(".blob")]
            except FileNotFoundError:
                pass

    def _blob(self, entry):
        """Kind and size; a blob may be gone meanwhile."""
        if entry.path not in self.seen:
            try:
                with open(entry.path, "rb") as file:
                    magic = file.read(4)
                    self.seen[entry.path] = (KINDS.get(magic, "other"), os.fstat(file.fileno()).st_size)
            except FileNotFoundError:
                return "other", 0
        return self.seen[entry.path]


def measure(programs, job, workers=1, arguments=(), folder=None):
    """(what `baton check` says, StoreWatch) of a job that is rendered into `folder`."""
    predicted = programs.checked(job, *arguments)
    with tempfile.TemporaryDirectory(dir=folder) as work:
        out = ["--set", f"output.directory={work}/frames"]
        with StoreWatch(Path(work) / "work/store") as watch:
            subprocess.run([programs.path("baton"), "render", job, *arguments, *out, "--work-dir", f"{work}/work",
                            "--workers", str(workers), "--threads-per-worker", "1", "--json"],
                           check=True, capture_output=True)
        frames = [file.stat().st_size for file in Path(work).glob("frames*/*.exr")]
    watch.frame_bytes = sum(frames)
    return predicted, watch


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bin", required=True, help="folder of the programs")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("job")
    parser.add_argument("arguments", nargs="*", help="more arguments of check and render")
    options = parser.parse_args()
    predicted, watch = measure(Programs(options.bin), options.job, options.workers, options.arguments)
    pixels = predicted["filmBytesPerFrame"]
    print(json.dumps({"predicted": predicted.get("storeBytes", predicted["diskBytes"]), "peak": watch.peak, **watch.peaks,
                      "atEnd": watch.at_end, "frames": watch.frame_bytes, "film": pixels,
                      "sizes": {kind: [len(sizes), sum(sizes)] for kind in KINDS.values()
                                if (sizes := [s for k, s in watch.seen.values() if k == kind])}}))


if __name__ == "__main__":
    main()

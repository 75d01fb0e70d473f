"""Reads, extends and writes .glb files. Standard library only."""

import json
import struct
from pathlib import Path

FLOAT = 5126
KINDS = {1: "SCALAR", 3: "VEC3", 4: "VEC4"}


class Glb:
    """The JSON and the binary part of a file."""

    def __init__(self, document, binary):
        self.document, self.binary = document, bytearray(binary)

    @classmethod
    def read(cls, path):
        data = Path(path).read_bytes()
        magic, version, _size = struct.unpack_from("<4sII", data)
        if magic != b"glTF" or version != 2:
            raise ValueError(f"{path}: not a glTF 2.0 binary file")
        chunks, at = {}, 12
        while at + 8 <= len(data):
            size, kind = struct.unpack_from("<I4s", data, at)
            chunks.setdefault(kind, data[at + 8:at + 8 + size])
            at += 8 + size
        return cls(json.loads(chunks[b"JSON"]), chunks.get(b"BIN\0", b""))

    def write(self, path):
        if self.binary:
            self.document["buffers"] = [{"byteLength": len(self.binary)}]
        text = json.dumps(self.document, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        binary = bytes(self.binary) + bytes(-len(self.binary) % 4)
        chunks = struct.pack("<I4s", len(text), b"JSON") + text
        if binary:
            chunks += struct.pack("<I4s", len(binary), b"BIN\0") + binary
        Path(path).write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks)

    def add_floats(self, rows):
        """Index of a new accessor of equally long rows."""
        width = len(rows[0])
        self.binary += bytes(-len(self.binary) % 4)
        values = [value for row in rows for value in row]
        packed = struct.pack(f"<{len(values)}f", *values)
        views = self.document.setdefault("bufferViews", [])
        views.append({"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(packed)})
        self.binary += packed
        stored = struct.unpack(f"<{len(values)}f", packed)
        accessors = self.document.setdefault("accessors", [])
        accessors.append({"bufferView": len(views) - 1, "componentType": FLOAT, "count": len(rows), "type": KINDS[width],
                          "min": [min(stored[i::width]) for i in range(width)],
                          "max": [max(stored[i::width]) for i in range(width)]})
        return len(accessors) - 1

    def animate(self, name, tracks, times):
        """Appends an animation. tracks: (node index, path, one row for each time, of weights one for each time and target),
        linear between them."""
        if not tracks:
            return
        clock = self.add_floats([[time] for time in times])
        samplers, channels = [], []
        for node, path, rows in tracks:
            samplers.append({"input": clock, "output": self.add_floats(rows), "interpolation": "LINEAR"})
            channels.append({"sampler": len(samplers) - 1, "target": {"node": node, "path": path}})
        self.document.setdefault("animations", []).append({"name": name, "samplers": samplers, "channels": channels})


def tracks_of(node, places, tolerance=1e-7):
    """What of a node changes. places: one (translation, quaternion x y z w, scale) for each time."""
    tracks = []
    for path, rows in zip(("translation", "rotation", "scale"), zip(*places)):
        rows = [list(row) for row in rows]
        if path == "rotation":
            # The shorter way: q and -q are the same rotation.
            for before, row in zip(rows, rows[1:]):
                if sum(a * b for a, b in zip(before, row)) < 0:
                    row[:] = [-value for value in row]
        largest = max(1.0, *(abs(value) for row in rows for value in row))
        if any(abs(a - b) > tolerance * largest for row in rows for a, b in zip(row, rows[0])):
            tracks.append((node, path, rows))
    return tracks


def frames_of_targets(poses):
    """The frames that have a morph target: those with a pose other than the first frame's."""
    return [frame for frame, pose in enumerate(poses) if pose is not None]


def weights_of(poses):
    """Rows of a track of weights: frame by frame one for each target, 1 in its frame. In between one goes over into the next."""
    targets = frames_of_targets(poses)
    return [[1.0 if target == frame else 0.0] for frame in range(len(poses)) for target in targets]

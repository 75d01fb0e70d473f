"""A disk that fills up, folders that become read-only, and a power cut: for chaos.py, in a mount namespace of its own."""

import contextlib
import os
import subprocess
import sys
import time

from chaos_witness import Unsynced
from farm import check

SIZE_MIB = 512  # three jobs at once need some tens
LEFT_MIB = 8  # of a full disk: less than what blobs leave to the journal
IN_NAMESPACE = "BATON_CHAOS_NAMESPACE"


def enter_namespace():
    """Starts the script again where it may mount, if this machine lets it. Returns whether it may."""
    if IN_NAMESPACE in os.environ:
        return True
    inside = ["unshare", "--map-root-user", "--mount"]
    with contextlib.suppress(FileNotFoundError):
        if subprocess.run([*inside, "mount", "-t", "tmpfs", "none", "/mnt"], check=False, capture_output=True).returncode == 0:
            os.environ[IN_NAMESPACE] = "1"
            os.execvp(inside[0], [*inside, sys.executable, *sys.argv])
    return False


def may_mount():
    return IN_NAMESPACE in os.environ


def mount(*arguments):
    return subprocess.run(["mount", *map(str, arguments)], check=False, capture_output=True).returncode == 0


class Disk:
    """The work folder on a small disk of its own, and the frames in a folder that may become read-only."""

    def __init__(self, work, frames):
        self.work, self.frames = work, frames
        self.folders = [work / "store", frames]
        work.mkdir(parents=True)
        frames.mkdir(parents=True)
        check(mount("-t", "tmpfs", "-o", f"size={SIZE_MIB}m", "none", work), "cannot mount a tmpfs")
        (work / "store").mkdir()
        for folder in self.folders:
            check(mount("--bind", folder, folder), f"cannot mount {folder} on itself")

    def close(self):
        self.heal()
        for folder in [*self.folders, self.work]:
            subprocess.run(["umount", "-l", str(folder)], check=False, capture_output=True)

    def fill(self):
        """Leaves the journal some room, and blobs none."""
        space = os.statvfs(self.work)
        room = space.f_bavail * space.f_frsize - (LEFT_MIB << 20)
        with open(self.work / "filler", "wb") as filler:
            os.posix_fallocate(filler.fileno(), 0, max(room, 1))

    def make_read_only(self, folder):
        """False when it does not become so: while a file is open for writing it cannot."""
        deadline = time.monotonic() + 3
        while not mount("-o", "remount,bind,ro", folder):
            if time.monotonic() > deadline:
                return False
            time.sleep(0.01)
        return True

    def heal(self):
        (self.work / "filler").unlink(missing_ok=True)
        for folder in self.folders:
            mount("-o", "remount,bind,rw", folder)


class PowerCut:
    """Takes away what no program has waited for the disk with."""

    def __init__(self, programs, folder):
        record = folder / "syncs"
        record.touch()
        self._unsynced = Unsynced(record)
        self.environment = {"LD_PRELOAD": programs.path("libsync_witness.so"), "BATON_SYNC_RECORD": str(record)}

    def at_risk(self):
        """The files that a power cut might take now, and when they were published."""
        return {path: ms for path, ms in self._unsynced.files().items()
                if path.endswith((".blob", ".exr")) and os.path.exists(path)}

    def strike(self, rng, promised):
        """After the end of all processes. promised: digest -> when it was last reported, if its blob had to be durable
        then. Returns how many files it took."""
        lost = self.at_risk()
        for path, published_ms in lost.items():
            digest = "".join(path.rsplit("/", 2)[-2:]).removesuffix(".blob")
            check(promised.get(digest, -1) < published_ms, f"reported as durable, and taken by a power cut: {path}")
            check(not path.endswith(".exr"), f"a frame was published before it was on the disk: {path}")
        struck = 0
        for path in lost:
            if rng.random() < 0.5:
                with contextlib.suppress(OSError):
                    os.truncate(path, 0)
                    struck += 1
        return struck

"""What chaos.py strikes frames and output folders with, while their job runs; nobody submits it once more for that."""

import contextlib
import shutil
import time

from farm import OK, PATIENCE

NOTICED_S = 6 * PATIENCE  # a fault of a disk that nobody notices in this time has not struck


def put_folder(path):
    """Puts a folder that is not empty in the place of a file."""
    path.unlink()
    path.mkdir()
    (path / "full").touch()


class FrameFaults:
    """Those of Chaos (chaos_faults.py). Each returns whether it struck."""

    def remove_frame(self):
        return self.harm_frame(lambda path: path.unlink(), "frame removed")

    def cut_frame(self):
        return self.harm_frame(lambda path: path.write_bytes(path.read_bytes()[:self.rng.randrange(2000)]), "frame cut")

    def damage_frame(self):
        """A byte is changed so that not all pixels can be decoded; else it would be somebody's picture."""
        def damage(path):
            content = path.read_bytes()
            while self.farm.programs.run("exr_digest", path, expect=None).returncode == OK:
                at = self.rng.randrange(len(content) // 2, len(content))
                path.write_bytes(content[:at] + bytes([content[at] ^ 0x10]) + content[at + 1:])
        return self.harm_frame(damage, "byte of a frame changed")

    def block_frame(self):
        """A frame that cannot be read pauses its job, until mend() clears the way."""
        return self.harm_frame(put_folder, "frame blocked", lambda job, path: job.blocked.append(path))

    def rename_folder(self):
        """The job is paused until its folder is back. Struck when the coordinator has noticed."""
        job = self.job_with_frames()
        if job is None or not self.farm.coordinator.alive() or self.is_frozen(self.farm.coordinator):
            return False
        away = job.frames.with_name(job.frames.name + "-away")
        with contextlib.suppress(OSError):  # it may be read-only now
            job.frames.rename(away)
            deadline = time.monotonic() + NOTICED_S
            is_paused = False
            while not is_paused and self.farm.coordinator.alive() and time.monotonic() < deadline:
                time.sleep(0.05)
                is_paused = (self.show(job) or {}).get("status") == "paused"
            # A worker that was at it may just have made another one.
            while away.exists():
                shutil.rmtree(job.frames, ignore_errors=True)
                with contextlib.suppress(OSError):
                    away.rename(job.frames)
            if is_paused:
                self.mend(job)
            return is_paused and self.count("folder renamed")
        return False

    def mend(self, job):
        """Clears the way for a paused job and lets it go on; what a disk that is read-only now keeps is cleared later."""
        for path in job.blocked:
            shutil.rmtree(path, ignore_errors=True)
        job.blocked = [path for path in job.blocked if path.is_dir()]
        self.farm.baton("job", "resume", job.id, expect=None)

    def job_with_frames(self):
        """One that has written some frames and will write some for a while; None: there is none."""
        for job in self.rng.sample(self.jobs, len(self.jobs)):
            shown = None if job.is_done else self.show(job)
            if shown and shown["status"] == "running" and 0 < shown["framesDone"] <= shown["framesTotal"] - 2:
                job.written = [job.frame(number) for number in shown["framesDoneNumbers"]]
                return job
        return None

    def harm_frame(self, harm, what, note=lambda job, path: None):
        """Harms a frame that was reported, of a job that is not done: its end must not come before the frame is mended."""
        job = self.job_with_frames()
        if job is None:
            return False
        path = self.rng.choice(job.written)
        with contextlib.suppress(OSError):  # it may be read-only now, or made again
            content = path.read_bytes()
            harm(path)
            shown = self.show(job)
            if shown and shown["status"] == "done":
                # Too late.
                shutil.rmtree(path, ignore_errors=True)
                path.write_bytes(content)
                return False
            note(job, path)
            self.num_harmed += 1
            return self.count(what)
        return False

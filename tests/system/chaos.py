#!/usr/bin/env python3
"""Jobs of every kind on a farm whose programs, messages and files are struck at random; every frame must come out right.

usage: chaos.py --bin FOLDER [--faults N] [--seed S] [--freeze SECONDS] [--keep]

Real processes: one coordinator, three workers behind a proxy, three jobs at once (at rest, in motion, with a second pass),
again and again until N faults have struck. Kinds of faults are dealt like cards, so that each comes once before any comes
again. Then the farm is left alone, and each job must end as done. Files of jobs that are done are not struck.

Checked at the end: the pixels are those of an undisturbed run with one instruction set and the job's last settings; no task was
done under two digests; nothing was done again that no fault explains; no lease was taken from a worker for the sake of an older
one, and no older one was kept; when all is done nobody reports any more; no temporary file is left. Where the machine lets it
mount, the store lies on a small disk that is filled, folders become read-only, and power cuts take every file that no program
had waited for the disk with.
"""

import argparse
import contextlib
import os
import random
import shutil
import sys
import tempfile
import time
from pathlib import Path

import chaos_witness as witness
from chaos_disk import Disk, PowerCut, enter_namespace, may_mount
from chaos_faults import NUM_WORKERS, Chaos
from chaos_jobs import FOREIGN_ISA, Undisturbed
from farm import PATIENCE, Farm, Fault, Programs, check, wait_until

END_S = 300 * PATIENCE


def check_leftovers(farm):
    """What was being written when its writer died is removed by the next coordinator, once it is old."""
    unfinished = list(farm.work_folder.rglob("*.tmp"))
    for path in unfinished:
        os.utime(path, (0, 0))
    farm.coordinator.kill()
    farm.start_coordinator()
    left = [path for path in unfinished if path.exists()]
    check(not left, f"temporary files are left: {left[:3]}")


def finish(chaos):
    """Leaves the farm alone until all is done. Nothing is submitted once more, but with --restart a job that only a worker of
    another instruction set could go on with: what is missing then stays missing."""
    def all_done():
        chaos.tend()
        return not chaos.open_jobs()
    for thaw in chaos.thaws.values():
        thaw.join()
    wait_until(all_done, "all jobs are done", END_S)


def judge(chaos, farm, expected):
    """Everything that must hold at the end. Returns (tasks, superseded leases that workers named, tasks done again, how many
    of those are explained)."""
    for job in chaos.jobs:
        expected.check(job)
    check((farm.work_folder / "store/token").exists(), "the store's token is gone")
    check(chaos.proxy.is_quiet(4 * PATIENCE), "all is done, and somebody still reports")
    log, seen = farm.coordinator.log(), chaos.proxy.seen()
    check("BUG" not in log, "the coordinator has found a bug")
    ids = {version: job.id for job in chaos.jobs for version in job.versions}
    num_tasks = witness.check_one_result_a_task(seen)
    witness.check_nothing_revoked(seen, chaos.proxy.returns(), chaos.proxy.struck_ms(), chaos.proxy.epochs(),
                                  witness.superseded(log), ids)
    num_superseded = witness.check_superseded_revoked(seen, chaos.proxy.struck_ms(), witness.reopened(log), ids)
    again = witness.check_repeated(seen, log, chaos.struck, NUM_WORKERS, len(chaos.jobs), chaos.num_harmed)
    check_leftovers(farm)
    return (num_tasks, num_superseded, *again)


def run(programs, folder, num_faults, seed, longest_freeze_s=5):
    """Everything. Raises Fault."""
    rng = random.Random(seed)
    folder.mkdir(parents=True, exist_ok=True)
    expected = Undisturbed(programs, folder / "plain", ("auto", FOREIGN_ISA))
    with contextlib.ExitStack() as stack:
        disk = Disk(folder / "farm/work", folder / "farm/frames") if may_mount() else None
        if disk:
            stack.callback(disk.close)
        farm = stack.enter_context(Farm(programs, folder / "farm", workers=None))
        farm.insecure = True  # the proxy is at another address
        power = PowerCut(programs, farm.folder) if Path(programs.path("libsync_witness.so")).exists() else None
        farm.environment = power.environment if power else {}
        farm.start_coordinator()
        proxy = witness.Proxy(programs, farm.endpoint, farm.folder)
        stack.callback(proxy.close)
        farm.worker_endpoint = proxy.endpoint

        chaos = Chaos(farm, proxy, disk, power, rng, longest_freeze_s)
        while chaos.struck.total() < num_faults:
            chaos.tend()
            chaos.renew()
            time.sleep(rng.uniform(0, 0.5))
            chaos.strike()
        finish(chaos)
        num_tasks, num_superseded, again, explained = judge(chaos, farm, expected)
    faults = ", ".join(f"{count} {what}" for what, count in sorted(chaos.struck.items()))
    print(f"seed {seed}: {chaos.struck.total()} faults on {len(chaos.jobs)} jobs ({faults}); {chaos.num_lost_in_cuts} files "
          f"lost in power cuts; {num_superseded} leases superseded; {num_tasks} tasks, {again} done again, {explained} "
          "explained; all frames right")
    for missing, what in ((disk, "full disks and read-only folders: it may not mount"),
                          (power, "power cuts: programs with sanitizers load no library before theirs")):
        if not missing:
            print(f"not tried: {what}")


def main():
    enter_namespace()
    parser = argparse.ArgumentParser()
    parser.add_argument("--bin", required=True, help="folder of the programs")
    parser.add_argument("--faults", type=int, default=300)
    parser.add_argument("--seed", type=int, default=random.SystemRandom().randrange(1 << 30))
    parser.add_argument("--freeze", type=float, default=30, help="seconds that a program is stopped for at most")
    parser.add_argument("--keep", action="store_true", help="leave the files")
    options = parser.parse_args()
    folder = Path(tempfile.mkdtemp(prefix="baton-chaos-"))
    try:
        run(Programs(options.bin), folder, options.faults, options.seed, options.freeze)
    except Fault as fault:
        print(f"seed {options.seed}: {fault}\nfiles are in {folder}; farm/faults lists what struck, farm/record what was said")
        return 1
    if not options.keep:
        shutil.rmtree(folder, ignore_errors=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())

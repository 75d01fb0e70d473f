"""A whole Slurm on this machine, without root's services: munged, slurmctld and one slurmd for each node, with ports, keys
and folders of their own. Everything that was started ends with the `with` block."""

import contextlib
import getpass
import os
import signal
import socket
import subprocess
import time
from pathlib import Path

from farm import DEADLINE_S, Fault, free_port, wait_until

CONFIGURATION = """ClusterName=test
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={port}
SlurmUser={user}
SlurmdUser={user}
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket
CredType=cred/munge
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool/%n
SlurmctldPidFile={folder}/slurmctld.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdPidFile={folder}/%n.pid
SlurmdLogFile={folder}/%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
MpiDefault=none
SlurmdParameters=config_overrides
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
ReturnToService=2
JobRequeue=1
SlurmdTimeout=20
KillWait=5
AccountingStorageType=accounting_storage/none
{nodes}
PartitionName=farm Nodes=ALL Default=YES MaxTime=INFINITE State=UP
"""


class Cluster:
    """Nodes n1, n2 ... of one processor each. environment: what its commands need."""

    def __init__(self, folder, nodes=3):
        self.folder = Path(folder)
        self.nodes = [f"n{i + 1}" for i in range(nodes)]
        self.environment = {"SLURM_CONF": str(self.folder / "slurm.conf")}

    def __enter__(self):
        try:
            self._start()
        except BaseException:
            self.__exit__(None, None, None)
            raise
        return self

    def __exit__(self, *_):
        """Whatever has this cluster's configuration in its environment belongs to it: daemons, steps, pilots."""
        for _ in range(50):
            mine = self._processes()
            if not mine:
                return
            for pid in mine:
                with contextlib.suppress(ProcessLookupError):
                    os.kill(pid, signal.SIGKILL)
            time.sleep(0.1)
        raise Fault(f"the cluster's processes do not end: {mine}")

    def _start(self):
        for name in ["state", *(f"spool/{node}" for node in self.nodes)]:
            (self.folder / name).mkdir(parents=True)
        host = socket.gethostname()
        ports = [free_port() for _ in range(1 + len(self.nodes))]
        nodes = "\n".join(f"NodeName={node} NodeHostname={host} NodeAddr=127.0.0.1 Port={port} CPUs=1 RealMemory=1000 "
                          "State=UNKNOWN" for node, port in zip(self.nodes, ports[1:]))
        (self.folder / "slurm.conf").write_text(CONFIGURATION.format(
            host=host, port=ports[0], user=getpass.getuser(), folder=self.folder, nodes=nodes), encoding="ascii")

        key = self.folder / "munge.key"
        self.run("mungekey", "-c", "-k", key)
        key.chmod(0o600)
        self.run("munged", "--force", f"--key-file={key}", f"--socket={self.folder}/munge.socket",
                 *(f"--{what}-file={self.folder}/munge.{what}" for what in ("pid", "log", "seed")))
        self.start_controller("-c")
        for node in self.nodes:
            self.start_node(node)
        wait_until(lambda: self.run("sinfo", "-h", "-o", "%D %t").strip() == f"{len(self.nodes)} idle", "all nodes are idle")

    def run(self, *command, expect=0):
        """Runs one of Slurm's commands; returns what it printed. expect: None for any exit code."""
        done = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False,
                              env={**os.environ, **self.environment}, timeout=DEADLINE_S)
        if expect is not None and done.returncode != expect:
            raise Fault(f"{' '.join(map(str, command))}: exit code {done.returncode}\n{done.stdout}{done.stderr}")
        return done.stdout

    def start_controller(self, *options):
        self.run("slurmctld", *options)

    def start_node(self, node):
        self.run("slurmd", "-N", node)

    def kill_controller(self):
        """SIGKILL: what it has not written yet is forgotten."""
        os.kill(self._pid_of("slurmctld"), signal.SIGKILL)

    def kill_node(self, node):
        """SIGKILL to the daemon of the node and to all that runs there."""
        os.kill(self._pid_of(node), signal.SIGKILL)
        on_node = [pid for pid in self._processes() if self._environment(pid).get("SLURMD_NODENAME") == node]
        for pid in [*map(self._parent, on_node), *on_node]:  # first who would report its end
            if pid > 1:
                with contextlib.suppress(ProcessLookupError):
                    os.kill(pid, signal.SIGKILL)

    def pilots(self):
        """{id: (state, node)} of all jobs that the controller knows."""
        rows = self.run("squeue", "--noheader", "--array", "--format=%i|%T|%N").split()
        return {fields[0]: (fields[1], fields[2]) for fields in (row.split("|") for row in rows)}

    def running(self):
        """Running pilots, {id: node}."""
        return {job: node for job, (state, node) in self.pilots().items() if state == "RUNNING"}

    # ---- processes ----

    def command_lines(self, program):
        """The words of each of its processes of this name."""
        lines = []
        for pid in self._processes():
            with contextlib.suppress(OSError):  # it is gone
                lines.append(Path(f"/proc/{pid}/cmdline").read_bytes().decode(errors="replace").split("\0"))
        return [words for words in lines if Path(words[0]).name == program]

    def _pid_of(self, name):
        return int((self.folder / f"{name}.pid").read_text(encoding="ascii"))

    @staticmethod
    def _environment(pid):
        """Empty: it is gone, or somebody else's."""
        try:
            text = Path(f"/proc/{pid}/environ").read_bytes().decode(errors="replace")
        except OSError:
            return {}
        return dict(entry.partition("=")[::2] for entry in text.split("\0"))

    @staticmethod
    def _parent(pid):
        """0: it is gone, or its parent is no part of a job."""
        try:
            parent = int(Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()[1])
            name = Path(f"/proc/{parent}/comm").read_text(encoding="ascii").strip()
        except OSError:
            return 0
        return parent if name == "slurmstepd" else 0

    def _processes(self):
        """All that have this cluster's configuration in their environment, this one apart."""
        pids = [int(entry.name) for entry in Path("/proc").iterdir() if entry.name.isdigit()]
        return [pid for pid in pids if pid != os.getpid() and
                self._environment(pid).get("SLURM_CONF") == self.environment["SLURM_CONF"]]

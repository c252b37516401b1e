"""A real Slurm cluster from Debian's packages, without systemd, in a temporary folder: munged and
slurmctld on the test host `head`, a slurmd on each of the other hosts."""

import os
import secrets
import subprocess
from pathlib import Path

from processes import Processes, wait_until
from hosts import TestHosts, need_programs

START_S, LIMIT_S = 30.0, 60.0
NODES = ("n1", "n2")

# With process groups instead of cgroups, and without accounting, the cluster needs neither systemd nor a
# data base. A node that is silent for SlurmdTimeout is down, and its tasks are queued again. The
# scheduler runs every second.
CONFIGURATION = """\
ClusterName=sls
SlurmctldHost=head({head})
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket
CredType=cred/munge
SlurmUser=root
SlurmdUser=root
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool-%n
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd-%n.pid
ProctrackType=proctrack/pgid
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
MpiDefault=none
SwitchType=switch/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
ReturnToService=2
SlurmdTimeout=4
MessageTimeout=3
TCPTimeout=1
KillWait=1
SchedulerType=sched/backfill
SchedulerParameters=batch_sched_delay=0,sched_interval=1,bf_interval=1
{nodes}
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
"""


class SlurmCluster:
    """Raises Obstacle."""

    def __init__(self, hosts: TestHosts, folder: Path):
        need_programs("slurm-wlm munge", "munged", "slurmctld", "slurmd", "sbatch", "squeue",
                      "scancel", "scontrol")
        self.hosts = hosts
        self.folder = folder
        self.configuration = folder / "slurm.conf"
        self.processes = Processes(folder)

    def start_all(self) -> None:
        folder = self.folder
        folder.chmod(0o755)  # munged requires it
        (folder / "state").mkdir(exist_ok=True)
        key = folder / "munge.key"
        key.write_bytes(secrets.token_bytes(128))
        key.chmod(0o400)
        (folder / "cgroup.conf").write_text("CgroupPlugin=cgroup/v1\n")
        # Each node has two cores, independent of the machine's cores.
        nodes = "\n".join(f"NodeName={node} NodeAddr={self.hosts.address[node]} CPUs=2"
                          for node in NODES)
        self.configuration.write_text(CONFIGURATION.format(
            head=self.hosts.address["head"], folder=folder, nodes=nodes))
        self.start("munged", "head", "munged", "--foreground", "--force", "--key-file", str(key),
                   "--socket", f"{folder}/munge.socket", "--pid-file", f"{folder}/munged.pid",
                   "--seed-file", f"{folder}/munge.seed", "--log-file", f"{folder}/munged.log")
        wait_until((folder / "munge.socket").exists, START_S, "munged listens")
        self.start_controller()
        for node in NODES:
            self.start_node(node)
        wait_until(lambda: self.list_states() == {node: "idle" for node in NODES}, START_S, "both nodes are idle")

    def end_jobs(self) -> None:
        self.ask("scancel", "--user=root")
        wait_until(lambda: not self.ask("squeue", "--noheader"), LIMIT_S, "no job is left")

    def start(self, name: str, host: str, *command: str) -> None:
        self.processes.start(name, self.hosts.on(host, *command), **self.environment)

    def start_controller(self) -> None:
        self.start("slurmctld", "head", "slurmctld", "-D", "-f", str(self.configuration))

    def end_controller(self) -> None:
        """Ends the controller with SIGTERM, and it saves its state. Without its state it would assign job
        numbers again, and drain the nodes that still run the old jobs."""
        self.processes.end("slurmctld")

    def lose_node(self, node: str) -> None:
        """Kills everything on a node and sets it down, as after a power failure. Without this command
        slurmctld would set it down after SlurmdTimeout."""
        self.hosts.lose_power(node)
        self.processes.kill(node)
        self.ask("scontrol", "update", f"NodeName={node}", "State=DOWN", "Reason=killed")

    def start_node(self, node: str) -> None:
        self.start(node, node, "slurmd", "-D", "-f", str(self.configuration))

    @property
    def environment(self) -> dict[str, str]:
        """The environment with which Slurm's commands find this cluster."""
        return {"SLURM_CONF": str(self.configuration)}

    def ask(self, *command: str) -> str:
        """The output of a Slurm command on the head."""
        done = subprocess.run(self.hosts.on("head", *command), capture_output=True, text=True,
                              env={**os.environ, **self.environment}, timeout=START_S)
        return done.stdout

    def list_states(self) -> dict[str, str]:
        """State of each node, by name."""
        lines = self.ask("sinfo", "--noheader", "--Node", "--format=%N %t").splitlines()
        return dict(line.split() for line in lines)

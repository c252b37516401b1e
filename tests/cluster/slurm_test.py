"""Campaigns on a real Slurm cluster give the table of the local engine, also if processes are killed."""

import signal
import subprocess
from pathlib import Path

from processes import kill, wait_until
from slurm_cluster import LIMIT_S, SlurmCluster

CLUSTER = SlurmCluster
SOON = "cluster.RETRY_AFTER_S=0.1"  # here a file is seen at once

# A gate that ends the process of a worker. On `head` it does not, because the launcher flies a run there first.
DEADLY = """

def gate(flight):
    import os
    return 0.0 if platform.node() == "head" else os._exit(9)
"""


def test_slurm_makes_the_table_of_the_local_engine(cluster, campaign):
    output = campaign.fly("plain", "--on", "slurm", **cluster.environment).expect(0)
    assert "chunks: 6, tasks: 6" in output
    assert campaign.table("plain") == campaign.table("local")
    assert campaign.machines("plain") == {"n1", "n2"}


def test_short_chunks_share_a_task(cluster, campaign):
    output = campaign.start(campaign.file.name, "--out", "shared", "--on", "slurm",
                            "--sbatch=--comment='two words' --nice", **cluster.environment).expect(0)
    assert "tasks: 1\n" in output  # all chunks together take less than a minute
    assert campaign.table("shared") == campaign.table("local")


def test_workers_limit_the_campaign_also_if_it_needs_several_arrays(cluster, campaign):
    campaign.hold()
    launched = campaign.fly("limited", "--on", "slurm", "--workers", "1", "--chunk-runs", "20",
                            changes="slurm.find_largest_array=lambda:2", **cluster.environment)
    wait_until(lambda: list(campaign.folder.glob("flying-*")), LIMIT_S, "a run waits")
    status = campaign.start("status", "limited", **cluster.environment).expect(0)
    assert "1 running" in status and "1 pending (Dependency)" in status, status
    campaign.release()
    launched.expect(0)
    assert campaign.table("limited") == campaign.table("local")


def find_worker(cluster, node):
    """Id of the process on `node` that flies a chunk."""
    for process in cluster.hosts.processes(node):
        command = Path(f"/proc/{process}/cmdline").read_bytes().split(b"\0")
        if b"sls.campaign.worker" in command:
            return process
    raise AssertionError(f"no worker on {node}")


def skip_delay(cluster):
    """Starts the tasks of a lost node again at once; Slurm would wait 120 s."""
    for line in cluster.ask("squeue", "--noheader", "--array", "--format=%i %r").splitlines():
        job, _, reason = line.partition(" ")
        if reason == "BeginTime":
            cluster.ask("scontrol", "update", f"JobId={job}", "StartTime=now")


def test_a_lost_node_and_a_killed_worker_change_nothing(cluster, campaign):
    campaign.hold()
    launched = campaign.fly("killed", "--on", "slurm", changes=SOON, **cluster.environment)
    campaign.wait_until_held("n1", "n2")
    status = campaign.start("status", "killed", **cluster.environment).expect(0)
    assert "4 running" in status and "2 pending (Resources)" in status, status
    kill(find_worker(cluster, "n2"))
    cluster.lose_node("n1")
    campaign.release()

    def is_over() -> bool:
        skip_delay(cluster)
        return not launched.is_running()
    wait_until(is_over, LIMIT_S, "the launcher ends")
    launched.expect(0, "submission 2 of 3")
    assert campaign.table("killed") == campaign.table("local")
    cluster.start_node("n1")
    cluster.ask("scontrol", "update", "NodeName=n1", "State=RESUME")
    wait_until(lambda: cluster.list_states()["n1"] == "idle", LIMIT_S, "n1 is idle")


def test_a_lost_controller_ends_the_campaign_with_a_line_and_resume_goes_on(cluster, campaign):
    campaign.hold()
    launched = campaign.fly("lost", "--on", "slurm", changes="slurm.LOST_AFTER_S=1",
                            **cluster.environment)
    campaign.wait_until_held("n1", "n2")
    cluster.end_controller()
    launched.expect(1, "slurm: the controller does not answer", "0 of 6 chunks", "--resume")
    campaign.release()
    cluster.start_controller()
    wait_until(lambda: cluster.ask("sinfo", "--noheader"), LIMIT_S, "slurmctld answers")
    campaign.fly("lost", "--on", "slurm", "--resume", **cluster.environment).expect(0)
    assert campaign.table("lost") == campaign.table("local")


def test_the_collect_job_makes_the_table_when_the_launcher_is_gone(cluster, campaign):
    campaign.hold()
    launched = campaign.fly("left", "--on", "slurm", **cluster.environment)
    campaign.wait_until_held("n1", "n2")
    launched.process.send_signal(signal.SIGTERM)
    launched.expect(143, "the jobs go on")
    kill(find_worker(cluster, "n2"))  # the collect job submits its chunk again
    campaign.release()
    wait_until((campaign.folder / "left/report.html").exists, LIMIT_S, "the collect job is done")
    assert campaign.table("left") == campaign.table("local")


def test_ctrl_c_cancels_the_jobs_and_another_engine_goes_on(cluster, campaign):
    campaign.hold()
    launched = campaign.fly("stopped", "--on", "slurm", **cluster.environment)
    campaign.wait_until_held("n1", "n2")
    launched.process.send_signal(signal.SIGINT)
    launched.expect(130, "--resume")
    campaign.release()
    wait_until(lambda: not cluster.ask("squeue", "--noheader"), LIMIT_S, "no job is left")
    campaign.fly("stopped", "--resume").expect(0)
    assert campaign.table("stopped") == campaign.table("local")


def test_a_run_that_ends_its_worker_is_named_after_the_last_submission(cluster, campaign):
    gate = campaign.folder / "gate.py"
    text = gate.read_text()
    gate.write_text(text + DEADLY)
    try:
        launched = campaign.fly("broken", "--on", "slurm", "--runs", "0-1",
                                changes=f"cluster.FILES_LATE_S=0.1 slurm.MOST_ROUNDS=2 {SOON}",
                                **cluster.environment)
        launched.expect(1, "1 chunks are missing after 2 submissions", "runs 0-1", "slurm")
    finally:
        gate.write_text(text)


def test_a_refusal_of_sbatch_is_reported(cluster, campaign):
    campaign.fly("refused", "--on", "slurm", "--sbatch=--partition=none",
                 **cluster.environment).expect(2, "--sbatch '--partition=none': ", "partition")
    campaign.fly("quoted", "--on", "slurm", "--sbatch=--comment='open",
                 **cluster.environment).expect(2, "--sbatch: expected")


def test_without_slurm_the_message_says_what_to_install_or_start(campaign, tmp_path):
    link_programs(tmp_path)
    campaign.fly("missing", "--on", "slurm", PATH=str(tmp_path)).expect(
        1, "not found: apt-get install slurm-client")
    campaign.fly("unset", "--on", "slurm", SLURM_CONF=str(tmp_path / "none.conf")).expect(
        1, "slurm: no cluster answers", "SLURM_CONF")


def link_programs(folder: Path) -> None:
    """Links the programs that the test hosts need, without Slurm, into `folder`."""
    for name in ("ip", "unshare", "sh", "hostname", "setpriv"):
        place = subprocess.run(["which", name], capture_output=True, text=True, check=True).stdout
        (folder / name).symlink_to(place.strip())

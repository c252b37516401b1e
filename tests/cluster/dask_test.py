"""Campaigns on a real Dask cluster give the table of the local engine, also if processes are killed."""

from campaigns import PATH
from dask_cluster import DaskCluster

CLUSTER = DaskCluster
FAST = "dask.CONNECT_S=1"


def test_dask_makes_the_table_of_the_local_engine(cluster, campaign):
    campaign.fly("plain", "--on", "dask", "--scheduler", cluster.address).expect(0)
    assert campaign.table("plain") == campaign.table("local")
    assert campaign.machines("plain") == {"n1", "n2"}


def test_the_chunk_of_a_killed_worker_goes_to_another_one(cluster, campaign):
    campaign.hold()
    launched = campaign.fly("killed", "--on", "dask", "--scheduler", cluster.address)
    campaign.wait_until_held("n1", "n2")
    cluster.processes.kill("n1")
    campaign.release()
    launched.expect(0)
    assert campaign.table("killed") == campaign.table("local")
    assert campaign.machines("killed") == {"n2"}
    cluster.start_worker("n1")


def test_a_campaign_waits_for_workers(cluster, campaign):
    campaign.hold()
    launched = campaign.fly("waited", "--on", "dask", "--scheduler", cluster.address)
    campaign.wait_until_held("n1", "n2")
    for worker in ("n1", "n2"):
        cluster.processes.kill(worker)
    campaign.release()
    for worker in ("n1", "n2"):
        cluster.start_worker(worker)
    launched.expect(0)
    assert campaign.table("waited") == campaign.table("local")


def test_a_lost_scheduler_ends_the_campaign_with_a_line_and_resume_goes_on(cluster, campaign):
    campaign.hold()
    launched = campaign.fly("lost", "--on", "dask", "--scheduler", cluster.address, changes=FAST)
    campaign.wait_until_held("n1", "n2")
    cluster.processes.kill("scheduler")
    launched.expect(1, "is lost; 0 of 6 chunks are in", "--resume")
    for worker in ("n1", "n2"):  # without a scheduler they would end later
        cluster.processes.kill(worker)
    campaign.release()
    cluster.start_scheduler()
    for worker in ("n1", "n2"):
        cluster.start_worker(worker)
    campaign.fly("lost", "--on", "dask", "--scheduler", cluster.address, "--resume").expect(0)
    assert campaign.table("lost") == campaign.table("local")


def test_without_dask_the_message_says_what_to_install_or_start(campaign, tmp_path):
    campaign.fly("none", "--on", "dask").expect(2, "--scheduler: expected", "dask-worker")
    address = f"tcp://{campaign.hosts.address['head']}:9"
    campaign.fly("closed", "--on", "dask", "--scheduler", address, changes=FAST).expect(
        1, f"dask: no scheduler at {address}", "dask-scheduler")
    campaign.fly("wrong", "--on", "dask", "--scheduler", "no address", changes=FAST).expect(
        2, "--scheduler: expected", "got 'no address'")
    (tmp_path / "distributed.py").write_text(
        "raise ModuleNotFoundError('No module', name='distributed')\n")
    campaign.fly("missing", "--on", "dask", "--scheduler", address, PYTHONPATH=f"{tmp_path}:{PATH}").expect(
        1, "'distributed' is missing: apt-get install python3-distributed")

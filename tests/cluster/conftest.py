"""The cluster of a test file, and a campaign on it."""

import pytest
from campaigns import TestCampaign
from hosts import Obstacle, TestHosts


@pytest.fixture(scope="module")
def cluster(request, tmp_path_factory):
    """A cluster of the kind CLUSTER of the test file. Every process is ended at its end."""
    try:
        with TestHosts("head", "n1", "n2") as hosts:
            started = request.module.CLUSTER(hosts, tmp_path_factory.mktemp("cluster"))
            try:
                started.start_all()
                yield started
            finally:
                started.processes.end_all()  # tasks that still run are killed when their hosts are removed
    except Obstacle as obstacle:
        pytest.skip(str(obstacle))


@pytest.fixture(scope="module")
def flown(cluster, tmp_path_factory):
    """The campaign, flown by the local engine in the folder `local`."""
    campaign = TestCampaign(cluster.hosts, tmp_path_factory.mktemp("campaign"))
    campaign.fly("local").expect(0)
    return campaign


@pytest.fixture
def campaign(cluster, flown):
    yield flown
    flown.release()
    cluster.end_jobs()

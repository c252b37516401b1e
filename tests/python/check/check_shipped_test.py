"""The shipped checks hold on their placements. Those that no other test flies as three programs also hold as three
programs."""

import json

import pytest

from sls.check.cli import main
from sls.scenario import ROOT

BY_THREE_PROGRAMS = ["fleet", "mission", "multirotor_geometric", "multirotor_setpoints", "rest_to_rest",
                     "rigid_figure_eight", "rotor_drag"]


@pytest.fixture(scope="module")
def certificates(tmp_path_factory):
    """Of the flights of all shipped checks where they say, by their names. Each check must hold."""
    json_file = tmp_path_factory.mktemp("shipped") / "json"
    assert main([str(ROOT / "config/checks"), "--jobs", "2", "--json", str(json_file)]) == 0, json_file.read_text()
    return read_certificates(json_file)


def read_certificates(json_file):
    flights = json.loads(json_file.read_text())["flights"]
    return {flight["check"]: flight["certificate"] for flight in flights if flight["verdict"] == "held"}


def test_every_shipped_check_holds(certificates):
    assert len(certificates) == len(list((ROOT / "config/scenarios").glob("*.yaml")))


def test_checks_hold_with_three_programs_as_in_process(certificates, tmp_path):
    code = main([*BY_THREE_PROGRAMS, "--placement", "shm", "--jobs", "2", "--json", str(tmp_path / "json")])
    assert code == 0, (tmp_path / "json").read_text()
    flown = read_certificates(tmp_path / "json")
    assert flown == {name: certificates[name] for name in BY_THREE_PROGRAMS}

"""The shipped checks hold: all where they say, and those by three programs that no other test flies so."""

from sls.check.cli import main
from sls.scenario import ROOT

BY_THREE_PROGRAMS = ["fleet", "mission", "multirotor_geometric", "multirotor_setpoints", "rest_to_rest",
                     "rigid_figure_eight", "rotor_drag"]


def test_every_shipped_check_holds(capsys):
    assert main([str(ROOT / "config/checks"), "--jobs", "2"]) == 0, capsys.readouterr()
    count = len(list((ROOT / "config/scenarios").glob("*.yaml")))
    assert f"{count} flights: {count} held" in capsys.readouterr().out


def test_checks_hold_with_three_programs_as_in_process(capsys):
    code = main([*BY_THREE_PROGRAMS, "--placement", "in-process,shm", "--jobs", "2"])
    assert code == 0, capsys.readouterr()
    assert "the flights of each check have equal bytes" in capsys.readouterr().out

"""Campaigns with a run that is impossible are refused before they fly."""

from types import SimpleNamespace

import campaign_support as support
import pytest

from sls.campaign.check import check_campaign
from sls.input_error import InputError


core = pytest.importorskip("_sls_core")


class Counted:
    """The checker `_sls_core.Runs` of a campaign, with the number of checked runs."""

    def __init__(self, campaign):
        self.runs = core.Runs(str(campaign.base), campaign.scenario_paths, list(campaign.measures))
        self.checked = 0

    def check(self, values):
        self.checked += 1
        self.runs.check(values)


def check(folder, text, make=Counted):
    """The message without the file (empty if the campaign is accepted), and the number of checked runs."""
    campaign = support.make_campaign(folder, text)
    checker = make(campaign)
    try:
        check_campaign(campaign, checker)
    except InputError as error:
        return str(error).removeprefix(f"{campaign.file}:"), checker.checked
    return "", checker.checked


def test_accepts_what_every_run_may_have(tmp_path):
    message, checked = check(tmp_path, """
runs: 10000
vary:
  _x: { uniform: [0, 1] }
  vehicle.load_mass_kg: { normal: [0.2, 0.02] }
  controller.saturate: { list: [true, false] }
""")
    assert message == ""
    assert checked <= 1 + 2 + 2  # run 0, the extremes of the mass, both values


@pytest.mark.parametrize("text, expected", [
    ("runs: 9\nvary:\n  vehicle.load_mas_kg: { uniform: [1, 2] }\n",
     "4: vary.vehicle.load_mas_kg: run 0: unknown key; did you mean 'load_mass_kg'?"),
    ("vary:\n  vehicle.load_mass_kg: { grid: [0.2, -0.2, 5] }\n",
     "3: vary.vehicle.load_mass_kg: run 2: expected > 0, got 0.0"),
    ("vary:\n  vehicle.load_mass_kg: { list: [0.2, -0.1, 0.3, -0.2] }\n",
     "3: vary.vehicle.load_mass_kg: run 1: expected > 0, got -0.1"),
    ("vary:\n  _x: { grid: [0, 1, 5] }\n  faults.0.noise.position_m: { derived: [0.1, 0.5 - _x, 0] }\n",
     "4: vary.faults.0.noise.position_m: run 3: faults[0].noise.position_m[1]: expected >= 0, got -0.25"),
    ("vary:\n  faults.2.delay.by_s: { list: [0.004, 0.008, 0.0085] }\n",
     "3: vary.faults.2.delay.by_s: run 2: expected a multiple of sync.period_s (0.004), got 0.0085"),
    ("vary:\n  controller.saturate: { list: [true, false, text] }\n",
     "3: vary.controller.saturate: run 2: expected true or false, got \"text\""),
    ("vary:\n  faults.0.noise.position_m.1: { grid: [0, 0.1, 3] }\n", ""),
    ("vary:\n  vehicles: { list: [1, 2] }\n", "3: vary.vehicles: run 1: expected 1, as in the base scenario, got 2"),
    ("vary:\n  controller.law: { list: [qsf, text] }\n", "3: vary.controller.law: run 1: "
     "expected cooperative, pid, qsf or a shared library (a path ending in .so), got \"text\""),
    ("vary:\n  faults.7.delay.by_s: { list: [0.004] }\n",
     "3: vary.faults.7.delay.by_s: run 0: faults: expected one of the list's items, 0 to 2, got 7 "
     "on the way to faults.7.delay.by_s"),
])
def test_names_key_line_and_first_run(tmp_path, text, expected):
    message, _ = check(tmp_path, text)
    assert message == expected


def test_a_message_without_a_key_is_of_all_that_varies(tmp_path):
    def refuse(values):
        raise ValueError("something else is wrong")

    made = SimpleNamespace(check=refuse, checked=0)
    message, _ = check(tmp_path, "vary:\n  name: { list: [a] }\n", lambda campaign: made)
    assert message == " vary: run 0: something else is wrong"


def test_finds_the_one_run_of_a_normal_distribution_that_is_impossible(tmp_path):
    """0 is 5 deviations below the mean in the first campaign and 2.5 in the second."""
    text = "runs: 10000\nvary:\n  vehicle.load_mass_kg: {{ normal: [0.2, {}] }}\n"
    assert check(tmp_path, text.format(0.04))[0] == ""
    message, checked = check(tmp_path, text.format(0.08))
    run = int(message.split("run ")[1].split(":")[0])
    # P(x <= 0) is 0.0062: the first one comes before run 2000, except in one of 250,000 campaigns.
    assert run < 2000
    assert "expected > 0, got -" in message
    assert checked <= run + 4

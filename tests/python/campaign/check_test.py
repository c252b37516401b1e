"""Campaigns with a run that is impossible are refused before they fly."""

import campaign_support as support
import pytest
import yaml

from sls.campaign.check import check_campaign
from sls.input_error import InputError


class Checker:
    """Replaces `_sls_core.Runs`: it has some rules of the scenario reader, and counts checks."""

    def __init__(self, campaign):
        self.paths = campaign.scenario_paths
        self.checked = 0

    def check(self, values):
        self.checked += 1
        for path, text in zip(self.paths, values, strict=True):
            value = yaml.safe_load(text)
            if path == "vehicle.load_mas_kg":
                raise ValueError("base.yaml:3: vehicle.load_mas_kg: unknown key; did you mean "
                                 "'load_mass_kg'?")
            if path == "vehicle.load_mass_kg" and not value > 0:
                raise ValueError(f"base.yaml:3: vehicle.load_mass_kg: expected > 0, got {value}")
            if path == "controller.law" and value not in ("pid", "qsf"):
                raise ValueError(f"base.yaml:6: controller.law: expected pid or qsf, got {value}")
            if path == "plant.wind_m_s" and not value[1] < 0.99:
                raise ValueError(f"base.yaml:4: plant.wind_m_s[1]: expected < 0.99, got {value[1]}")
            if path == "faults.7.delay.by_s":
                raise ValueError("base.yaml:10: faults: expected one of the list's items, 0 to 2, "
                                 "got 7 on the way to faults.7.delay.by_s")
            if path == "name":
                raise ValueError("something else is wrong")


def check(folder, text):
    """The message without the file (empty if the campaign is accepted), and the number of checked runs."""
    campaign = support.make_campaign(folder, text)
    checker = Checker(campaign)
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
  controller.law: { list: [pid, qsf] }
""")
    assert message == ""
    assert checked <= 1 + 2 + 2  # run 0, the extremes of the mass, both laws


@pytest.mark.parametrize("text, expected", [
    ("runs: 9\nvary:\n  vehicle.load_mas_kg: { uniform: [1, 2] }\n",
     "4: vary.vehicle.load_mas_kg: run 0: unknown key; did you mean 'load_mass_kg'?"),
    ("vary:\n  vehicle.load_mass_kg: { grid: [0.2, -0.2, 5] }\n",
     "3: vary.vehicle.load_mass_kg: run 2: expected > 0, got 0.0"),
    ("vary:\n  vehicle.load_mass_kg: { list: [0.2, -0.1, 0.3, -0.2] }\n",
     "3: vary.vehicle.load_mass_kg: run 1: expected > 0, got -0.1"),
    ("vary:\n  controller.law: { list: [pid, qsf, lqr] }\n",
     "3: vary.controller.law: run 2: expected pid or qsf, got lqr"),
    ("vary:\n  _x: { grid: [0, 1, 11] }\n  plant.wind_m_s: { derived: [0, _x, 0] }\n",
     "4: vary.plant.wind_m_s: run 10: plant.wind_m_s[1]: expected < 0.99, got 1.0"),
    ("vary:\n  faults.7.delay.by_s: { list: [0.004] }\n",
     "3: vary.faults.7.delay.by_s: run 0: faults: expected one of the list's items, 0 to 2, got 7 "
     "on the way to faults.7.delay.by_s"),
    ("vary:\n  name: { list: [a] }\n", " vary: run 0: something else is wrong"),
])
def test_names_key_line_and_first_run(tmp_path, text, expected):
    message, _ = check(tmp_path, text)
    assert message == expected


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


def test_the_extension_knows_the_rules(tmp_path):
    """Uses the real checker, if it is built."""
    core = pytest.importorskip("_sls_core")
    if not hasattr(core, "Runs"):
        pytest.skip("no Runs in this build")
    for text, expected in [
        ("runs: 9\nvary:\n  vehicle.load_mas_kg: { uniform: [1, 2] }\n",
         "4: vary.vehicle.load_mas_kg: run 0: unknown key; did you mean 'load_mass_kg'?"),
        ("vary:\n  vehicle.load_mass_kg: { list: [0.2, -0.1] }\n",
         "3: vary.vehicle.load_mass_kg: run 1: expected > 0, got -0.1"),
        ("vary:\n  faults.2.delay.by_s: { list: [0.004, 0.008, 0.0085] }\n",
         "3: vary.faults.2.delay.by_s: run 2: expected a multiple of sync.period_s (0.004), got "
         "0.0085"),
        ("vary:\n  faults.0.noise.position_m.1: { grid: [0, 0.1, 3] }\n", None),
        ("vary:\n  controller.law: { list: [qsf, text] }\n", "3: vary.controller.law: run 1: "),
    ]:
        campaign = support.make_campaign(tmp_path, text)
        runs = core.Runs(str(campaign.base), campaign.scenario_paths, list(campaign.measures))
        if expected is None:
            check_campaign(campaign, runs)
            continue
        with pytest.raises(InputError) as error:
            check_campaign(campaign, runs)
        assert str(error.value).startswith(f"{campaign.file}:{expected}")

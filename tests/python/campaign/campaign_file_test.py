"""Valid and refused campaign files."""

import re
import shutil
import textwrap

import campaign_support as support
import pytest
import yaml
from places import ROOT

from sls.campaign.campaign import Certify, Keep
from sls.campaign.campaign_file import load_campaign
from sls.campaign.sampling import make_values
from sls.input_error import InputError

SEEDS = "runs: 3\nseeds: [faults.0.noise.seed]\n"


def read_invalid_campaigns():
    """(text, message) of each row of invalid_campaigns.txt."""
    base = lines = ""
    in_base = False
    for line in (support.HERE / "invalid_campaigns.txt").read_text().splitlines(keepends=True):
        if line.startswith("== "):
            base, in_base = "", True
        elif line == "\n":
            in_base = False
        elif in_base:
            base += line
        elif line.startswith("! "):
            yield base + lines, line[2:-1]
            lines = ""
        elif not line.startswith("#"):
            lines += line


@pytest.mark.parametrize(("text", "expected"), list(read_invalid_campaigns()))
def test_refuses_with_file_line_and_key(tmp_path, text, expected):
    for name in ("base.yaml", "own.py"):
        shutil.copy(support.HERE / name, tmp_path)
    file = tmp_path / "campaign.yaml"
    file.write_bytes(text.replace(r"\xe9", "\xe9").encode("latin1"))
    place = f"{file}:" if expected[0].isdigit() else ""
    with pytest.raises(InputError) as error:
        load_campaign(file)
    message = str(error.value)
    assert "\n" not in message
    assert message == place + expected if place else message.endswith(expected)


def test_names_a_campaign_that_is_not_there(tmp_path):
    with pytest.raises(InputError, match="nowhere.yaml: expected a campaign, got no file"):
        load_campaign(tmp_path / "nowhere.yaml")


def test_names_the_line_of_a_base_scenario_that_is_no_yaml(tmp_path):
    (tmp_path / "base.yaml").write_text("name: a\nvehicle: {\n")
    file = tmp_path / "campaign.yaml"
    file.write_text("base: base.yaml\n" + SEEDS)
    with pytest.raises(InputError, match=r"base.yaml:3: expected YAML, got a syntax error"):
        load_campaign(file)


def test_reads_the_example_of_the_design(tmp_path):
    campaign = support.make_campaign(tmp_path, """
runs: 10000
vary:
  vehicle.load_mass_kg: { normal: [0.2, 0.02], seed: 1 }
  controller.gains.lqr.horizontal: { list: [5, 10, 20] }
measure: [load_error_rms, load_error_max, settling, overshoot, tilt_max, force_max, outcome]
keep: { worst: 5, by: load_error_max }
certify: { some: 10, seed: 4 }
period_s: 0.002
""")
    assert campaign.name == "campaign"
    assert campaign.runs == 10000
    assert campaign.points == 3
    assert campaign.draws == 3334
    assert campaign.paths == ["vehicle.load_mass_kg", "controller.gains.lqr.horizontal"]
    assert campaign.measures == ("load_error_rms", "load_error_max", "settling", "overshoot",
                                 "tilt_max", "force_max")
    assert campaign.keep == Keep("worst", 5, "load_error_max")
    assert campaign.certify == Certify("some", 10, 4)
    assert campaign.period_s == 0.002
    assert campaign.varied[0].line == 5


def test_the_examples_of_the_readme_are_campaigns(tmp_path):
    readme = ROOT / "config/campaigns/README.md"
    blocks = re.findall(r"(?:^    .*\n)+", readme.read_text(), re.MULTILINE)
    first, *others = [textwrap.dedent(block) for block in blocks]
    scenarios = readme.parents[1] / "scenarios"
    file = tmp_path / "campaign.yaml"
    file.write_text(first.replace("../scenarios", str(scenarios)))
    assert load_campaign(file).runs == 10000
    derived, = (block for block in others if block.startswith("vary:"))
    file.write_text(f"base: {scenarios / 'figure_eight.yaml'}\nruns: 5\n" + derived)
    assert len(make_values(load_campaign(file), 0, 4)) == 5


def test_has_defaults(tmp_path):
    campaign = support.make_campaign(tmp_path, SEEDS)
    assert len(campaign.measures) == 7  # without the outcome, which every campaign has
    assert campaign.keep == Keep("none")
    assert campaign.certify == Certify("all")
    assert campaign.period_s is None


def test_keeps_own_measures(tmp_path):
    shutil.copy(support.HERE / "own.py", tmp_path)
    campaign = support.make_campaign(tmp_path, SEEDS + """
measure:
  - tilt_max
  - { python: own.py, function: peak, columns: [peak_power_w, "mean_power_w"] }
keep: { worst: 1, by: mean_power_w }
""")
    own, = campaign.own_measures
    assert own.file == tmp_path / "own.py"
    assert (own.function, own.columns) == ("peak", ("peak_power_w", "mean_power_w"))


def test_finds_the_column_to_keep_the_worst_by():
    columns = ["load_error_max_m", "load_error_max_x_m", "stage_0_settling_x_s", "overshoot"]
    assert Keep("worst", 1, "load_error_max").find_column(columns) == "load_error_max_m"
    assert Keep("worst", 1, "stage_0_settling_x_s").find_column(columns) == "stage_0_settling_x_s"
    assert Keep("worst", 1, "overshoot").find_column(columns) == "overshoot"
    assert Keep("worst", 1, "settling").find_column(columns) is None


def test_the_hash_covers_campaign_base_and_own_measures(tmp_path):
    for name in ("base.yaml", "own.py"):
        shutil.copy(support.HERE / name, tmp_path)
    file = tmp_path / "campaign.yaml"
    file.write_text("base: base.yaml\n" + SEEDS
                    + "measure: [{ python: own.py, function: peak, columns: [a] }]\n")
    hashes = {load_campaign(file).sha256}
    for changed in (file, tmp_path / "base.yaml", tmp_path / "own.py"):
        changed.write_text(changed.read_text() + "# one more line\n")
        hashes.add(load_campaign(file).sha256)
    assert len(hashes) == 4


def test_a_copy_elsewhere_is_the_same_campaign(tmp_path):
    file = support.write_campaign(tmp_path, SEEDS)
    copy = tmp_path / "copy"
    copy.mkdir()
    shutil.copy(file, copy / "campaign.yaml")
    shutil.copy(support.HERE / "base.yaml", copy / "base.yaml")
    original = load_campaign(file)
    moved = load_campaign(copy / "campaign.yaml", base=copy / "base.yaml")
    assert moved.sha256 == original.sha256
    assert moved.base == copy / "base.yaml"


def test_reads_numbers_as_yaml_does(tmp_path):
    text = "[1, -2, 0.1, 1.0e-5, 3.5e+2, .5, true, false, abc, \"1\", [1, [2.5, x]], { a: 1 }]"
    campaign = support.make_campaign(tmp_path, f"vary: {{ controller.x: {{ list: {text} }} }}\n")
    tuples = [tuple(map(_to_tuple, yaml.safe_load(text)))]
    assert [campaign.varied[0].items] == tuples
    assert list(map(type, campaign.varied[0].items)) == list(map(type, tuples[0]))


def _to_tuple(value):
    return tuple(map(_to_tuple, value)) if isinstance(value, list) else value

"""The values of runs: distributions agree with closed forms and the generator with its definition. Run i
always has the same values, independent of other runs, chunks and keys."""

import hashlib
import itertools
import math
import os
import random
import struct
import subprocess
import sys
import tracemalloc

import campaign_support as support
import numpy as np
import pytest
import yaml
from scipy import stats

from sls.campaign.portable_math import calc_normal_cdf, calc_normal_quantile, exp, log
from sls.campaign.sampling import choose_runs, is_certified, make_values
from sls.scenario import to_yaml_value
from sls.campaign.yaml_nodes import parse_yaml
from sls.input_error import InputError

DRAWS = 20_000
EVERYTHING = """
  _uniform: { uniform: [-1, 3], seed: 1 }
  _normal: { normal: [0.2, 0.02], seed: 1 }
  _cut: { normal: [0.2, 0.1], within: [0.1, 0.5], seed: 1 }
  _log: { log_uniform: [0.01, 100], seed: 1 }
  _latin: { latin_hypercube: [2, 5], seed: 1 }
  _latin_normal: { latin_hypercube: { normal: [1, 2] }, seed: 1 }
  _sobol: { sobol: [0, 1], seed: 1 }
  _sobol_log: { sobol: { log_uniform: [1, 10] }, seed: 1 }
  _derived: { derived: "_uniform * 2 + max(_normal, 0)" }
  vehicle.load_mass_kg: { derived: 1.1 * vehicle.quad_mass_kg }
  faults.2.delay.by_s: { uniform: [0, 0.08], multiple_of: 0.004, seed: 1 }
seeds: [faults.0.noise.seed, faults.1.noise.seed]
"""


def make(folder, vary, runs=DRAWS):
    head = "" if runs is None else f"runs: {runs}\n"
    return support.make_campaign(folder, f"{head}vary:\n{vary}\n")


def draw(folder, spec, runs=DRAWS, path="_x"):
    campaign = make(folder, f"  {path}: {{ {spec} }}", runs)
    return np.array([row[0] for row in make_values(campaign, 0, runs - 1)])


# --- Distributions -------------------------------------------------------------------------------

@pytest.mark.parametrize("spec, distribution", [
    ("uniform: [-1, 3]", stats.uniform(-1, 4)),
    ("normal: [0.2, 0.02]", stats.norm(0.2, 0.02)),
    ("normal: [0.2, 0.1], within: [0.1, 0.5]", stats.truncnorm(-1, 3, 0.2, 0.1)),
    ("normal: [0, 1], within: [9, 10]", stats.truncnorm(9, 10)),
    ("normal: [0, 1], within: [-10, -1]", stats.truncnorm(-10, -1)),
    ("log_uniform: [0.01, 100]", stats.loguniform(0.01, 100)),
    ("latin_hypercube: [2, 5]", stats.uniform(2, 3)),
    ("latin_hypercube: { normal: [1, 2] }", stats.norm(1, 2)),
    ("sobol: [0, 1]", stats.uniform()),
    ("sobol: { log_uniform: [1, 10] }", stats.loguniform(1, 10)),
])
def test_has_its_distribution(tmp_path, spec, distribution):
    """Test of Kolmogorov and Smirnov. The seeds are fixed: it always has the same result."""
    assert stats.kstest(draw(tmp_path, f"{spec}, seed: 7"), distribution.cdf).pvalue > 1e-3


@pytest.mark.parametrize("spec, least, most", [
    ("uniform: [0.1, 0.3]", 0.1, 0.3),
    ("normal: [0.2, 10], within: [0.1, 0.3]", 0.1, 0.3),
    ("normal: [0, 1], within: [9, 10]", 9, 10),
    ("normal: [0, 1], within: [90, 100]", 90, 100),
    ("log_uniform: [0.1, 0.3]", 0.1, 0.3),
    ("sobol: [0.1, 0.3]", 0.1, 0.3),
    ("latin_hypercube: [0.1, 0.3]", 0.1, 0.3),
    ("uniform: [0.1, 0.1000000000000001]", 0.1, 0.1000000000000001),
])
def test_stays_within_its_bounds(tmp_path, spec, least, most):
    samples = draw(tmp_path, spec, 2000)
    assert samples.min() >= least
    assert samples.max() <= most


def test_different_keys_and_seeds_are_independent(tmp_path):
    columns = [draw(tmp_path, f"{kind}: [0, 1], seed: {seed}", path=path)
               for kind in ("uniform", "latin_hypercube") for seed in (0, 1)
               for path in ("_x", "_y")]
    for a, b in itertools.combinations(columns, 2):
        # The correlation of independent samples has standard deviation 1/√n; there are 28 pairs.
        assert abs(np.corrcoef(a, b)[0, 1]) < 4 / math.sqrt(DRAWS)


@pytest.mark.parametrize("runs", [1, 2, 7, 1000, 10_000])
def test_a_latin_hypercube_has_one_draw_in_each_stratum(tmp_path, runs):
    campaign = make(tmp_path, f"""
  _a: {{ latin_hypercube: [0, {runs}] }}
  _b: {{ latin_hypercube: [0, {runs}], seed: 5 }}""", runs)
    for column in zip(*make_values(campaign, 0, runs - 1)):
        assert sorted(map(int, column)) == list(range(runs))


# --- The generator, by its definition ------------------------------------------------------------

def calc_word(purpose, path, number, seed=1):
    digest = hashlib.sha256("\0".join(["sls campaign 1", purpose, str(seed), path]).encode()).digest()
    return int(np.random.Philox(key=np.frombuffer(digest[:16], "<u8"), counter=number // 4).random_raw(4)[number % 4])


def calc_unit(path, number, seed=1):
    return ((calc_word("unit", path, number, seed) >> 12) + 0.5) / 2**52


def calc_sobol(coordinate, number):
    """30 digits of a point of Sobol's sequence in the order of the Gray code. Primitive polynomials and
    first direction numbers of the first four coordinates: Joe and Kuo (2008), new-joe-kuo-6."""
    degree, inner, m = ((0, 0, [1] * 30), (1, 0, [1]), (2, 1, [1, 3]), (3, 1, [1, 3, 1]))[coordinate]
    while len(m) < 30:
        new = m[-degree] ^ m[-degree] << degree
        for k in range(1, degree):
            new ^= (inner >> degree - 1 - k & 1) * m[-k] << k
        m = [*m, new]
    gray, point = number ^ number >> 1, 0
    for bit in range(30):
        if gray >> bit & 1:
            point ^= m[bit] << 29 - bit
    return point


def test_uniform_numbers_are_those_of_philox(tmp_path):
    campaign = make(tmp_path, "  _x: { uniform: [0, 1], seed: 42 }", 10_000_000)
    for run in (0, 1, 2, 3, 4, 5, 1001, 9_999_999):
        assert make_values(campaign, run, run) == [[calc_unit("_x", run, 42)]]


def test_each_kind_transforms_the_words_of_philox_by_its_formula(tmp_path):
    runs = 200
    campaign = make(tmp_path, EVERYTHING, runs)
    values = dict(zip(campaign.paths, zip(*make_values(campaign, 0, runs - 1))))
    strata = sorted(range(runs), key=lambda run: calc_word("strata", "_latin", run))
    below, above = calc_normal_cdf((0.1 - 0.2) / 0.1), calc_normal_cdf((0.5 - 0.2) / 0.1)
    for run in range(runs):
        u = {path: calc_unit(path, run) for path in values}
        assert values["_uniform"][run] == -1 + u["_uniform"] * 4
        assert values["_normal"][run] == 0.2 + 0.02 * calc_normal_quantile(u["_normal"])
        share = below + u["_cut"] * (above - below)
        assert values["_cut"][run] == 0.2 + 0.1 * calc_normal_quantile(share)
        assert values["_log"][run] == exp(log(0.01) + u["_log"] * (log(100.0) - log(0.01)))
        jitter = ((calc_word("jitter", "_latin", run) >> 36) + 0.5) / 2**28
        assert values["_latin"][run] == 2 + (strata[run] + jitter) / runs * 3


@pytest.mark.parametrize("coordinate", range(4))
def test_points_of_sobol_do_not_depend_on_the_version_of_scipy(tmp_path, coordinate):
    vary = "\n".join(f"  _{i}: {{ sobol: [0, 1], seed: 1 }}" for i in range(4))
    values = make_values(make(tmp_path, vary, 5000), 0, 4999)
    shift = calc_word("shift", f"_{coordinate}", 0) >> 34
    for run in (*range(70), 4095, 4096, 4999):
        assert values[run][coordinate] == ((calc_sobol(coordinate, run) ^ shift) + 0.5) / 2**30


PRINT_DIGEST = """
import hashlib, sys
from pathlib import Path
from sls.campaign.campaign_file import load_campaign
from sls.campaign.sampling import make_values
from sls.scenario import to_yaml_value
text = "".join(map(to_yaml_value, make_values(load_campaign(Path(sys.argv[1])), 0, 1999)))
print(hashlib.sha256(text.encode()).hexdigest())
"""


@pytest.mark.parametrize("tunables", ["", "glibc.cpu.hwcaps=-AVX2,-FMA,-FMA4,-AVX"])
def test_all_values_are_the_same_on_every_machine(tmp_path, tunables):
    """The C library chooses its functions by the processor; the second time it is told to use others.
    The functions behind the values are judged in portable_math_test.py, the streams above."""
    file = support.write_campaign(tmp_path, "runs: 2000\nvary:\n" + EVERYTHING.replace("\nseeds", """
  _gust: { derived: "[_log * sin(9 * _uniform), exp(_normal), tan(_cut), log(_log), _latin ** 1.5]" }
  _grid: { grid: { from: 0.001, to: 3, values: 5, log: true } }
seeds""").replace('"[', "[").replace(']"', "]"))
    result = subprocess.run([sys.executable, "-B", "-c", PRINT_DIGEST, file], text=True, timeout=60,
                            env={**os.environ, "GLIBC_TUNABLES": tunables}, stdout=subprocess.PIPE)
    assert result.stdout.strip() == (
        "7d0f1f306245b5daa9633af2d67381030f46f3082562d413ee2837135b74cea6")


# --- Run i is run i ------------------------------------------------------------------------------

def test_values_do_not_depend_on_chunks_and_order(tmp_path):
    runs = 300
    campaign = make(tmp_path, EVERYTHING, runs)
    whole = make_values(campaign, 0, runs - 1)
    generator = random.Random(1)
    chunks = [(first, min(first + size - 1, runs - 1)) for size in (1, 3, 4, 7, 64, 299)
              for first in range(0, runs, size)]
    generator.shuffle(chunks)
    for first, last in chunks:
        assert make_values(campaign, first, last) == whole[first:last + 1]


def test_another_key_changes_no_other(tmp_path):
    vary, seeds = EVERYTHING.split("seeds:")
    lines = vary.strip("\n").split("\n")
    whole = make(tmp_path, EVERYTHING, 50)
    expected = dict(zip(whole.paths, zip(*make_values(whole, 0, 49))))
    more = "  _new: { uniform: [0, 1], seed: 1 }\n  _newer: { latin_hypercube: [0, 1], seed: 1 }"
    changed = [
        "\n".join([more, *lines]),
        "\n".join(reversed(lines)).replace("_sobol", "_sobel"),  # values of sobol keys depend on their order
        *("\n".join(lines[:i] + lines[i + 1:]) for i in (1, 2, 3, 4, 5, 7, 8, 9, 10)),
    ]
    for vary in changed:
        if "  _normal:" not in vary:
            vary = "\n".join(line for line in vary.split("\n") if "_derived" not in line)
        campaign = make(tmp_path, vary + "\nseeds:" + seeds, 50)
        values = dict(zip(campaign.paths, zip(*make_values(campaign, 0, 49))))
        for path in values.keys() & expected.keys():
            assert values[path] == expected[path], path


def test_another_number_of_runs_changes_latin_hypercubes_alone(tmp_path):
    few, many = make(tmp_path, EVERYTHING, 50), make(tmp_path, EVERYTHING, 100)
    for path, a, b in zip(few.paths, zip(*make_values(few, 0, 49)), zip(*make_values(many, 0, 49))):
        assert (a == b) == ("latin" not in path), path


def test_refuses_runs_that_there_are_not(tmp_path):
    campaign = make(tmp_path, "  _x: { uniform: [0, 1] }", 10)
    for first, last in ((-1, 3), (0, 10), (5, 4)):
        with pytest.raises(InputError, match="expected runs within 0 to 9, got"):
            make_values(campaign, first, last)


def test_a_long_campaign_needs_little_memory(tmp_path):
    campaign = make(tmp_path, EVERYTHING, 100_000)
    tracemalloc.start()
    for first in (0, 50_000, 99_000):
        make_values(campaign, first, first + 999)
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert most < 20e6


# --- Grids, lists, draws -------------------------------------------------------------------------

def test_grids_and_lists_are_crossed(tmp_path):
    campaign = make(tmp_path, """
  vehicle.load_mass_kg: { grid: [0.1, 0.3, 5] }
  controller.law: { list: [qsf, pid] }
  sync.wait_for.controllers: { grid: { from: 1, to: 3, values: 3 } }""", None)
    assert campaign.runs == 30
    expected = itertools.product((0.1, 0.15, 0.2, 0.25, 0.3), ("qsf", "pid"), (1, 2, 3))
    values = make_values(campaign, 0, 29)
    assert values == [list(point) for point in expected]
    assert isinstance(values[0][2], int)


def test_each_draw_is_flown_at_every_point(tmp_path):
    campaign = make(tmp_path, """
  controller.law: { list: [qsf, pid] }
  _x: { uniform: [0, 1], seed: 1 }
  vehicle.load_mass_kg: { list: [0.1, 0.2, 0.3] }
seeds: [faults.0.noise.seed]""", 20)
    alone = make(tmp_path, "  _x: { uniform: [0, 1], seed: 1 }", 4)
    assert (campaign.points, campaign.draws) == (6, 4)
    points = list(itertools.product(("qsf", "pid"), (0.1, 0.2, 0.3)))
    for run, (law, x, mass, seed) in enumerate(make_values(campaign, 0, 19)):
        assert (law, mass) == points[run % 6]
        assert [x] == make_values(alone, run // 6, run // 6)[0]
        assert seed == 3 + run // 6  # 3 is the seed in the base scenario


def test_a_grid_is_rounded_once(tmp_path):
    """A delay must be a multiple of the period, in whole nanoseconds."""
    campaign = make(tmp_path, "  faults.2.delay.by_s: { grid: [0, 0.4, 101] }", None)
    assert [row[0] for row in make_values(campaign, 0, 100)] == [i * 4 / 1000 for i in range(101)]


def test_a_logarithmic_grid_has_equal_ratios(tmp_path):
    grid = "{ from: 0.001, to: 1000, values: 7, log: true }"
    campaign = make(tmp_path, f"  _x: {{ grid: {grid} }}", None)
    values = [row[0] for row in make_values(campaign, 0, 6)]
    assert values == pytest.approx([10.0**i for i in range(-3, 4)], rel=1e-14)
    assert (values[0], values[-1]) == (0.001, 1000.0)


def test_a_list_keeps_its_types(tmp_path):
    items = '[1, 1.0, true, text, "2", [1, 2.5], { c: 1 }]'
    campaign = make(tmp_path, f"  a.b: {{ list: {items} }}", None)
    values = [row[0] for row in make_values(campaign, 0, 6)]
    assert values == [1, 1.0, True, "text", "2", (1, 2.5), {"c": 1}]
    assert [type(value) for value in values[:4]] == [int, float, bool, str]


def test_noise_seeds_count_up_from_the_scenario(tmp_path):
    campaign = make(tmp_path, EVERYTHING, 10)
    assert campaign.seeds == ("faults.0.noise.seed", "faults.1.noise.seed")
    assert [row[-2:] for row in make_values(campaign, 0, 9)] == [[3 + i, i] for i in range(10)]


def test_rounds_to_multiples(tmp_path):
    samples = draw(tmp_path, "uniform: [0, 0.08], multiple_of: 0.004")
    counts = dict(zip(*np.unique(samples, return_counts=True)))
    assert sorted(counts) == [i * 4 / 1000 for i in range(21)]
    # The ends occur half as often: binomial, n = 20,000, p = 1/40 (ends) and 1/20.
    assert abs(counts[0.0] - 500) < 4 * math.sqrt(500)
    assert abs(counts[0.04] - 1000) < 4 * math.sqrt(1000)
    whole = make(tmp_path, "  _x: { uniform: [0, 9], multiple_of: 3 }", 50)
    values = [row[0] for row in make_values(whole, 0, 49)]
    assert set(values) == {0, 3, 6, 9}
    assert all(isinstance(value, int) for value in values)


# --- Runs that are chosen ------------------------------------------------------------------------

def test_chooses_runs_without_repetition_and_evenly():
    counts = np.zeros(50)
    for seed in range(2000):
        chosen = choose_runs(50, 5, seed)
        assert len(set(chosen)) == 5
        assert chosen == sorted(chosen)
        counts[chosen] += 1
    # Each run is chosen with probability 1/10: binomial, n = 2000; 50 of them.
    assert np.max(np.abs(counts - 200)) < 4 * math.sqrt(2000 * 0.1 * 0.9)
    assert choose_runs(50, 5, 1) != choose_runs(50, 5, 1, purpose="verify")
    assert choose_runs(7, 7, 1) == list(range(7))


@pytest.mark.parametrize("certify, expected", [("all", 40), ("none", 0), ("7", 7),
                                               ("{ some: 40, seed: 2 }", 40)])
def test_certifies_as_many_runs_as_asked_for(tmp_path, certify, expected):
    campaign = make(tmp_path, "  _x: { uniform: [0, 1] }\ncertify: " + certify, 40)
    assert sum(is_certified(campaign, run) for run in range(40)) == expected


# --- Derived values ------------------------------------------------------------------------------

def test_derives_values_in_any_order(tmp_path):
    campaign = make(tmp_path, """
  plant.wind_m_s: { derived: [_speed * cos(_angle), _speed * sin(_angle), 0] }
  _speed: { derived: 2 * _half }
  _half: { uniform: [0, 2], seed: 1 }
  _angle: { uniform: [0, 6.28], seed: 1 }
  controller.model.rod_length_m: { derived: "vehicle.rod_length_m * 1.1" }
  sync.wait_for.controllers: { derived: 1 + 3 * _half, multiple_of: 1 }""", 50)
    assert campaign.scenario_paths == ["plant.wind_m_s", "controller.model.rod_length_m",
                                       "sync.wait_for.controllers"]
    for row in make_values(campaign, 0, 49):
        wind, speed, half, angle, length, controllers = row
        assert speed == 2 * half
        assert wind == [speed * math.cos(angle), speed * math.sin(angle), 0.0]
        assert length == 1.0 * 1.1  # 1.0: the value in the base scenario
        assert isinstance(controllers, int) and abs(controllers - 1 - 3 * half) <= 0.5
        assert campaign.pick_scenario_values(row) == [wind, length, controllers]


def test_names_the_run_of_a_division_by_zero(tmp_path):
    campaign = make(tmp_path, """
  _x: { grid: [-2, 2, 5] }
  vehicle.load_mass_kg: { derived: 1 / _x }""", None)
    with pytest.raises(InputError) as error:
        make_values(campaign, 0, 4)
    assert str(error.value) == (f"{campaign.file}:5: vary.vehicle.load_mass_kg: run 2: division by "
                                "zero in '1 / _x'")
    assert make_values(campaign, 3, 4) == [[1, 1.0], [2, 0.5]]


# --- Text ----------------------------------------------------------------------------------------

def list_floats():
    generator = random.Random(5)
    floats = [struct.unpack("<d", generator.randbytes(8))[0] for _ in range(5000)]
    yield from (number for number in floats if math.isfinite(number))
    yield from (0.0, -0.0, 1e22, 1e16, 1e15, 123456789012345680.0, 1e-5, 1e-4, 5e-324, 0.1, -2.0,
                1.7976931348623157e308)


@pytest.mark.parametrize("read", [
    yaml.safe_load,
    lambda text: parse_yaml(text.encode(), support.HERE / "base.yaml").find_scalar(),
], ids=["PyYAML", "campaign files"])
def test_numbers_read_back_to_the_same_bits(read):
    for number in list_floats():
        value = read(to_yaml_value(number))
        assert isinstance(value, float)
        assert struct.pack("<d", value) == struct.pack("<d", number)


@pytest.mark.parametrize("value", [
    0, -3, 2**63 - 1, True, False, "pid", "1", "true", "a \"b\" \\ c: # {}", "two\nlines", "", "~",
    "tab\tbell\a", "é", "😀", {"a b": 1, "c: d": [2]},
    [1, 2.5, "x"], [[0.1], []], {"a": 1, "b": {"c": [1.0, "d"]}},
])
def test_other_values_read_back(value):
    text = to_yaml_value(value)
    assert "\n" not in text
    back = yaml.safe_load(text)
    assert back == value
    assert type(back) is type(value)

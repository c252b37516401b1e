"""The linear formula of a team, compared with the designed poles, with flights, and with ./sls delay-margin."""

import os
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import sls
from sls.team_formula import read_team

TRIANGLE = "three_carry_a_triangle_pose"
PERIOD_S = 0.004
LATE = {"all": (True, True, True), "one": (False, True, False)}


def load_hold(place_m, for_s, **changes):
    """The triangle, held beside its start."""
    return sls.load_scenario(TRIANGLE, changes={
        "mission": [{"hold": {"position_m": place_m}, "for_s": for_s}], **changes})


@pytest.mark.parametrize("name, designed", [(TRIANGLE, 6), ("four_carry_a_box", 6), ("six_carry_a_box", 6)])
def test_without_delay_the_load_has_the_designed_poles(name, designed):
    A, B, K = read_team(sls.load_scenario(name))._linear
    poles = np.linalg.eigvals(A + B @ K)
    assert (poles.real < 0).all()
    # Double poles split by the root of the error of differences.
    assert np.sum(np.abs(poles + 2.0) < 1e-3) == designed, "twice 2 rad/s on each axis"
    assert np.sum(np.abs(poles + 3.0) < 1e-3) == designed, "twice 3 rad/s about each axis"


@pytest.mark.parametrize("late", LATE)
@pytest.mark.parametrize("quad_mass_kg", [0.25, 0.15])
def test_the_delay_margin_of_small_motions_is_the_limit_of_the_formula(late, quad_mass_kg, tmp_path):
    # Believed 0.25 kg: a lighter vehicle has a faster loop. The scenario holds its load with a bias that bears the
    # difference, so that the team rests level.
    lift = {"bias": {"on": "command", "vehicle": 1, "force_n": [0, 0, (0.25 - quad_mass_kg) * 9.8 or 1e-300]}}
    scenario = load_hold([1e-4, 0, -1], 25, **{
        "vehicles.1.quad_mass_kg": quad_mass_kg, "controller.model": {"quad_mass_kg": 0.25}, "faults": [lift]})
    team = replace(read_team(scenario), believed_kg=np.full(3, 0.25))
    limit = team.find_delay_limit(LATE[late], PERIOD_S)
    assert team.calc_growth([limit * is_late for is_late in LATE[late]], PERIOD_S) < 1.0

    file = tmp_path / "hold.yaml"
    file.write_text(scenario.text)
    program = Path(os.environ["SLS_BUILD"]) / "bin/delay_margin"
    if not program.exists():
        pytest.skip("delay_margin is not built")
    only = ["--vehicle", "1"] if late == "one" else []
    said = subprocess.run([program, "--scenario", file, *only], capture_output=True, text=True, check=True, timeout=300)
    expected = f"holds with {PERIOD_S * limit:.3g} s, loses the load with {PERIOD_S * (limit + 1):.3g} s"
    assert said.stdout.splitlines()[-1] == expected, said.stdout


def test_the_load_sags_under_less_lift_as_the_formula_says():
    push = np.zeros((3, 3))
    push[0, 2] = 0.01
    flight = sls.fly(load_hold([0, 0, -1], 12, faults=[{"bias": {"on": "command", "force_n": push[0].tolist()}}]))
    moved = [vehicle.load_position[-1] - vehicle.reference_position[-1] for vehicle in flight.vehicles]
    sag = read_team(flight.scenario).calc_sag(push)
    assert np.abs(sag).max() > 2e-3
    np.testing.assert_allclose(moved, sag, atol=0.01 * np.abs(sag).max())  # second order: a tilt of 1 %

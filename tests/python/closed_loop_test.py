"""sls.ClosedLoop, compared with closed forms and with flights that have the same forces."""

import os
import re
import subprocess
import sys
import textwrap

import numpy as np
import pytest
import sls
from places import ROOT

PLANT = {"model": "analytic", "step_s": 0.004,
         "initial": {"load_position_m": [0.0, 0.0, -0.5]}}


def load_analytic(**changes):
    return sls.load_scenario("figure_eight", changes={"plant": PLANT, **changes})


def load_noisy(seed):
    noise = {"on": "state", "position_m": [0.1, 0.1, 0.1], "seed": seed}
    return load_analytic(faults=[{"noise": noise}])


def hover(loop, count):
    force = np.zeros((count, 3))
    force[:, 2] = -(loop.quad_mass_kg + loop.load_mass_kg) * loop.gravity_m_s2
    return force


def test_under_the_hover_force_nothing_moves():
    loop = sls.ClosedLoop(load_analytic(), 3)
    for _ in range(250):
        state = loop.step(hover(loop, 3))
    assert np.abs(state.load_position - [0, 0, -0.5]).max() < 1e-12
    assert np.abs(state.quad_position - [0, 0, -1.5]).max() < 1e-12
    assert state.time_s.tolist() == [1.0] * 3 and state.step.tolist() == [250] * 3


@pytest.mark.parametrize("name", ["short", "faulty_figure_eight", "multirotor_figure_eight"])
def test_under_the_forces_of_a_flight_it_is_that_flight(name):
    changes = {} if name == "short" else {"mission": [{"figure_eight": {
        "amplitude_m": [1.5, 0.75, 0.5], "offset_m": [0, 0, -0.5], "period_s": 16}, "for_s": 2}]}
    scenario = sls.load_scenario(name, changes=changes)
    flight = sls.fly(scenario)
    answered = np.column_stack([flight.command[f"force_{axis}_n"] for axis in "xyz"])
    loop = sls.ClosedLoop(scenario, 2, threads=2)
    for k in range(len(flight.time_s)):
        for i in range(2):
            assert (loop.truth.load_position[i] == flight.load_position[k]).all(), k
            assert (loop.truth.quad_position[i] == flight.quad_position[k]).all(), k
            assert loop.truth.angles[i, 0] == flight.state["alpha_rad"][k]
        assert loop.truth.time_s[0] == flight.time_s[k]
        if loop.truth.attitude is not None:
            assert loop.truth.attitude[1, 0] == flight.state["att_w"][k]
        assert (loop.reference(loop.state.time_s[0]).position
                == flight.reference_position[k]).all() or name == "short"
        loop.step(np.ascontiguousarray(np.vstack([answered[k]] * 2)))


NOISE = {"faults": [{"noise": {"on": "state", "position_m": [1e-4, 1e-4, 1e-4], "vehicle": 1}}],
         "sensing": {"period_s": 0.006, "age_s": 0.003},
         "mission": [{"hold": {"position_m": [0.5, 0, -1]}, "for_s": 4}]}
SHORT_PID = {"mission": [{"hold": {"position_m": [0.5, 0, -1]}, "for_s": 2}]}


@pytest.mark.parametrize("name, changes", [
    ("three_carry_a_triangle", {}), ("three_carry_a_triangle", NOISE), ("rotors_carry_a_triangle", {}),
    ("lift_and_set_down", {}), ("figure_eight_pid", SHORT_PID)], ids=lambda value: str(value)[:8])
def test_under_its_law_a_loop_is_the_recorded_flight_of_all_vehicles(name, changes, fly_with_program):
    """A group, one with faults, one with rotors, stages that end by conditions, a law with memory."""
    scenario = sls.load_scenario(name, changes=changes)
    folder, done = fly_with_program(scenario)
    assert done.returncode == 0, done.stdout + done.stderr
    vehicles = [sls.Recording(folder).vehicle(i) for i in range(len(scenario.vehicles))]
    loop = sls.ClosedLoop(scenario, 2, threads=2)
    truth = np.stack([np.column_stack([vehicle.load_position, vehicle.quad_position,
                                       vehicle.state["alpha_dot_rad_s"]]) for vehicle in vehicles], 1)
    signals = {key: np.stack([vehicle.state[key] for vehicle in vehicles], 1) for key in loop.state.signals}
    forces = np.stack([np.column_stack([vehicle.command[f"force_{axis}_n"] for axis in "xyz"])
                       for vehicle in vehicles], 1)
    references = np.stack([np.column_stack([vehicle.reference[f"ref_{axis}_m"] for axis in "xyz"])
                           for vehicle in vehicles], 1)
    shape = loop.state.angles.shape[1:-1] or (1,)
    for k in range(len(forces)):
        force = loop.law_force()
        assert (loop.law_force() == force).all(), "a second call in a step changes nothing"
        for i in range(2):
            now = np.column_stack([value[i].reshape(*shape, -1) for value in (
                loop.truth.load_position, loop.truth.quad_position, loop.truth.angle_rates[..., :1])])
            assert (now == truth[k]).all(), k
            assert (force[i] == forces[k]).all(), k
            for key, values in signals.items():
                assert (loop.truth.signals[key][i] == values[k]).all(), (key, k)
        if name != "lift_and_set_down":  # a stage that ends by a condition has no known end
            assert (loop.reference().position[0] == references[k]).all(), k
        loop.step(force)


def damp(position, velocity):
    """A law in plain floats: it holds the height -2 m and damps."""
    return [-0.5 * velocity[0], -0.5 * velocity[1], -3.3614 - (position[2] + 2.0) - 0.5 * velocity[2]]


def test_one_vehicle_of_a_group_has_a_law_in_python_and_the_others_their_own():
    scenario = sls.load_scenario("three_carry_a_triangle", changes=NOISE)
    flight = sls.fly(scenario, {1: lambda now: damp(now.quad_position, now.quad_velocity)})
    loop = sls.ClosedLoop(scenario)
    assert loop.quad_mass_kg.tolist() == [0.25] * 3
    for k in range(len(flight)):
        for vehicle in flight.vehicles:
            at = loop.truth.load_position[0, vehicle.vehicle_id]
            assert (at == vehicle.load_position[k]).all(), k
        force = loop.law_force()
        force[0, 1] = damp(loop.state.quad_position[0, 1].tolist(), loop.state.quad_velocity[0, 1].tolist())
        loop.step(force)
    assert np.abs(flight.load_position[-1] - sls.fly(scenario).load_position[-1]).max() > 0.01
    for key in (3, -1, "1"):
        with pytest.raises(sls.ConfigError, match="controller: a vehicle id: expected a whole number from 0 to 2"):
            sls.fly(scenario, {key: damp})


def test_the_example_of_a_group_in_the_readme_runs():
    readme = (ROOT / "python/README.md").read_text()
    example = re.search(r'    loop = sls.ClosedLoop."three_carry.*?\n(?!    )', readme, re.S)[0]
    names = {"sls": sls}
    exec(textwrap.dedent(example), names)
    assert names["state"].step == 1000 and names["state"].load_position[0, 0, 0] > 0.05  # it was pushed


def test_a_group_begins_where_its_scenario_would_with_the_values_of_a_reset():
    changed = sls.load_scenario("three_carry_a_triangle", changes={"plant.initial.load_position_m": [1, 2, -3]})
    loop = sls.ClosedLoop("three_carry_a_triangle", 2)
    state = loop.reset([1], load_position=[1, 2, -3])
    assert (state.quad_position[1] == sls.ClosedLoop(changed).state.quad_position[0]).all()
    assert (state.quad_position[0] != state.quad_position[1]).all()


def test_a_law_without_an_answer_fails_its_loop_as_its_flight():
    scenario = sls.load_scenario("three_carry_a_triangle", changes={"controller.force_limit_n": 3.37})
    loop = sls.ClosedLoop(scenario)
    flight = sls.fly(scenario)
    for _ in range(len(flight)):
        loop.step(loop.law_force())
    assert loop.reason(0) == flight.failure.replace("control_client", "python") != ""
    assert loop.state.step == flight.last_step and not loop.law_force().any()


def test_measured_states_differ_from_the_truth_by_the_faults_of_the_scenario():
    biased = load_analytic(faults=[{"bias": {"on": "state", "position_m": [0.1, 0, 0]}}])
    loop = sls.ClosedLoop(biased)
    assert np.allclose(loop.state.load_position - loop.truth.load_position, [0.1, 0, 0])
    plain = sls.ClosedLoop(load_analytic())
    assert plain.state.load_position.tolist() == plain.truth.load_position.tolist()


def test_arrays_are_updated_in_place_and_cannot_be_written():
    loop = sls.ClosedLoop(load_analytic(), 4)
    held = loop.state.load_velocity
    before = held.copy()
    state = loop.step(np.zeros((4, 3)))
    assert state is loop.state and state.load_velocity is held
    assert (held != before).any()
    with pytest.raises(ValueError, match="read-only"):
        held[0] = 1.0
    assert state.attitude is None and state.body_rates is None
    del loop, state
    assert np.isfinite(held).all(), "the memory lives as long as an array of it"


def test_a_loop_that_fails_stays_still_until_its_reset():
    loop = sls.ClosedLoop(load_analytic(), 3)
    force = hover(loop, 3)
    force[1] = [0, 0, -201]
    force[2, 0] = np.nan
    for _ in range(3):
        state = loop.step(force)
    assert state.failed.tolist() == [False, True, True] and state.step.tolist() == [3, 0, 0]
    assert loop.reason(0) == ""
    assert loop.reason(1) == ("controller 'python' answered step 0 with a force beyond "
                              "controller.force_limit_n: 201 N > 200 N")
    assert loop.reason(2) == ("controller 'python' answered step 0 with a number that is not "
                              "finite")
    loop.reset(loop.failed)
    assert not loop.failed.any() and loop.state.step.tolist() == [3, 0, 0]
    loop.step(hover(loop, 3))
    assert loop.state.step.tolist() == [4, 1, 1]


def test_a_reset_says_where_each_loop_begins():
    loop = sls.ClosedLoop(load_analytic(), 4)
    starts = np.array([[1.0, 2, 3], [4, 5, 6]])
    state = loop.reset([1, 3], quad_position=starts, quad_velocity=(0.1, 0, 0),
                       angles=[0.2, -0.1])
    assert np.allclose(state.quad_position[[1, 3]], starts, atol=1e-12)
    assert np.allclose(state.quad_velocity[3], [0.1, 0, 0], atol=1e-12)
    assert np.allclose(state.angles[[1, 3]], [0.2, -0.1], atol=1e-12)
    assert np.allclose(state.load_position[0], [0, 0, -0.5])
    rod = state.load_position[1] - state.quad_position[1]
    # common/model/README.md, eq. (1): the direction of the rod.
    assert np.isclose(np.linalg.norm(rod), 1.0) and np.isclose(rod[0], np.sin(-0.1))


def test_seeds_give_each_loop_its_own_noise_and_no_seeds_the_scenarios():
    plain = sls.ClosedLoop(load_noisy(7), 2)
    assert (plain.state.load_position[0] == plain.state.load_position[1]).all()
    shifted = sls.ClosedLoop(load_noisy(7), 2, seeds=[0, 5])
    assert (shifted.state.load_position[0] == plain.state.load_position[0]).all()
    of_12 = sls.ClosedLoop(load_noisy(12))
    assert (shifted.state.load_position[1] == of_12.state.load_position[0]).all()
    shifted.reset([0], seeds=[5])
    assert (shifted.state.load_position[0] == shifted.state.load_position[1]).all()


def test_the_reference_is_the_missions():
    loop = sls.ClosedLoop(load_analytic(), 5)
    times = np.linspace(0, 32, 12).reshape(3, 4)
    reference = loop.reference(times)
    angle = 2 * np.pi / 16 * times
    expected = np.stack([1.5 * np.sin(angle), 0.75 * np.sin(2 * angle),
                         0.5 * np.sin(angle) - 0.5], axis=-1)
    assert reference.position.shape == (3, 4, 3)
    assert np.allclose(reference.position, expected, atol=1e-8)  # times in whole nanoseconds
    assert loop.reference().velocity.shape == (5, 3)
    with pytest.raises(sls.ConfigError, match="time_s: expected from 0 to 1000000 s, got -1.0"):
        loop.reference(-1.0)


@pytest.mark.parametrize("force, got", [
    (np.zeros((2, 3), np.float32), r"float32 of shape \(2, 3\)"),
    (np.zeros((3, 3)), r"float64 of shape \(3, 3\)"),
    (np.zeros(6), r"float64 of shape \(6,\)"),
    (np.zeros((3, 2)).T, r"float64 of shape \(2, 3\) that is not C-contiguous"),
    ([[0, 0, 0]], r"float64 of shape \(1, 3\)"),
])
def test_another_array_than_forces_is_refused(force, got):
    loop = sls.ClosedLoop(load_analytic(), 2)
    expected = r"force: expected a C-contiguous array of float64 of shape \(2, 3\), got "
    with pytest.raises(sls.ConfigError, match=f"^{expected}{got}$"):
        loop.step(force)


def test_forces_may_be_lists():
    lists, arrays = (sls.ClosedLoop(load_analytic(), 2) for _ in range(2))
    forces = [[0, 0.5, -17], (0.1, 0, -16)]
    assert np.array_equal(lists.step(forces).load_position, arrays.step(np.array(forces)).load_position)
    with pytest.raises(sls.ConfigError, match=r"^force: expected numbers of shape \(2, 3\), got \[\[1\], 'x'\]$"):
        lists.step([[1], "x"])


@pytest.mark.parametrize("arguments, message", [
    ({"count": 0}, "count: expected a whole number from 1 to 10000000, got 0"),
    ({"count": 2.5}, "count: expected a whole number from 1 to 10000000, got 2.5"),
    ({"threads": 0}, "threads: expected a whole number from 1 to 1024, got 0"),
    ({"count": 2, "seeds": [1]}, "seeds: expected 2 whole numbers >= 0, got int64 of shape (1,)"),
    ({"vehicle": 3}, "vehicle: expected a vehicle of the 1 in 'figure_eight', got 3"),
    ({"scenario": "three_carry_a_triangle", "vehicle": 1},
     "vehicle: expected 0, since the vehicles of 'three_carry_a_triangle' move together, got 1"),
])
def test_bad_arguments_are_named(arguments, message):
    with pytest.raises(sls.ConfigError) as error:
        sls.ClosedLoop(**{"scenario": load_analytic(), **arguments})
    assert message in str(error.value)


@pytest.mark.parametrize("arguments, message", [
    ({"indices": [2]}, "indices: expected from 0 to 1, got 2"),
    ({"indices": [0.5]}, "indices: expected whole numbers or a mask of shape (2,), got float64"),
    ({"angles": [4.0, 0]}, "reset: angles: expected alpha from -pi to pi"),
    ({"angles": [1.0]}, "reset: angles: expected numbers of shape (2, 2) or (2,), got (1,)"),
    ({"speed": [1.0]}, "reset: speed: expected one of quad_position, load_position"),
    ({"quad_velocity": [np.inf, 0, 0]}, "reset: quad_velocity: expected finite numbers, got inf"),
    ({"quad_position": [0, 0, 0], "load_position": [0, 0, 0]}, "got both"),
    ({"attitude": [1, 0, 0, 0]}, "expected a plant whose vehicles turn, got 'analytic'"),
    ({"attitude": [2, 0, 0, 0]}, "reset: attitude: expected unit quaternions"),
    ({"scenario": "pick_up_and_set_down", "load_position": [0, 0, 1]},
     "plant.ground_z_m: expected at least 1, the z of the load at the start (z is down), got 0"),
])
def test_a_reset_that_is_refused_changes_nothing(arguments, message):
    loop = sls.ClosedLoop(arguments.pop("scenario", load_analytic()), 2)
    loop.step(hover(loop, 2))
    with pytest.raises(sls.ConfigError) as error:
        loop.reset(**arguments)
    assert message in str(error.value)
    assert loop.state.step.tolist() == [1, 1]


def test_a_vehicle_that_turns_begins_as_it_is_told():
    loop = sls.ClosedLoop("multirotor_figure_eight", 2)
    half = np.sqrt(0.5)
    state = loop.reset([1], attitude=[half, 0, 0, half], body_rates=[0.1, 0.2, 0.3])
    assert np.allclose(state.attitude, [[1, 0, 0, 0], [half, 0, 0, half]], atol=1e-12)
    assert np.allclose(state.body_rates[1], [0.1, 0.2, 0.3], atol=1e-12)


def test_something_else_than_a_scenario_is_refused():
    with pytest.raises(sls.ConfigError, match="^scenario: expected one of sls.load_scenario"):
        sls.ClosedLoop(7)


@pytest.mark.filterwarnings("ignore:.*use of fork:DeprecationWarning")  # of Python 3.12, for what this test does
def test_a_fork_is_told_to_make_its_own():
    loop = sls.ClosedLoop(load_analytic(), 100, threads=2)
    child = os.fork()
    if child == 0:
        try:
            loop.step(hover(loop, 100))
            os._exit(1)
        except sls.ConfigError as error:
            os._exit(0 if "expected the process that made it" in str(error) else 2)
    assert os.waitpid(child, 0)[1] == 0


def test_the_example_learns_gains_with_which_the_law_in_cpp_flies_as_well():
    said = subprocess.run([sys.executable, "-B", ROOT / "examples/python/learn.py"], check=True,
                          capture_output=True, text=True, timeout=120).stdout
    errors = [float(number) for number in re.findall(r"rms error ([0-9.]+) m", said)]
    assert errors[-1] < 0.6 * errors[0], said
    assert errors[-1] == errors[-2], said  # the batch and the law in C++, printed to the millimetre
    assert float(re.search(r"flights of 8 s in ([0-9.]+) s", said)[1]) < 60, said

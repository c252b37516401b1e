"""sls.ClosedLoop, compared with closed forms and with flights that have the same forces."""

import os
import re
import subprocess
import sys

import numpy as np
import pytest
import sls
from conftest import PYTHON_PATH, ROOT

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


def test_without_force_it_falls():
    loop = sls.ClosedLoop(load_analytic(), 2)
    for _ in range(250):
        state = loop.step(np.zeros((2, 3)))
    assert np.allclose(state.load_position[:, 2] + 0.5, 0.5 * 9.8, atol=1e-9)
    assert np.allclose(state.load_velocity[:, 2], 9.8, atol=1e-9)


def test_a_small_swing_about_hover_has_its_period():
    loop = sls.ClosedLoop(load_analytic(), 1)
    state = loop.reset(angles=(0.0, 1e-3))
    omega = np.sqrt((1.5 + 0.2) * 9.8 / (1.5 * 1.0))
    for k in range(1, 500):
        state = loop.step(hover(loop, 1))
        # Errors: the pendulum's nonlinearity, of order angle², and RK4 at 4 ms.
        assert abs(state.angles[0, 1] - 1e-3 * np.cos(omega * k * loop.period_s)) < 1e-8


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


def test_measured_states_differ_from_the_truth_by_the_faults_of_the_scenario():
    biased = load_analytic(faults=[{"bias": {"on": "state", "position_m": [0.1, 0, 0]}}])
    loop = sls.ClosedLoop(biased)
    assert np.allclose(loop.state.load_position - loop.truth.load_position, [0.1, 0, 0])
    plain = sls.ClosedLoop(load_analytic())
    assert plain.state.load_position.tolist() == plain.truth.load_position.tolist()


def test_the_number_of_threads_changes_no_bit():
    random = np.random.default_rng(3)
    forces = random.normal(0, 1, (100, 200, 3)) + [0, 0, -16.66]
    results = []
    for threads in (1, 2, 5):
        loop = sls.ClosedLoop(load_analytic(), 200, threads=threads)
        for force in forces:
            loop.step(force)
        results.append(loop.state.load_position.tobytes() + loop.state.angle_rates.tobytes())
    assert results[0] == results[1] == results[2]


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
])
def test_bad_arguments_are_named(arguments, message):
    with pytest.raises(sls.ConfigError) as error:
        sls.ClosedLoop(load_analytic(), **arguments)
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
])
def test_a_reset_that_is_refused_changes_nothing(arguments, message):
    loop = sls.ClosedLoop(load_analytic(), 2)
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
                          capture_output=True, text=True, timeout=120,
                          env={**os.environ, "PYTHONPATH": PYTHON_PATH}).stdout
    errors = [float(number) for number in re.findall(r"rms error ([0-9.]+) m", said)]
    assert errors[-1] < 0.6 * errors[0], said
    assert errors[-1] == errors[-2], said  # the batch and the law in C++, printed to the millimetre
    assert float(re.search(r"flights of 8 s in ([0-9.]+) s", said)[1]) < 60, said

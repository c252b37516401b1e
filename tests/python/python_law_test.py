"""Control laws written in Python: their inputs and the use of their answers."""

import importlib.util
import threading

import numpy as np
import pytest
import sls
from places import ROOT

WEIGHT_N = 1.7 * 9.8  # of the scenario `short`
HOVER = [{"hold": {"position_m": [0, 0, -0.5]}, "for_s": 1.0}]


def load_example(name):
    spec = importlib.util.spec_from_file_location(
        name, ROOT / f"examples/python/{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def load_hover(**changes):
    return sls.load_scenario("short", mission=HOVER, **changes)


@pytest.mark.parametrize("integral", [0.0, 0.3])
def test_the_example_flies_as_the_same_law_in_cpp(integral):
    horizontal = {"position": 0.6, "velocity": 1.5, "integral": integral, "rod_angle": 36,
                  "rod_rate": 12}
    vertical = {"position": 1.5, "velocity": 3.0, "integral": integral}
    scenario = sls.load_scenario("figure_eight_pid", mission__0__for_s=8, controller__gains={
        "horizontal": horizontal, "vertical": vertical})
    pid = load_example("pid").Pid(scenario.controller_model, tuple(
        horizontal[key] for key in ("position", "velocity", "integral", "rod_angle", "rod_rate")),
        tuple(vertical[key] for key in ("position", "velocity", "integral")))
    ours, theirs = sls.fly(scenario, pid), sls.fly(scenario)
    assert len(ours) == len(theirs) == 2001 and ours.is_finished
    # The same equations in another order of operations; the loop is stable.
    assert np.allclose(ours.load_position, theirs.load_position, rtol=0, atol=1e-12)
    assert np.allclose(ours.force, theirs.force, rtol=0, atol=1e-9)
    assert ours.certificate == sls.fly(scenario, pid, check_purity=True).certificate


def test_a_law_is_given_what_was_measured_and_wanted():
    noise = {"on": "state", "position_m": [0.01, 0.01, 0.01], "seed": 3}
    scenario = load_hover(faults=[{"noise": noise}])
    seen = {}

    def law(now):
        seen[now.step] = now
        return 0.01 * np.sin(now.time_s), 0.0, -WEIGHT_N

    flight = sls.fly(scenario, law)
    assert flight.is_finished, flight.failure
    assert len(seen) == len(flight) == 251
    measured, wanted = flight.measured, flight.reference
    for step, now in seen.items():
        assert now.time_s == flight.time_s[step]
        assert (now.period_s, now.vehicle_id, now.stage) == (0.004, 0, 0)
        assert now.stage_time_s == pytest.approx(now.time_s)
        assert now.attitude is None and now.body_rates is None and now.signals == ()
        assert now.memory == ()
        for values, columns, names in (
                (now.quad_position, measured, "quad_?_m"),
                (now.quad_velocity, measured, "quad_v?_m_s"),
                (now.load_position, measured, "load_?_m"),
                (now.load_velocity, measured, "load_v?_m_s"),
                (now.reference.position, wanted, "ref_?_m"),
                (now.reference.velocity, wanted, "ref_v?_m_s"),
                (now.reference.acceleration, wanted, "ref_a?_m_s2"),
                (now.reference.jerk, wanted, "ref_j?_m_s3"),
                (now.reference.snap, wanted, "ref_s?_m_s4")):
            assert values == tuple(columns[names.replace("?", axis)][step] for axis in "xyz")
            assert all(type(value) is float for value in values)
        assert (now.alpha, now.beta, now.alpha_rate, now.beta_rate) == tuple(
            measured[name][step] for name in ("alpha_rad", "beta_rad", "alpha_dot_rad_s",
                                              "beta_dot_rad_s"))
    assert np.array_equal(flight.force[:, 0], 0.01 * np.sin(flight.time_s))


def test_a_law_of_a_multirotor_is_given_attitude_and_signals():
    scenario = sls.load_scenario("multirotor_figure_eight", mission=HOVER)
    seen = []

    def law(now):
        seen.append(now)
        return 0.0, 0.0, -now.step * 0.0 - sum(
            (scenario.vehicle.quad_mass_kg, scenario.vehicle.load_mass_kg)) * 9.8

    flight = sls.fly(scenario, law, check_purity=True)
    assert len(seen) == 2 * len(flight)
    state = flight.measured
    signals = list(state)[list(state).index("rate_z_rad_s") + 1:]
    for step in (0, 1, 100, len(flight) - 1):
        now = seen[2 * step]
        assert now == seen[2 * step + 1]
        assert now.attitude == tuple(state[f"att_{part}"][step] for part in "wxyz")
        assert now.body_rates == tuple(state[f"rate_{axis}_rad_s"][step] for axis in "xyz")
        assert now.signals == tuple(state[name][step] for name in signals)


class Counter:
    memory_size = 2

    def __call__(self, now):
        count, steps = now.memory
        assert count == now.step  # zero at step 0, then the returned memory
        return [0.0, 0.0, -WEIGHT_N], [count + 1, steps]


def test_memory_comes_back_at_the_next_step():
    assert sls.fly(load_hover(), Counter()).is_finished


def test_forces_may_be_tuples_lists_arrays_and_whole_numbers():
    for force in ((0, 0, -16.66), [0.0, 0.0, -16.66], np.array([0.0, 0.0, -16.66])):
        flight = sls.fly(load_hover(), lambda now, force=force: force)
        assert np.array_equal(flight.force, np.tile([0.0, 0.0, -16.66], (len(flight), 1)))


def test_each_vehicle_of_a_fleet_asks_the_law():
    scenario = sls.load_scenario("mixed_fleet", mission=HOVER)
    flight = sls.fly(scenario, lambda now: (0.0, 0.0, -16.0 - now.vehicle_id))
    for vehicle in flight.vehicles:
        assert np.all(vehicle.command["force_z_n"] == -16.0 - vehicle.vehicle_id)


def test_a_law_that_keeps_something_is_refused():
    calls = []

    def count(now):
        calls.append(now)
        return 0.0, 0.0, -float(len(calls))

    with pytest.raises(sls.RunError) as error:
        sls.fly(load_hover(), count)
    assert str(error.value).endswith(
        "count: vehicle 0, step 0: expected equal answers to equal inputs, got two different ones; "
        "what the law must remember belongs into its memory numbers")

    def late(now):
        if now.step >= 200:
            return count(now)
        return 0.0, 0.0, -WEIGHT_N

    assert sls.fly(load_hover(), late)  # in the first 100 steps its answers are equal
    with pytest.raises(sls.RunError, match="late: vehicle 0, step 200: expected equal answers"):
        sls.fly(load_hover(), late, check_purity=True)


def test_an_exception_of_the_law_ends_the_flight_with_step_and_vehicle():
    def divide(now):
        return 0.0, 0.0, -WEIGHT_N * (1 / (now.step - 150)) ** 0

    with pytest.raises(sls.RunError) as error:
        sls.fly(load_hover(), divide)
    assert str(error.value).endswith(
        "divide: vehicle 0, step 150: ZeroDivisionError: division by zero")
    cause = error.value.__cause__
    assert isinstance(cause, ZeroDivisionError)
    assert cause.__traceback__.tb_frame.f_code.co_name == "divide"


@pytest.mark.parametrize("answer, message", [
    ((1.0, 2.0), "force: expected 3 finite numbers (N), got (1.0, 2.0)"),
    ((1.0, 2.0, float("nan")), "force: expected 3 finite numbers (N), got (1.0, 2.0, nan)"),
    ((1.0, 2.0, "x"), "force: expected 3 finite numbers (N), got (1.0, 2.0, 'x')"),
    (None, "force: expected 3 finite numbers (N), got None"),
    (np.zeros((3, 3)), "force: expected 3 finite numbers (N), got array([[0., 0., 0.],"),
])
def test_an_invalid_force_is_named(answer, message):
    with pytest.raises(sls.RunError) as error:
        sls.fly(load_hover(), lambda now: answer)
    assert f"vehicle 0, step 0: {message}" in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("answer, message", [
    ((0.0, 0.0, -1.0), "expected (force, memory), for memory_size is 2, got (0.0, 0.0, -1.0)"),
    (((0.0, 0.0, -1.0), (1.0,)), "memory: expected 2 finite numbers, got (1.0,)"),
    (((0.0, 0.0, -1.0), (1.0, float("inf"))), "memory: expected 2 finite numbers, got (1.0, inf)"),
    (((0.0, 0.0), (1.0, 2.0)), "force: expected 3 finite numbers (N), got (0.0, 0.0)"),
])
def test_an_invalid_memory_is_named(answer, message):
    class Law:
        memory_size = 2

        def __call__(self, now):
            return answer

    with pytest.raises(sls.RunError) as error:
        sls.fly(load_hover(), Law())
    assert f"Law: vehicle 0, step 0: {message}" in str(error.value)


def test_a_law_without_a_force_fails_the_flight():
    def law(now):
        if now.step == 7:
            raise sls.LawFault("rod_level")
        return 0.0, 0.0, -WEIGHT_N

    flight = sls.fly(load_hover(), law)
    assert "rod_level" in flight.failure and len(flight) == 8
    assert flight.command["fault"].tolist() == ["none"] * 7 + ["rod_level"]
    with pytest.raises(sls.ConfigError, match="expected one of free_fall, rod_level, not_finite"):
        sls.LawFault("tired")


def make_law(size):
    return type("Law", (), {"memory_size": size, "__call__": lambda self, now: ((0.0, 0.0, 0.0), ())})()


@pytest.mark.parametrize("controller, message", [
    (3, "controller: expected an object that can be called with sls.Now, got 3"),
    (Counter, "controller: expected an object that can be called"),
    (make_law(-1), "Law.memory_size: expected a whole number from 0 to 64, got -1"),
    (make_law(65), "Law.memory_size: expected a whole number from 0 to 64, got 65"),
    (make_law("3"), "Law.memory_size: expected a whole number from 0 to 64, got '3'"),
])
def test_an_invalid_law_is_refused_before_the_flight(controller, message):
    with pytest.raises(sls.ConfigError) as error:
        sls.fly(load_hover(), controller)
    assert message in str(error.value)


@pytest.mark.parametrize("raised", [KeyboardInterrupt, SystemExit])
def test_exceptions_that_are_not_errors_of_the_law_pass_unchanged(raised):
    def law(now):
        if now.step == 150:
            raise raised()
        return 0.0, 0.0, -WEIGHT_N

    with pytest.raises(raised):
        sls.fly(load_hover(), law)


def test_threads_fly_laws_side_by_side():
    pid = load_example("pid")
    scenario = sls.load_scenario("figure_eight_pid", mission__0__for_s=2)
    law = pid.Pid(scenario.controller_model)
    expected = sls.fly(scenario, law).certificate
    found = []
    threads = [threading.Thread(target=lambda: found.append(sls.fly(scenario, law).certificate))
               for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert found == [expected] * 4

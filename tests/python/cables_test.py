"""sls.cables against closed forms, written here with numpy, and what it refuses."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import sls
from sls.cables import Load, System, Vehicles

G = 9.81


def make_bar(**keys):
    return System(vehicle_mass_kg=[0.5, 0.7], cable_length_m=[1, 1.2], attachment_m=[[0.2, 0, 0], [-0.2, 0, 0]],
                  load_mass_kg=0.3, load_inertia_kg_m2=np.diag([1e-4, 4e-3, 4e-3]), gravity_m_s2=G, **keys)


def hang(position, velocity=0.0):
    return Vehicles([[0.2, 0, -1], [-0.2, 0, position]], [[0, 0, velocity], [0, 0, 0]])


REST = Load([0, 0, 0], [0, 0, 0])


def test_a_pendulum_has_the_tension_of_its_reduced_mass():
    system = System(vehicle_mass_kg=[1.5], cable_length_m=[0.8], attachment_m=[[0, 0, 0]], load_mass_kg=0.5)
    n = np.array([np.sin(0.6), 0, np.cos(0.6)])
    across = 1.3 * np.array([np.cos(0.6), 0, -np.sin(0.6)])
    force = np.array([1.0, 0.5, -20.0])
    got = system.accelerations((0.8 * n, across), ([[0, 0, 0]], [[0, 0, 0]]), [force])
    reduced = 1.5 * 0.5 / 2.0
    tension = reduced * (1.3**2 / 0.8 - n @ force / 1.5)  # tests/oracle/slung_load_ode.hpp
    assert got.tension_n == pytest.approx([tension], rel=1e-14)
    assert got.load == pytest.approx(np.array([0, 0, 9.8]) - tension * n / 0.5, rel=1e-14)
    assert got.vehicles[0] == pytest.approx(np.array([0, 0, 9.8]) + (force + tension * n) / 1.5, rel=1e-14)
    assert got.taut.tolist() == [True] and not got.load_angular.any()


def test_a_bar_on_one_taut_cable_turns_and_the_slack_one_does_not_pull():
    # Vertical cable at x = 0.2 m: m a = m g − T, J ẇ_y = 0.2 T; the end does not move against a held vehicle.
    hold = 0.5 * G
    got = make_bar().accelerations(REST, hang(-1.0), [[0, 0, -hold], [0, 0, -0.7 * G]])
    stiffness = 1 / 0.3 + 0.2**2 / 4e-3 + 1 / 0.5
    tension = G / stiffness
    assert got.tension_n == pytest.approx([tension, 0], rel=1e-14)
    assert got.taut.tolist() == [True, False]
    assert got.load == pytest.approx([0, 0, G - tension / 0.3], rel=1e-13)
    assert got.load_angular == pytest.approx([0, 0.2 * tension / 4e-3, 0], rel=1e-13)
    assert got.vehicles == pytest.approx(np.array([[0, 0, tension / 0.5], [0, 0, 0]]), abs=1e-13)


def test_an_impact_keeps_momentum_and_stops_the_end_of_the_cable():
    for restitution in (0.0, 0.6):
        got = make_bar(restitution=restitution).impact(REST, hang(-1.0, velocity=-2.0))
        impulse = (1 + restitution) * 2.0 / (1 / 0.3 + 0.2**2 / 4e-3 + 1 / 0.5)
        assert got.impulse_n_s == pytest.approx([impulse, 0], rel=1e-14)
        assert got.load_velocity == pytest.approx([0, 0, -impulse / 0.3], rel=1e-14)
        assert got.load_rates == pytest.approx([0, 0.2 * impulse / 4e-3, 0], rel=1e-14)
        end = got.load_velocity[2] - got.load_rates[1] * 0.2
        assert end - got.vehicle_velocity[0, 2] == pytest.approx(-2.0 * restitution, abs=1e-14)
    same = make_bar().impact(REST, hang(-1.0, velocity=1.0))
    assert not same.impulse_n_s.any() and same.vehicle_velocity[0, 2] == 1.0


def test_a_winch_changes_length_and_tension():
    # One vertical cable between 0.5 kg and 0.3 kg: the ends accelerate apart by l̈, and approach by the rate of l.
    system = System(vehicle_mass_kg=0.5, cable_length_m=1, attachment_m=[0, 0, 0], load_mass_kg=0.3, gravity_m_s2=G)
    reduced = 0.5 * 0.3 / 0.8
    vehicles = Vehicles([[0, 0, -1]], [[0, 0, 0.4]])
    got = system.accelerations(REST, vehicles, [[0, 0, -6]], length_rate_m_s=-0.4, length_acceleration_m_s2=[-2])
    assert got.tension_n == pytest.approx([reduced * (6 / 0.5 + 2)], rel=1e-14)
    assert got.taut.tolist() == [True]
    assert not system.accelerations(REST, vehicles, [[0, 0, -6]]).taut.any()
    hit = system.impact(REST, vehicles, length_rate_m_s=[-1.0])
    assert hit.impulse_n_s == pytest.approx([reduced * 0.6], rel=1e-14)
    assert not system.impact(REST, vehicles).impulse_n_s.any()
    with pytest.raises(sls.ConfigError, match=r"length_rate_m_s: expected 1, got 2"):
        system.impact(REST, vehicles, length_rate_m_s=[1, 2])


def test_accelerations_do_not_depend_on_the_world_axes_without_gravity():
    # The whole scene turned by a quaternion of any length, without gravity.
    keys = {"vehicle_mass_kg": [0.5, 0.7], "cable_length_m": [1, 1.2], "attachment_m": [[0.2, 0.1, 0], [-0.2, 0, 0.1]],
            "load_mass_kg": 0.3, "load_inertia_kg_m2": [[3e-3, 1e-4, 0], [1e-4, 4e-3, 0], [0, 0, 5e-3]]}
    system = System(gravity_m_s2=0, **keys)
    positions = np.array([[0.2, 0.1, -1], [-0.2, 0, -1.1]])
    forces = np.array([[0.3, -0.2, -4.0], [0.0, 0.5, -3.0]])
    rates = [0, 0, 0.7]  # keeps both distances: the cables are vertical
    level = system.accelerations(Load([0, 0, 0], [0, 0, 0], rates=rates), (positions, np.zeros((2, 3))), forces)
    q = np.array([0.5, -0.7, 0.1, 0.9])
    rotate = Rotation.from_quat(np.roll(q, -1)).apply
    turned = system.accelerations(
        {"position": [0, 0, 0], "velocity": [0, 0, 0], "quaternion": q, "rates": rates},
        {"position": rotate(positions), "velocity": np.zeros((2, 3))},
        rotate(forces))
    assert level.taut.all()
    assert turned.tension_n == pytest.approx(level.tension_n, rel=1e-12)
    assert turned.load_angular == pytest.approx(level.load_angular, rel=1e-12)
    assert turned.load == pytest.approx(rotate(level.load), rel=1e-12)


@pytest.mark.parametrize(("keys", "message"), [
    ({"vehicle_mass_kg": [0.5, -1]}, "vehicle_mass_kg: expected > 0, got -1"),
    ({"vehicle_mass_kg": [1] * 17}, "vehicle_mass_kg: expected 1 to 16 vehicles, got 17"),
    ({"vehicle_mass_kg": []}, "vehicle_mass_kg: expected 1 to 16 vehicles, got 0"),
    ({"cable_length_m": [1]}, "cable_length_m: expected 2, got 1"),
    ({"cable_length_m": [1, 0]}, "cable_length_m: expected > 0, got 0"),
    ({"attachment_m": [[0, 0, 0]]}, "attachment_m: expected 2 × 3, got 1 × 3"),
    ({"load_mass_kg": float("nan")}, "load_mass_kg: expected finite numbers, got nan"),
    ({"load_mass_kg": "heavy"}, "load_mass_kg: expected numbers, got 'heavy'"),
    ({"load_mass_kg": [0.3]}, "load_mass_kg: expected a number, got 1"),
    ({"load_mass_kg": -0.3}, "load_mass_kg: expected > 0, got -0.3"),
    ({"length_tolerance_m": []}, "length_tolerance_m: expected a number, got 0"),
    ({"cable_length_m": [1, [2]]}, "cable_length_m: expected numbers, got [1, [2]]"),
    ({"attachment_m": [[1, 2, 3], [1]]}, "attachment_m: expected numbers, got [[1, 2, 3], [1]]"),
    ({"attachment_m": [[1, 2, float("nan")], [1, 2, 3]]}, "attachment_m: expected finite numbers, got nan"),
    ({"load_inertia_kg_m2": [1, 1, 1]}, "load_inertia_kg_m2: expected 3 × 3, got 3"),
    ({"load_inertia_kg_m2": np.diag([1, 1, 3])}, "load_inertia_kg_m2: expected principal moments of which none"),
    ({"load_inertia_kg_m2": np.diag([0, 1, 1])}, "load_inertia_kg_m2: expected principal moments > 0, got 0"),
    ({"load_inertia_kg_m2": [[1, 0.1, 0], [0, 1, 0], [0, 0, 1]]}, "load_inertia_kg_m2: expected a symmetric matrix"),
    ({"load_inertia_kg_m2": None}, "attachment_m: expected 0 for a load without load_inertia_kg_m2"),
    ({"restitution": 1.1}, "restitution: expected 0 to 1, got 1.1"),
])
def test_an_impossible_system_is_refused_in_one_line(keys, message):
    good = {"vehicle_mass_kg": [0.5, 0.7], "cable_length_m": [1, 1.2], "attachment_m": [[0.2, 0, 0], [-0.2, 0, 0]],
            "load_mass_kg": 0.3, "load_inertia_kg_m2": np.diag([1, 1, 1])}
    with pytest.raises(sls.ConfigError) as raised:
        System(**{**good, **keys})
    assert message in str(raised.value) and "\n" not in str(raised.value)


@pytest.mark.parametrize(("load", "vehicles", "message"), [
    (REST, hang(-1.3), "vehicles: expected vehicle 1 within its cable's length of 1.2 m, got a distance of 1.3 m"),
    (([0, 0, 0],), hang(-1.0), "load: expected position, velocity, quaternion, rates, got 1 values"),
    ({"place": [0, 0, 0]}, hang(-1.0), "load: expected position, velocity, quaternion, rates, got place"),
    (Load([0, 0], [0, 0, 0]), hang(-1.0), "load.position: expected 3, got 2"),
    (Load([0, 0, 0], [0, 0, 0], [0, 0, 0, 0]), hang(-1.0), "load.quaternion: expected a length > 0, got 0"),
    (REST, ([[0, 0, -1]], [[0, 0, 0]]), "vehicles.position: expected 2 × 3, got 1 × 3"),
    (REST, 3, "vehicles: expected position, velocity, got 3"),
])
def test_an_impossible_motion_is_refused_in_one_line(load, vehicles, message):
    for act in (lambda: make_bar().accelerations(load, vehicles, np.zeros((2, 3))),
                lambda: make_bar().impact(load, vehicles)):
        with pytest.raises(sls.ConfigError) as raised:
            act()
        assert str(raised.value) == message


@pytest.mark.parametrize("length", [1e-320, 1e-5, 1e308])
def test_a_quaternion_may_have_any_length(length):
    above = Vehicles([[0, 0.2, -1], [0, -0.2, -1.2]], np.zeros((2, 3)))  # of a bar along y
    unit, other = (make_bar().accelerations(REST._replace(quaternion=(size, 0, 0, size)), above,
                                            [[1, 0, -8], [0, 2, -9]]) for size in (1.0, length))
    assert unit.taut.all()
    for wanted, got in zip(unit, other, strict=True):
        assert np.array_equal(wanted, got)

"""The rest of the package's interface: scenarios, recordings, gains, the package without its
extension module."""

import hashlib
import pickle
import shutil

import numpy as np
import pytest
import sls
import yaml
from places import ROOT, run_python
from scipy.linalg import solve_continuous_are

SHORT = ROOT / "config/scenarios/short.yaml"


# --- scenarios ------------------------------------------------------------------------------------


def test_a_scenario_without_changes_is_its_file():
    for scenario in (sls.load_scenario("short"), sls.load_scenario(SHORT),
                     sls.load_scenario(str(SHORT))):
        assert scenario.text == SHORT.read_text()
        assert scenario.sha256 == hashlib.sha256(SHORT.read_bytes()).hexdigest()
        values = yaml.safe_load(scenario.text)
        assert scenario.name == values["name"] == "short"
        assert scenario.period_s == values["sync"]["period_s"]
        assert scenario.step_s == values["plant"]["step_s"]
        assert (scenario.law, scenario.plant) == ("qsf", "slung_load")
        assert scenario.vehicle.load_mass_kg == values["vehicle"]["load_mass_kg"]
        assert scenario.folder == str(SHORT.parent)
        assert len(scenario.vehicles) == 1


def test_changes_are_in_the_text_and_in_force(tmp_path):
    changes = {"vehicle.load_mass_kg": 0.30000000000000004, "controller.law": "pid",
               "controller.gains": {"horizontal": {"position": 1, "velocity": 2, "rod_angle": 30,
                                                   "rod_rate": 10},
                                    "vertical": {"position": 1, "velocity": 2}},
               "plant.initial.load_position_m": np.array([0.1, 0.2, -0.5]),
               "controller.saturate": True,
               "faults": [{"delay": {"on": "command", "by_s": 0.008}}]}
    scenario = sls.load_scenario("short", changes=changes)
    values = yaml.safe_load(scenario.text)
    assert values["vehicle"]["load_mass_kg"] == scenario.vehicle.load_mass_kg == 0.1 + 0.2
    assert values["controller"]["law"] == scenario.law == "pid"
    assert values["plant"]["initial"]["load_position_m"] == [0.1, 0.2, -0.5]
    assert values["controller"]["saturate"] is True
    assert scenario.sha256 == hashlib.sha256(scenario.text.encode()).hexdigest()
    again = sls.load_scenario("short", changes={key: value for key, value in changes.items()
                                                if key != "faults"},
                              faults=changes["faults"], sync__period_s=0.004)
    assert again.text == scenario.text and again == scenario and hash(again) == hash(scenario)
    (tmp_path / "same.yaml").write_text(scenario.text)
    assert sls.fly(tmp_path / "same.yaml").certificate == sls.fly(scenario).certificate
    assert sls.load_scenario(tmp_path / "same.yaml", faults__0__delay__by_s=0.012) != scenario


def test_a_scenario_travels_to_another_process():
    scenario = sls.load_scenario("short", vehicle__load_mass_kg=0.25)
    assert pickle.loads(pickle.dumps(scenario)) == scenario


@pytest.mark.parametrize("changes, message", [
    ({"vehicle.load_mass_kg": -0.16}, "vehicle.load_mass_kg: expected > 0, got -0.16"),
    ({"vehicle.load_mass_kg": "0.3"}, "vehicle.load_mass_kg: expected a number"),
    ({"vehicle.load_mas_kg": 0.3}, "vehicle.load_mas_kg: unknown key; did you mean"),
    ({"vehicle.load_mass_kg": float("nan")}, "vehicle.load_mass_kg: expected a finite number"),
    ({"vehicle.load_mass_kg": object()}, "vehicle.load_mass_kg: expected a number, a text, a list"),
    ({"mission.7.for_s": 1.0}, "mission"),
])
def test_changes_that_no_scenario_has_are_refused(changes, message):
    with pytest.raises(sls.ConfigError) as error:
        sls.load_scenario("short", changes=changes)
    assert message in str(error.value) and "short" in str(error.value)
    assert "\n" not in str(error.value)


# --- recordings -----------------------------------------------------------------------------------


def test_a_recording_has_what_its_flight_has(tmp_path):
    flight = sls.fly("short")
    recording = sls.Recording(flight.save(tmp_path / "r").folder)
    for table in ("state", "measured", "command", "reference"):
        for name, column in getattr(flight, table).items():
            assert np.array_equal(getattr(recording, table)[name], column), name
    assert recording.certificate == flight.certificate
    assert recording.manifest["scenario"] == "short"
    assert recording.vehicle(0).state["step"].dtype == np.int64
    with pytest.raises(sls.ConfigError, match="expected a vehicle of this recording"):
        recording.vehicle(1)
    with pytest.raises(sls.ConfigError, match="expected a recording"):
        sls.Recording(tmp_path)
    drawn = flight.plot().keys()
    for of in (recording, recording.vehicle(0)):
        for name in ("time_s", "quad_position", "quad_velocity", "load_position", "load_velocity", "alpha", "beta",
                     "applied_force", "force", "reference_position"):
            assert np.array_equal(getattr(of, name), getattr(flight, name)), name
        assert np.array_equal(of["load_x_m"], flight["load_x_m"])
        assert np.array_equal(of.calc_load_error(), flight.calc_load_error())
        assert of.attitude is None and of.body_rates is None
        assert [stage.label for stage in of.metrics] == [stage.label for stage in flight.metrics]
        assert of.plot().keys() == drawn > {"positions"}
    assert repr(recording) == f"<sls.Recording {tmp_path / 'r'}: short, mission finished>"


def test_a_flight_is_a_table_of_pandas(tmp_path):
    pandas = pytest.importorskip("pandas")
    flight = sls.fly("short")
    for frame in (flight.to_pandas(), flight.save(tmp_path / "r").to_pandas()):
        assert isinstance(frame, pandas.DataFrame) and frame.index.name == "step"
        for columns, name in ((flight.state, "force_x_n"), (flight.reference, "ref_y_m")):
            assert np.array_equal(frame[name], columns[name])
        assert np.array_equal(frame["force_x_n_command"], flight.command["force_x_n"])
    read = pandas.read_csv(tmp_path / "r/state.csv", float_precision="round_trip")  # docs/tutorial.md
    assert all(np.array_equal(read[name], column) for name, column in flight.state.items())


def test_verify_finds_what_was_changed(tmp_path):
    recording = sls.fly("short").save(tmp_path / "a")
    shutil.copytree(tmp_path / "a", tmp_path / "b")
    state = tmp_path / "b/state.csv"
    lines = state.read_text().split("\n")
    fields = lines[101].split(",")
    fields[9] = "0.125"
    lines[101] = ",".join(fields)
    state.write_text("\n".join(lines))
    changed = sls.Recording(tmp_path / "b")
    found = changed.verify()
    assert not found.is_ok and any("state.csv" in problem for problem in found.problems)
    assert found.certificate != recording.certificate
    compared = recording.compare(changed)
    assert not compared.is_equal and "step 100" in compared.difference
    lines[101] = "0,x"
    state.write_text("\n".join(lines))
    with pytest.raises(sls.RunError, match="state.csv:102: "):
        recording.compare(changed)


# --- gains ----------------------------------------------------------------------------------------


def test_lqr_gains_are_those_of_another_solver():
    for horizontal, vertical in ((10, 5), (0.1, 300), (1e4, 1.0)):
        gains = sls.lqr(horizontal, vertical)
        for axis, weight, order in (("horizontal", horizontal, 4), ("vertical", vertical, 2)):
            chain, input_ = np.eye(order, k=1), np.eye(order)[:, [order - 1]]
            solution = solve_continuous_are(chain, input_, weight * np.eye(order), np.eye(1))
            assert np.allclose(list(gains[axis].values()), (input_.T @ solution)[0], rtol=1e-8)
    assert list(sls.lqr(10, 5)["horizontal"]) == ["position", "velocity", "acceleration", "jerk"]


def test_lqr_gains_fly_as_their_weights():
    weights = sls.fly(sls.load_scenario("short", controller__gains={
        "lqr": {"horizontal": 20, "vertical": 7}}))
    named = sls.fly(sls.load_scenario("short", controller__gains=sls.lqr(20, 7)))
    assert np.array_equal(weights.load_position, named.load_position)
    for bad in ((0, 1), (1, -2), (float("nan"), 1)):
        with pytest.raises(sls.ConfigError, match="expected > 0, got"):
            sls.lqr(*bad)


# --- the package ----------------------------------------------------------------------------------


def test_without_the_extension_module_the_rest_works(monkeypatch, tmp_path):
    folder = sls.fly("short").save(tmp_path / "r").folder
    monkeypatch.setenv("PYTHONPATH", str(ROOT / "python"))
    done = run_python(
        f"import sls\nrecording = sls.Recording({str(folder)!r})\nprint(recording.certificate)\n"
        "try: recording.state\n"
        "except ImportError as error: print(error)\n"
        "import sls.figures, sls.report, sls.study\n"
        "try: sls.fly('short')\n"
        "except ImportError as error: print(error)\n"
        "try: sls.Scenario\n"
        "except ImportError as error: print(error)\n", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    line = "expected the module _sls_core: run ./sls python or ./sls build"
    assert done.stdout.split("\n")[1:4] == [line, line, line]


def test_every_name_is_there_and_described():
    for name in sls.__all__:
        assert getattr(sls, name).__doc__, name
    assert {name for name in dir(sls) if not name.startswith("__")} == set(sls.__all__)
    assert not hasattr(sls, "Any") and not hasattr(sls, "import_module")
    with pytest.raises(AttributeError, match="module 'sls' has no attribute 'flie'"):
        sls.flie


def test_importing_the_package_reads_nothing_else():
    done = run_python("import sys, sls\nprint([name for name in ('numpy', 'matplotlib', '_sls_core')"
                      " if name in sys.modules])")
    assert done.stdout == "[]\n", done.stderr

"""sls.fly, compared with the files that the program `closed_loop` writes for the same flight."""

import csv
import gc
import json
import locale
import os
import signal
import subprocess
import threading
import time

import numpy as np
import pytest
import sls
from places import BUILD, ROOT, run_python
from processes import wait_until

# Noise on the measured state, and a delay of the command.
FAULTS = [{"noise": {"on": "state", "position_m": [0.01, 0.02, 0.03], "seed": 7}},
          {"delay": {"on": "command", "by_s": 0.008}}]
TWO_STAGES = [{"set_point": {"position_m": [0.1, 0, -0.5]}, "for_s": 0.8},
              {"hold": {"position_m": [0.1, 0, -0.5]}, "for_s": 0.4}]
SCENARIOS = {
    "short": ("short", {}),
    "faults": ("short", {"faults": FAULTS}),
    "stages": ("short", {"mission": TWO_STAGES}),
    "attitude": ("multirotor_figure_eight", {"mission.0.for_s": 0.8}),
    "fleet": ("mixed_fleet", {"mission": TWO_STAGES}),
    "fault_of_one": ("mixed_fleet", {"mission": TWO_STAGES,
                                     "faults": [{"noise": {**FAULTS[0]["noise"],
                                                           "vehicle": 1}}]}),
}
TABLES = ("state", "measured", "command", "reference")


def read_rows(file, vehicle_id):
    """The columns of a CSV file, as texts."""
    with open(file, newline="") as lines:
        header, *rows = csv.reader(lines)
    rows = [row for row in rows if int(row[header.index("vehicle_id")]) == vehicle_id]
    return {name: [row[index] for row in rows] for index, name in enumerate(header)}


def test_remarks_of_the_plant_stand_at_the_step_in_which_they_happen(fly_with_program, tmp_path):
    flight = sls.fly(sls.load_scenario("aggressive_slack", changes={"mission.0.for_s": 2}))
    flight.save(tmp_path / "saved")
    for folder in (fly_with_program(flight.scenario)[0], tmp_path / "saved"):
        with open(folder / "status.csv", newline="") as lines:
            steps = {row["reason"][11:21]: int(row["step"]) for row in csv.DictReader(lines)}
        for kind, is_taut in (("cable slac", 0), ("cable taut", 1)):
            after = steps[kind]
            assert flight.state["cable_taut"][after - 1:after + 1].tolist() == [1 - is_taut, is_taut], kind


@pytest.mark.parametrize("name", SCENARIOS)
def test_a_flight_has_the_columns_of_the_programs_files(name, fly_with_program, tmp_path):
    base, changes = SCENARIOS[name]
    flight = sls.fly(sls.load_scenario(base, changes=changes))
    folder, done = fly_with_program(flight.scenario)
    assert done.returncode == 0, done.stderr
    assert flight.is_finished and flight.failure == ""
    for vehicle in flight.vehicles:
        for table in TABLES:
            file = folder / f"{table}.csv"
            if not file.exists():
                continue
            written = read_rows(file, vehicle.vehicle_id)
            if table == "measured" and not written["step"]:
                continue  # the file has rows only of those vehicles whose measured state can differ
            columns = getattr(vehicle, table)
            left_out = {"controller", "compute_us"} if table == "command" else set()
            assert list(columns) == [column for column in written if column not in left_out]
            for column in columns:
                values = columns[column]
                expected = written[column] if values.dtype.kind == "U" else [
                    float(text) for text in written[column]]
                assert values.shape == (len(flight),)
                assert values.tolist() == expected, (table, column)
    manifest = json.loads((folder / "manifest.json").read_text())
    assert flight.certificate == manifest["certificate"]
    assert [vehicle.vehicle_id for vehicle in flight.vehicles] == manifest["vehicle_ids"]

    # The saved flight equals the program's recording.
    recording = flight.save(tmp_path / "saved")
    assert recording.certificate == manifest["certificate"]
    for folders in ((tmp_path / "saved",), (tmp_path / "saved", folder)):
        judged = subprocess.run([BUILD / "bin/sls_verify", *folders], capture_output=True,
                                text=True, timeout=100)
        assert judged.returncode == 0, judged.stdout + judged.stderr
    assert sorted(file.name for file in (tmp_path / "saved").iterdir()) == sorted(
        file.name for file in folder.iterdir())
    assert recording.verify().is_ok and recording.verify().steps == len(flight)
    assert recording.compare(sls.Recording(folder)).is_equal


def test_measured_is_the_state_where_nothing_disturbs_it():
    calm = sls.fly("short")
    assert calm.measured is calm.state
    noisy = sls.fly(sls.load_scenario("short", faults=FAULTS))
    error = noisy.measured["load_z_m"] - noisy.state["load_z_m"]
    assert 0.02 < np.std(error) < 0.04  # 0.03 with 501 samples


def test_columns_are_views_of_one_memory_that_outlive_the_flight():
    flight = sls.fly("short")
    for table in ("state", "command", "reference"):
        columns = getattr(flight, table)
        for name in columns:
            if columns[name].dtype.kind != "U":
                assert not columns[name].flags.owndata and not columns[name].flags.writeable
                assert np.shares_memory(columns[name], flight._cells)
    assert np.shares_memory(flight["load_y_m"], flight.load_position)
    assert np.array_equal(flight.load_position, flight.state.stack(
        ("load_x_m", "load_y_m", "load_z_m")))
    assert np.shares_memory(flight.reference["ref_z_m"], flight.reference_position)
    with pytest.raises(ValueError):
        flight["load_x_m"][0] = 1.0

    kept, copy = flight["load_x_m"], flight["load_x_m"].copy()
    del flight, columns
    gc.collect()
    for mass in (0.1, 0.4):  # these flights would use the memory if it were free
        sls.fly(sls.load_scenario("short", vehicle__load_mass_kg=mass))
    assert np.array_equal(kept, copy)


def test_many_flights_need_no_more_memory_than_one():
    def read_pages():
        with open("/proc/self/statm") as file:
            return int(file.read().split()[1])

    scenario = sls.load_scenario("short")
    for _ in range(20):
        sls.fly(scenario)
    before = read_pages()
    for _ in range(60):
        sls.fly(scenario).certificate
    assert (read_pages() - before) * 4096 < 2 << 20  # one flight has 0.18 MB


def test_metrics_are_those_of_the_recording(tmp_path):
    flight = sls.fly(sls.load_scenario("short", mission=TWO_STAGES))
    recording = flight.save(tmp_path / "r")
    recorded = sls.metrics.calc_stage_metrics(recording.trajectory)
    assert [stage.label for stage in flight.metrics] == ["0 set_point", "1 hold"]
    for ours, theirs in zip(flight.metrics, recorded, strict=True):
        assert (ours.label, ours.from_s, ours.to_s) == (theirs.label, theirs.from_s, theirs.to_s)
        assert np.array_equal(ours.rms_m, theirs.rms_m)
        assert np.array_equal(ours.step.overshoot, theirs.step.overshoot, equal_nan=True)
    error = flight.calc_load_error()[:200]
    assert np.allclose(flight.metrics[0].rms_m, np.sqrt(np.mean(error**2, axis=0)), rtol=1e-12)


def test_one_vehicle_of_a_fleet_flies_alone():
    scenario = sls.load_scenario("mixed_fleet", mission=TWO_STAGES)
    fleet = sls.fly(scenario)
    assert len(fleet.vehicles) == len(scenario.vehicles) > 1
    alone = sls.fly(scenario, vehicle=1)
    assert [vehicle.vehicle_id for vehicle in alone.vehicles] == [1]
    assert np.array_equal(alone.load_position, fleet.vehicles[1].load_position)
    with pytest.raises(sls.ConfigError, match="vehicle: expected one of mixed_fleet, 0 to"):
        sls.fly(scenario, vehicle=len(scenario.vehicles))


def test_a_failed_mission_is_told_and_does_not_raise(fly_with_program, tmp_path):
    # The first force is larger than the limit and is refused.
    scenario = sls.load_scenario("short", controller__force_limit_n=1.0)
    flight = sls.fly(scenario)
    assert not flight.is_finished and "controller.force_limit_n" in flight.failure
    folder, done = fly_with_program(scenario)
    assert done.returncode == 1 and flight.failure in done.stderr
    manifest = json.loads((folder / "manifest.json").read_text())
    assert flight.certificate == manifest["certificate"]
    recording = flight.save(tmp_path / "saved")
    assert recording.manifest["outcome"] == manifest["outcome"] == "failed"
    assert recording.manifest["reason"] == manifest["reason"]
    assert recording.compare(sls.Recording(folder)).is_equal


def test_errors_are_exceptions_with_the_texts_of_the_programs(fly_with_program, tmp_path):
    with pytest.raises(sls.ConfigError) as error:
        sls.fly("no_such_scenario")
    assert str(error.value).endswith("no_such_scenario.yaml: expected a scenario file, got none "
                                     "(No such file or directory)")
    assert isinstance(error.value, ValueError)
    flight = sls.fly("short")
    (tmp_path / "full").mkdir()
    (tmp_path / "full/notes.txt").write_text("mine")
    with pytest.raises(sls.ConfigError) as error:
        flight.save(tmp_path / "full")
    done = subprocess.run([BUILD / "bin/closed_loop", "--scenario",
                           ROOT / "config/scenarios/short.yaml", "--out",
                           tmp_path / "full"], capture_output=True, text=True, timeout=100)
    assert done.returncode == 2 and str(error.value) in done.stderr
    flight.save(tmp_path / "r")
    with pytest.raises(sls.ConfigError):
        flight.save(tmp_path / "r")
    flight.save(tmp_path / "r", force=True)
    with pytest.raises(KeyError, match="expected a column, one of vehicle_id, step"):
        flight["load_w_m"]


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs /dev/full")
@pytest.mark.parametrize("flag", ["-O1", "-Dstrtod_l(text, end, c)=strtod(text, end)"])
def test_a_decimal_comma_changes_no_flight(tmp_path, monkeypatch, flag):
    (tmp_path / "comma").write_text('LC_NUMERIC\ndecimal_point ","\nthousands_sep ""\ngrouping -1\nEND LC_NUMERIC\n')
    subprocess.run(["localedef", "-c", "--no-archive", "-i", "comma", "./xx_XX"], cwd=tmp_path, capture_output=True)
    (tmp_path / "sls").symlink_to(ROOT / "sim_server/plants/shared_library")
    plant = tmp_path / "my_plant.so"
    source = ROOT / "examples/my_plant/my_plant.c"
    subprocess.run(["cc", "-shared", "-fPIC", flag, f"-I{tmp_path}", source, "-o", plant], check=True)
    scenario = sls.load_scenario("short", plant={
        "model": str(plant), "parameters": {"stiffness_n_per_m": 2000.5}, "initial": {"load_position_m": [0, 0, -0.5]}})

    def fly(name):
        sls.fly("aggressive_slack").save(tmp_path / name)
        lines = (tmp_path / name / "flight.txt").read_text().splitlines()
        return sls.fly(scenario).certificate, [line for line in lines if "taut" in line]

    before = fly("before")
    with monkeypatch.context() as patch:
        patch.setenv("LOCPATH", str(tmp_path))
        locale.setlocale(locale.LC_NUMERIC, "xx_XX")
        after, half = fly("after"), locale.str(0.5)
        locale.setlocale(locale.LC_NUMERIC, "C")
    assert after == before and half == "0,5"


def test_a_disk_that_refuses_is_an_os_error(tmp_path):
    code = ("import resource, signal, sls\n"
            "signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
            "flight = sls.fly('short')\n"
            "resource.setrlimit(resource.RLIMIT_FSIZE, (10000, 10000))\n"
            f"try: flight.save({str(tmp_path / 'r')!r})\n"
            "except OSError as error: print(error.errno, error)\n")
    done = run_python(code)
    assert done.stdout.startswith("27 ") and ".csv" in done.stdout, done.stdout + done.stderr
    assert done.stdout.count("\n") == 1


def load_long(seconds):
    """The scenario of a hover for `seconds` of simulation time."""
    return sls.load_scenario("figure_eight", changes={
        "mission": [{"hold": {"position_m": [0, 0, -0.5]}, "for_s": seconds}]})


def test_other_threads_run_while_a_flight_is_flown():
    scenario, ticks, is_over = load_long(100), [], threading.Event()

    def tick():
        while not is_over.is_set():
            ticks.append(time.perf_counter())

    thread = threading.Thread(target=tick)
    thread.start()
    began = time.perf_counter()
    sls.fly(scenario)
    ended = time.perf_counter()
    is_over.set()
    thread.join()
    gaps = np.diff([began, *(at for at in ticks if began < at < ended), ended])
    assert gaps.max() < 0.5 * (ended - began)  # with the GIL held there would be one gap


INTERRUPTED = """
import sls, time
scenario = sls.load_scenario("figure_eight", changes={
    "mission": [{"hold": {"position_m": [0, 0, -0.5]}, "for_s": 20000}]})
LAW
print("flying", flush=True)
try:
    sls.fly(scenario, law)
except KeyboardInterrupt:
    print(time.monotonic())
"""


@pytest.mark.parametrize("law", ["law = None", "law = lambda now: (0.0, 0.0, -1.7 * 9.8)"])
def test_ctrl_c_ends_a_flight_within_a_fifth_of_a_second(law):
    delays = []
    for _ in range(5):  # other processes may hold the processors
        child = subprocess.Popen(["/usr/bin/python3", "-B", "-c", INTERRUPTED.replace("LAW", law)],
                                 stdout=subprocess.PIPE, text=True)
        assert child.stdout.readline() == "flying\n"
        cpu = wait_for_work(child.pid)
        sent = time.monotonic()
        child.send_signal(signal.SIGINT)
        said, _ = child.communicate(timeout=60)
        assert child.returncode == 0 and said, (child.returncode, cpu)
        delays.append(float(said) - sent)
        if delays[-1] < 0.2:
            break
    assert min(delays) < 0.2, delays


def wait_for_work(pid):
    """Waits until the process has used 10 more clock ticks of processor time. Returns all its ticks."""
    def read_ticks():
        with open(f"/proc/{pid}/stat") as file:
            return int(file.read().rsplit(")", 1)[1].split()[11])

    first = read_ticks()
    wait_until(lambda: read_ticks() >= first + 10, 60, "the flight works")
    return read_ticks()

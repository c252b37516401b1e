"""Verdicts of recordings: expectations, refused recordings, the first difference, JUnit and JSON."""

import json
import math
import os
import shutil
import struct
from dataclasses import replace
from xml.etree import ElementTree

import pytest

import sls
from sls.check.check_file import load_check
from sls.check.cli import main
from sls.check.difference import find_difference
from sls.check.judge import Judged, judge, open_recording
from sls.check.results import Result, make_rows, write_json, write_junit


def test_the_table_fits_a_terminal_and_is_whole_in_a_pipe():
    results = [Result("gazebo_corrected", "", "in-process", judged=[Judged("load_error_max_m, stage 3", True, "x" * 64)])]
    assert [len(line) for line in make_rows(results, 80)] == [80, 77] and "x" * 64 in make_rows(results)[1]


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    """A recording of the scenario `short`."""
    folder = tmp_path_factory.mktemp("flown") / "recording"
    sls.fly(sls.load_scenario("short")).save(folder)
    return folder


@pytest.fixture
def recording(flown, tmp_path):
    return shutil.copytree(flown, tmp_path / "recording")


def make_check(folder, *items, scenario="short"):
    file = folder / "check.yaml"
    file.write_text(f"scenario: {scenario}\nexpect:\n" + "".join(f"  - {{ {item} }}\n" for item in items))
    return file


def judge_items(folder, recording, *items):
    check = load_check(make_check(folder, *items))
    return judge(check, open_recording(check, recording))


def find_error(folder, *words):
    """The line of a check that cannot be used, from its JUnit file."""
    assert main([*map(str, words), "--junit", str(folder / "junit.xml")]) == 2
    return ElementTree.parse(folder / "junit.xml").find("testsuite/testcase/error").get("message")


def change(recording, file, step, column, to):
    """Replaces the text of a cell; `to` is a text or a function of the old one."""
    path = recording / file
    lines = path.read_text().split("\n")
    at = next(number for number, line in enumerate(lines) if line.split(",")[1] == str(step))
    cells, place = lines[at].split(","), lines[0].split(",").index(column)
    cells[place] = to(cells[place]) if callable(to) else to
    lines[at] = ",".join(cells)
    path.write_text("\n".join(lines))


def flip(bit):
    def flipped(text):
        bits = struct.unpack("<Q", struct.pack("<d", float(text)))[0] ^ 1 << bit
        return repr(struct.unpack("<d", struct.pack("<Q", bits))[0])
    return flipped


def drop(recording, file, step):
    path = recording / file
    path.write_text("\n".join(line for line in path.read_text().split("\n")
                              if line.split(",")[1:2] != [str(step)]))


# --- expectations ---------------------------------------------------------------------------------


def test_value_bound_margin_and_worst_step_are_those_of_the_flight(flown, tmp_path):
    flight = sls.Recording(flown)
    error = abs(flight.state["load_x_m"] - flight.reference["ref_x_m"])
    outcome, largest, later, least, mean = judge_items(
        tmp_path, flown, "value: 'abs(load_x_m - ref_x_m)', max: 1", "value: 'abs(load_x_m - ref_x_m)', "
        "window_s: [1, 1.2], max: 0.1", "value: sqrt(load_x_m ** 2), over: min, min: 0",
        "value: 0 - load_z_m, over: mean, min: 5, stage: 0")
    assert outcome.is_held and outcome.value == "finished: mission finished" and outcome.step == 500
    assert largest.value == error.max() and largest.step == error.argmax()
    assert largest.margin == 1 - error.max() and largest.time_s == pytest.approx(0.004 * error.argmax())
    assert later.value == error[250:301].max() and not later.is_held and later.margin < 0
    assert least.value == 0 and least.step == 0 and least.is_held
    assert mean.value == pytest.approx(-flight.state["load_z_m"].mean()) and mean.step is None and not mean.is_held


def test_a_measure_is_that_of_the_one_place_that_computes_it(flown, tmp_path):
    from sls.measures import measure
    for name in ("load_error_rms_m", "load_error_max_m", "load_error_end_m", "force_max_n"):
        found = measure(sls.Recording(flown), name, vehicle_id=0)
        judged = judge_items(tmp_path, flown, f"measure: {name}, max: 100")[1]
        assert (judged.value, judged.unit, judged.step) == (found.value, found.unit, found.step)


def test_events_are_counted_with_their_first_step(recording, tmp_path):
    for step, fault in ((100, "held"), (101, "fail_safe"), (102, "fail_safe")):
        change(recording, "command.csv", step, "fault", fault)
    lines = (recording / "status.csv").read_text().split("\n")
    cells = lines[2].split(",")
    for name, count in (("take_overs", "2"), ("rejected_fault", "3")):
        cells[lines[0].split(",").index(name)] = count
    (recording / "status.csv").write_text("\n".join([*lines[:2], ",".join(cells), ""]))
    items = [f"event: {name}, max: 0" for name in ("late_step", "fail_safe", "take_over", "refused_answer")]
    found = [(one.value, one.step) for one in judge_items(tmp_path, recording, *items)[1:]]
    assert found == [(3, 100), (2, 101), (2, 500), (3, 500)]


def test_of_a_fleet_the_worst_vehicle_is_reported(tmp_path):
    sls.fly(sls.load_scenario("short", vehicles=3)).save(tmp_path / "recording")
    text = sls.Recording(tmp_path / "recording").scenario_text
    (tmp_path / "fleet.yaml").write_text(text)
    change(tmp_path / "recording", "state.csv", 200, "load_z_m", "9")
    file = make_check(tmp_path, "value: load_z_m, max: 1", "value: load_z_m, max: 1, vehicle: 2",
                      scenario="fleet.yaml")
    check = load_check(file)
    _, worst, third = judge(check, open_recording(check, tmp_path / "recording"))
    assert (worst.value, worst.step, worst.vehicle, worst.is_held) == (9, 200, 0, False)
    assert third.is_held and third.vehicle == 2


@pytest.mark.parametrize("item, part", [
    ("value: load_w_m, max: 1", "expected a column with numbers, got 'load_w_m'; known are vehicle_id, step, sim"),
    ("value: controller, max: 1", "expected a column with numbers, got 'controller'"),
    ("value: flight.quad_x_m, max: 1", "expected state, reference, command, measured before the dot, got 'flight"),
    ("value: measured.none, max: 1", "expected a column with numbers, got 'measured.none'; known are vehicle_id"),
    ("value: 1 / (step - 300), max: 1", "division by zero in '1 / (step - 300)', at step 300"),
    ("value: sqrt(step - 1), max: 1", "'sqrt(step - 1)' is not defined, at step 0"),
    ("value: exp(step * step), max: 1", "at step 27"),
    ("measure: attitude_max_rad, max: 1", "attitude"),
    ("measure: rotor_saturation, max: 1", "rotor"),
])
def test_an_expectation_that_does_not_fit_the_flight_is_refused(flown, tmp_path, item, part):
    error = find_error(tmp_path, make_check(tmp_path, item), "--recording", flown)
    assert error.startswith(f"{tmp_path}/check.yaml:3: expect[0]: ") and part in error


def test_an_expectation_of_a_stage_that_was_not_flown_is_not_held(tmp_path):
    sls.fly(sls.load_scenario("setpoints", controller__force_limit_n=16.7)).save(tmp_path / "recording")
    recording = sls.Recording(tmp_path / "recording")
    (tmp_path / "weak.yaml").write_text(recording.scenario_text)
    check = load_check(make_check(tmp_path, "measure: load_error_end_m, stage: 2, max: 1", scenario="weak.yaml"))
    outcome, late = judge(check, open_recording(check, tmp_path / "recording"))
    assert not outcome.is_held and outcome.value.startswith("failed: ") and "force" in outcome.value
    assert not late.is_held and late.problem.startswith("undefined: ")
    check = load_check(make_check(tmp_path, "outcome: failed, reason: force", scenario="weak.yaml"))
    assert [one.is_held for one in judge(check, open_recording(check, tmp_path / "recording"))] == [True]


# --- recordings that cannot be judged -------------------------------------------------------------


@pytest.mark.parametrize("key, value, part", [
    ("scenario_sha256", "0" * 64, "short.yaml, SHA-256"),
    ("missing", [{"topic": "sls/state", "vehicle_id": 0, "from": 3, "to": 4}], "2 samples missing, first sls/state"),
    ("outcome", "recording", "its recorder was killed"),
    ("outcome", "interrupted", "interrupted"),
])
def test_an_incomplete_or_foreign_recording_is_refused(recording, tmp_path, capsys, key, value, part):
    manifest = json.loads((recording / "manifest.json").read_text())
    manifest |= {key: value, "complete": False}
    (recording / "manifest.json").write_text(json.dumps(manifest))
    error = find_error(tmp_path, make_check(tmp_path, "outcome: finished"), "--recording", recording)
    assert f"{recording}: expected a" in error and part in error
    assert part in capsys.readouterr().out


# --- the first difference -------------------------------------------------------------------------

STATE, COMMAND, REFERENCE = ("state.csv", "sls/state"), ("command.csv", "sls/command"), ("reference.csv", "sls/command")
PLANTED = [  # what is changed: file and topic, step, column, new text; and the column that is named
    *[(STATE, step, column, flip(bit)) for step, column, bit in (
        (3, "quad_x_m", 0), (100, "load_z_m", 1), (499, "alpha_rad", 0), (500, "beta_dot_rad_s", 51),
        (250, "force_z_n", 63), (7, "quad_vy_m_s", 30), (77, "load_vx_m_s", 0), (1, "sim_time_s", 0))],
    *[(COMMAND, step, column, to) for step, column, to in (
        (0, "force_x_n", flip(0)), (321, "force_y_n", flip(2)), (42, "fault", "held"), (43, "fault", "fail_safe"))],
    *[(REFERENCE, step, column, to) for step, column, to in (
        (9, "ref_sz_m_s4", flip(0)), (333, "ref_x_m", flip(0)), (200, "stage", "1"), (201, "stage_name", "other"))],
    (STATE, 150, "", None), (COMMAND, 151, "", None), (REFERENCE, 500, "", None),
]


@pytest.mark.parametrize("planted", PLANTED, ids=[f"{file[0]}-{step}-{column}" for file, step, column, _ in PLANTED])
def test_a_planted_difference_is_named_with_step_column_and_topic(flown, recording, planted):
    (file, topic), step, column, to = planted
    if to is None:
        drop(recording, file, step)
    else:
        change(recording, file, step, column, to)
    text = find_difference(flown, recording)
    assert f"step {step}" in text and (f", {column}: " in text if column else "alone" in text), text
    assert f"(topic {topic})" in text


def test_a_planted_event_is_named_with_its_step(flown, recording):
    assert find_difference(flown, recording) == ""
    change(recording, "status.csv", "finished", "take_overs", "1")
    assert find_difference(flown, recording) == "status.csv, step 500, take_overs: 1 in B alone (topic sls/status)"


# --- JUnit, JSON, --update ------------------------------------------------------------------------


def test_junit_and_json_have_one_entry_for_each_flight(tmp_path, flown):
    result = Result("one", "one.yaml", "shm", problem="controller: \x1b[1m<killed> & \"gone\"",
                    logs={"server": "a\x00\nb"})
    held = Result("one", "one.yaml", "in-process", judged=judge_items(tmp_path, flown, "value: load_x_m, max: 9"))
    broken = Result("two", "two.yaml", problem="two.yaml:1: no", is_unusable=True)
    held.judged[1] = replace(held.judged[1], value=math.inf)
    write_junit(tmp_path / "out/junit.xml", [result, held, broken])
    write_json(tmp_path / "out/json.json", [result, held, broken])
    root = ElementTree.parse(tmp_path / "out/junit.xml").getroot()
    assert root.tag == "testsuites" and [root.get(key) for key in ("tests", "failures", "errors")] == ["3", "1", "1"]
    assert [suite.get("name") for suite in root] == ["one", "two"]
    failed, passed = root[0].findall("testcase")
    assert failed.get("classname") == "one" and failed.get("name") == "shm" and float(failed.get("time")) == 0
    assert failed.find("failure").get("message") == "one.yaml: controller: ?[1m<killed> & \"gone\""
    assert root[1].find("testcase/error").get("message") == "two.yaml:1: no"
    assert {key for case in root.iter("testcase") for key in case.attrib} == {"classname", "name", "time"}  # Ant's
    assert "server: a?" in failed.find("system-err").text and len(passed) == 0
    data = json.loads((tmp_path / "out/json.json").read_text())
    assert data["exit_code"] == 2 and [one["verdict"] for one in data["flights"]] == ["not held", "held", "unusable"]
    assert data["flights"][1]["expectations"][1]["value"] == "inf"


@pytest.mark.parametrize("words", [["{file}"], ["none.yaml"], ["{file}", "--placement", "moon"], ["{file}", "--what"],
                                   ["{file}", "--under", "loss=3"], [], ["{file}", "--recording", "none"],
                                   ["{file}", "--placement", "hosts"], ["{file}", "--library", "none.so"]])
def test_a_junit_file_is_written_for_every_mistake(tmp_path, capsys, monkeypatch, words):
    monkeypatch.setattr(os, "geteuid", lambda: 1000)  # hosts need root
    file = make_check(tmp_path, "outcome: landed" if words == ["{file}"] else "outcome: finished")
    error = find_error(tmp_path, *[word.format(file=file) for word in words])
    said = "".join(capsys.readouterr())
    assert error and error in said
    assert ("expected root and the programs ip, nft and tc, got another user" in error) == ("hosts" in words)


def test_two_checks_of_one_name_are_refused(tmp_path):
    (tmp_path / "other").mkdir()
    files = [make_check(folder, "outcome: finished") for folder in (tmp_path, tmp_path / "other")]
    assert find_error(tmp_path, *files) == f"{files[0]}: expected checks of different names, got {files[1]}, too"


def test_update_writes_the_certificate_and_nothing_else(tmp_path, flown):
    file = make_check(tmp_path, "certificate: unknown, because: known", "value: load_x_m, max: 9")
    before = file.read_text()
    assert main([str(file)]) == 1
    assert main([str(file), "--update"]) == 0
    assert file.read_text() == before.replace("unknown", sls.Recording(flown).certificate)
    assert main([str(file)]) == 0

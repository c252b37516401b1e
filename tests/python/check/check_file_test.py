"""Check files and the words of --under: what is read, and one line for each mistake."""

from xml.etree import ElementTree

import pytest
import yaml

from sls.campaign.yaml_nodes import parse_yaml
from sls.check.check_file import EVENTS, KINDS, OVER, find_checks, load_check
from sls.check.cli import main
from sls.check.faults import PLACEMENTS, WORDS, check_able, list_faults, parse_fault
from sls.errors import ConfigError
from sls.measures import MEASURES
from sls.scenario import ROOT, SHIPPED

OUTCOME = "{ outcome: finished }"
# Of each mistake: the text of the file, and parts of the one line that names it.
MISTAKES = [
    ("", ":1: expected a check: scenario, expect …, got nothing"),
    ("expect: [{ outcome: finished }]", "scenario: missing key"),
    ("scenario: short", "expect: missing key"),
    ((SHIPPED / "short.yaml").read_text(), "expected a check, which names a scenario", "got a scenario: ./sls run flies it"),
    ("scenario: shrot\nexpect: [{ outcome: finished }]", ":1: scenario: expected a scenario, got no such file"),
    ("scenario: none.yaml\nexpect: [{ outcome: finished }]", ":1: scenario: expected a scenario, got no such file"),
    ("scenario: short\nexpects: []", ":2: expects: unknown key; did you mean 'expect'?"),
    ("scenario: short\nscenario: short", ":2: scenario: duplicate key"),
    ("scenario: short\nexpect: []", ":2: expect: expected a list of expectations"),
    ("scenario: short\nexpect: { outcome: finished }", ":2: expect: expected a list of expectations"),
    ("scenario: short\nexpect: [{ outcome: finished }", "expected YAML, got a syntax error"),
    ("scenario: short\nexpect: &a [{ outcome: finished }]", ":2: expected a value, got a YAML anchor"),
] + [(f"scenario: mission\nexpect:\n  - {{ {item} }}", ":3: ", *parts) for item, *parts in [
    ("max: 3", "expected exactly one of outcome, measure, value, event, certificate, got none"),
    ("outcome: finished, event: take_over", "got outcome and event"),
    ("outcome: landed", "expect[0].outcome: expected one of finished, failed, got landed"),
    ("outcome: finished, max: 3", "expect[0].max: expected no such key beside outcome: finished"),
    ("outcome: finished, resaon: x", "unknown key; did you mean 'reason'?"),
    ("measure: load_error_rsm_m, max: 1", "expected a measure, got load_error_rsm_m; did you mean 'load_error_rms_m'?"),
    ("measure: load_error_max_mm, max: 1", "expected the unit m (load_error_max_m), got load_error_max_mm"),
    ("measure: load_error_max_m", "expected a bound, min or max, got none"),
    ("measure: load_error_max_m, max: 2 cm", "expect[0].max: expected a number (m), got 2 cm"),
    ("measure: load_error_max_m, max: .nan", "expect[0].max: expected a number (m), got .nan"),
    ("measure: load_error_max_m, min: 2, max: 1", "expect[0].max: expected at least min (2), got 1"),
    ("measure: load_error_max_m, max: 1, for_s: 1", "for_s: expected no such key beside measure: load_error_max_m"),
    ("measure: load_error_max_m, max: 1, stage: 6", "expected a stage of mission (0 hold, 1 set_point", "got 6"),
    ("measure: load_error_max_m, max: 1, stage: landing", "expected a stage of mission", "got landing"),
    ("measure: load_error_max_m, max: 1, stage: set_point", "expected an index, because 4 stages have this name"),
    ("measure: load_error_max_m, max: 1, axis: w", "axis: expected one of x, y, z, got w"),
    ("measure: load_error_max_m, max: 1, vehicle: 1", "vehicle: expected a whole number from 0 to 0, got 1"),
    ("measure: load_error_max_m, max: 1, window_s: [5, 3]", "expected a window [from, to] in s"),
    ("measure: load_error_max_m, max: 1, window_s: 5", "expected a window [from, to] in s"),
    ("measure: settling_s, max: 1, within_m: 0", "within_m: expected a number of m > 0, got 0"),
    ("event: takeover, max: 0", "event: expected one of take_over, fail_safe, late_step, refused", "got takeover"),
    ("event: take_over, max: 0, stage: 1", "stage: expected no such key beside event: take_over"),
    ("value: 'load_x_m +', max: 0", "value: expected arithmetic, got 'load_x_m +'"),
    ("value: 'open(load_x_m)', max: 0", "unknown function 'open'; known are abs"),
    ("value: load_x_m, max: 0, over: median", "over: expected one of max, min, mean, rms, end, got median"),
    ("value: load_x_m, max: 0, axis: x", "axis: expected no such key beside value: load_x_m"),
    ("certificate: 3f", "certificate: expected 64 hexadecimal digits, or unknown", "got 3f"),
]] + [(f"scenario: short\nexpect: [{OUTCOME}]\n{text}", *parts) for text, *parts in [
    ("placements: [shm, moon]", ":3: placements[1]: expected one of in-process, shm, udp, hosts, worlds, got moon"),
    ("placements: shm", ":3: placements: expected a list of in-process"),
    ("placements: []", ":3: placements: expected a list of in-process"),
    ("under: { loss: 2 }", ":3: under.loss: loss: expected 0 to 0.9, got '2'"),
    ("under: { gust: 2 }", ":3: under.gust: unknown key"),
    ("under: [kill=server]", ":3: under[0]: kill: expected controller, got 'server'"),
    ("under: [rain]", ":3: under[0]: expected a fault (loss", "got 'rain'"),
    ("limit_s: 0", ":3: limit_s: expected a number of seconds > 0, got 0"),
    ("participants: { server: {} }", ":3: participants.server: unknown key; expected one of controller"),
    ("participants: { controller: {}, controller: {} }", ":3: participants.controller: duplicate key"),
    ("participants: { controller: {} }", "expected exactly one of command, python, library, got none"),
    ("participants: { controller: { command: [sh], python: b } }", "got command and python"),
    ("participants: { controller: { command: a } }", "command: expected a list of words"),
    ("participants: { controller: { command: [sh, 3] } }", "command[1]: expected a word in quotes, got 3"),
    ("participants: { controller: { command: [./none] } }", ":3: participants.controller.command[0]: expected a program",
     "got ./none"),
    ("participants: { controller: { command: [no-engine, run] } }", "expected a program that exists, got no-engine"),
    ("participants: { controller: { python: none.py:law } }", "python: expected FILE.py:NAME", "got none.py:law"),
    ("participants: { controller: { library: none.so } }", "library: expected a library's file, got none.so"),
    ("participants: { controller: { library: short.so, env: { A: b } } }", "library: expected a library's file"),
    ("participants: { controller: { command: [sh], env: { A: 1 } } }", "env.A: expected a text in quotes, got 1"),
    ("participants: { controller: { command: [sh], stop: SIGWHAT } }", "stop: expected one of SIGINT, SIGTERM"),
    ("participants: { controller: { command: [sh], ready_s: no } }", "ready_s: expected a number of seconds > 0"),
    ("participants: { controller: { command: [sh] } }\nplacements: [shm, in-process]",
     ":4: placements[1]: expected shm, udp or hosts, because its controller is a command, got in-process"),
]] + [(f"scenario: short\nexpect: [{{ {item}, max: 0 }}]\nplacements: [worlds]",
       f":3: placements[0]: expected another placement, because worlds do not judge {item.partition(' ')[2]} (line 2)")
      for item in ("event: take_over", "event: late_step", "measure: late_steps", "measure: answer_age_max_ms")
] + [("scenario: short\nexpect: [{ value: load_x_m, max: 0, window_s: [0, 3] }]",
       "expected a window within the flight, which ends at 2 s, got 3 s")]


@pytest.mark.parametrize("mistake", MISTAKES, ids=[" ".join(text.split())[:60] for text, *_ in MISTAKES])
def test_a_mistake_is_one_line_with_place_expected_and_got(tmp_path, capsys, mistake):
    text, *parts = mistake
    file, junit = tmp_path / "check.yaml", tmp_path / "junit.xml"
    file.write_text(text + "\n")
    assert main([str(file), "--junit", str(junit)]) == 2
    said = ElementTree.parse(junit).find("testsuite/testcase/error").get("message")
    assert capsys.readouterr().err == f"sls: error: {said}\n" and said.startswith(f"{file}:")
    for part in parts:
        assert part in said


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(ConfigError, match=r"none\.yaml: expected a check file, got no file"):
        load_check(tmp_path / "none.yaml")
    with pytest.raises(ConfigError, match="expected a check, got no such file; did you mean 'short'"):
        find_checks("shrot")
    with pytest.raises(ConfigError, match="expected a folder with check files"):
        find_checks(str(tmp_path))


def test_a_file_is_read_with_its_defaults(tmp_path):
    file = tmp_path / "mine.yaml"
    file.write_text("""\
scenario: mission
expect:
  - { measure: settling_s, stage: 3, within_m: 0.05, for_s: 1, max: 12, because: "fast enough" }
  - { value: "abs(load_x_m - ref_x_m)", stage: figure_eight, window_s: [60, 80], max: 0.1 }
participants: { controller: { command: [sh, "{domain}"], env: { A: b }, ready: joined, stop: SIGINT } }
under: { loss: 0.2, busy: }
""")
    check = load_check(file)
    assert check.name == "mine" and check.scenario_file == SHIPPED / "mission.yaml" and check.is_lockstep
    implied, settling, value = check.expectations
    assert (implied.kind, implied.what) == ("outcome", "finished")  # unless the file says another one
    assert settling.text == "settling_s, within_m 0.05, for_s 1.0, stage 3" and settling.because == "fast enough"
    assert value.stage == 4 and value.window_s == (60, 80) and value.over == "max"
    assert check.placements == ("shm",)  # a command cannot fly in process
    assert check.controller.words == ("sh", "{domain}") and check.controller.stop.name == "SIGINT"
    assert [str(fault) for fault in check.faults] == ["loss=0.2", "busy"]


@pytest.mark.parametrize("word", WORDS)
def test_a_fault_that_a_placement_cannot_do_is_refused_by_name(word):
    number, able = WORDS[word]
    fault = parse_fault(word if not number else f"{word}={number[-1]}")
    for placement in ("in-process", "shm", "udp", "hosts", "worlds"):
        if placement in able:
            check_able((fault,), placement)
        else:
            with pytest.raises(ConfigError, match=rf"--under {word}.*expected a placement that can do it.*{placement}"):
                check_able((fault,), placement)


def test_the_reference_describes_every_word():
    page = (ROOT / "config/checks/README.md").read_text()
    words = [*MEASURES, *EVENTS, *PLACEMENTS, *OVER, *KINDS,
             *(f"{word}=" if kind[0] else word for word, kind in WORDS.items())]
    assert [word for word in words if f"`{word}" not in page] == []


def test_faults_are_read_from_a_list_and_from_a_map(tmp_path):
    for text in ("[loss=0.1, kill=controller]", "{ loss: 0.1, kill: controller }"):
        assert [str(fault) for fault in list_faults(parse_yaml(text.encode(), tmp_path))] == [
            "loss=0.1", "kill=controller"]


def test_every_shipped_scenario_has_a_check_with_a_reason_for_each_bound():
    files = {file.stem: file for file in find_checks(str(ROOT / "config/checks"))}
    assert set(files) == {file.stem for file in SHIPPED.glob("*.yaml")}
    for name, file in files.items():
        check = load_check(file)
        assert check.scenario.name == name
        items = yaml.safe_load(file.read_text())["expect"]
        assert all(item.get("because") for item in items) and items, file

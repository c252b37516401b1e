"""Checks flown with real processes: placements, faults, the user's own controllers, and what a verdict says of those
that crash, hang or never come."""

import json
import os
import re
import shutil
import signal
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest
from places import BUILD, ROOT

import sls.check.flights
import sls.figures
from sls.check.cli import main

LAW = """
import ctypes, time
def law(now):
    error = [r - p for r, p in zip(now.reference.position, now.load_position)]
    return 0.0, 0.0, -1.7 * 9.8 + 3 * error[2] - 3 * now.quad_velocity[2]
def crash(now):
    if now.step == 300:
        ctypes.string_at(0)
    return law(now)
def hang(now):
    if now.step == 300:
        time.sleep(1000)
    return law(now)
def nonsense(now):
    return (0.0, 0.0, -1e9) if now.step == 300 else law(now)
def broken(now):
    return {}["gain"]
"""
SCENARIO = """
name: mine
vehicle: { quad_mass_kg: 1.5, load_mass_kg: 0.2, rod_length_m: 1.0, gravity_m_s2: 9.8 }
plant: { initial: { load_position_m: [0, 0, -1] } }
sync: { wait_for: { controllers: 1, recorders: 1, timeout_s: 60 } }
mission:
  - set_point: { position_m: [0, 0, -2] }
    for_s: 20
"""
IS_ROOT = os.geteuid() == 0 and all(shutil.which(tool, path="/usr/sbin:/usr/bin:/bin") for tool in ("ip", "nft", "tc"))
needs_hosts = pytest.mark.skipif(not IS_ROOT, reason="network namespaces need root, ip and nft")


@pytest.fixture
def check(tmp_path, monkeypatch, capfd):
    """A function that writes a check of `mine` and flies it. It returns exit code, flights of the JSON, and output. The
    command runs in this process, which imports its packages once."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "law.py").write_text(LAW)
    (tmp_path / "mine.yaml").write_text(SCENARIO)

    def run(controller, *words, expect="{ measure: load_error_end_m, max: 0.05 }", scenario="mine.yaml"):
        participants = f"participants: {{ controller: {{ {controller} }} }}\n" if controller else ""
        file = tmp_path / "check.yaml"
        file.write_text(f"scenario: {scenario}\n{participants}expect:\n  - {expect}\n")
        code = main([str(file), "--json", "json", "--junit", "junit.xml", *words])
        said = "".join(capfd.readouterr())
        flown = json.loads((tmp_path / "json").read_text())["flights"]
        suites, verdicts = ElementTree.parse(tmp_path / "junit.xml").getroot(), [one["verdict"] for one in flown]
        assert [int(suites.get(key)) for key in ("tests", "failures", "errors")] == [
            len(flown), verdicts.count("not held"), verdicts.count("unusable")], said
        return code, flown, said
    return run


@pytest.fixture
def impatient(monkeypatch):
    """A controller has 1 s to end after its stop signal, instead of 10 s."""
    monkeypatch.setattr(sls.check.flights, "STOP_S", 1.0)


def start(folder, *words):
    return subprocess.Popen([sys.executable, "-BP", "-m", "sls.check", *words], cwd=folder, text=True,
                            stdout=subprocess.PIPE, stderr=subprocess.STDOUT)


# --- placements -----------------------------------------------------------------------------------


def test_every_placement_gives_the_same_verdict_and_bytes(check, tmp_path):
    (tmp_path / "mine.yaml").write_text(SCENARIO.replace("for_s: 20", "for_s: 6"))
    code, flights, said = check("", "--placement", "in-process,shm,udp,worlds", "--repeat", "2", "--jobs", "2")
    assert code == 0 and {one["verdict"] for one in flights} == {"held"}, said
    assert len({one["certificate"] for one in flights}) == 1 and len(flights) == 8
    assert [(one["placement"], one["repeat"]) for one in flights[1:3]] == [("in-process", 2), ("shm", 1)]
    assert "8 flights: 8 held; the flights of each check have equal bytes" in said


@needs_hosts
def test_hosts_that_lose_packets_and_are_cut_give_the_same_bytes(check):
    code, flights, said = check("python: law.py:law", "--placement", "hosts", "--under", "loss=0.1,partition_s=0.5",
                                expect="{ measure: load_error_end_m, max: 0.05 }")
    assert code == 0, said
    assert flights[0]["certificate"] == check("python: law.py:law")[1][0]["certificate"]
    assert not [path for path in Path("/run/netns").glob(f"sls-check-{os.getpid()}-*")]


@pytest.fixture
def one_core():
    """The test and its programs run on one core."""
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {min(before)})
    yield
    os.sched_setaffinity(0, before)


def test_a_killed_controller_is_replaced_by_its_standby(check, one_core):
    code, flights, said = check("", "--placement", "shm", "--under", "kill=controller,busy", scenario="figure_eight",
                                expect="{ event: take_over, min: 1, max: 1 }")
    assert code == 0, said
    assert flights[0]["certificate"] == check("", scenario="figure_eight")[1][0]["certificate"]


def test_worlds_fly_the_faults_of_the_vocabulary(check):
    code, flights, said = check("", "--placement", "worlds", "--under", "loss=0.2,partition_s=1,kill=controller")
    assert code == 0 and flights[0]["under"] == "loss=0.2,partition_s=1,kill=controller", said


# --- the user's own controller --------------------------------------------------------------------


def test_a_client_in_c_is_checked(check):
    client, scenario = BUILD / "tests/my_client/build/my_client", ROOT / "examples/my_client/my_client.yaml"
    if not client.exists():
        pytest.skip("needs cyclonedds-dev and cyclonedds-tools")
    placements = "shm,udp,hosts" if IS_ROOT else "shm,udp"
    code, flights, said = check(f"command: [{client}, '{{domain}}'], stop: SIGINT", "--placement", placements,
                                scenario=str(scenario), expect="{ measure: load_error_end_m, max: 0.05 }")
    assert code == 0 and len({one["certificate"] for one in flights}) == 1, said


def test_a_law_in_python_flies_in_process_and_as_a_client(check):
    code, flights, said = check("python: law.py:law", "--placement", "in-process,shm")
    assert code == 0 and len({one["certificate"] for one in flights}) == 1, said


def test_the_example_of_the_document_holds_and_its_bug_is_found(tmp_path):
    page = (ROOT / "docs/testing-your-controller.md").read_text()
    for name in ("law.py", "climb.yaml", "check.yaml"):
        block = re.search(rf"`mine/{name}`:\n\n((?:    .*\n|\n)+)", page)[1]
        (tmp_path / name).write_text(re.sub("^    ", "", block, flags=re.MULTILINE))
    assert start(tmp_path, "check.yaml").wait(60) == 0
    law = (tmp_path / "law.py").read_text()
    (tmp_path / "law.py").write_text(law.replace("3 * error[2]", "0.3 * error[2]"))
    failed = start(tmp_path, "check.yaml")
    assert "settling_s" in failed.communicate(timeout=60)[0] and failed.returncode == 1


SHELL = "command: [sh, -c, '{}']"
CLIENT = (f"command: [{sys.executable}, -BPm, sls.check.python_law, client, 'law.py:hang', "
          "'{scenario}', '{qos}', '{domain}', '{name}', '{strength}']")


@pytest.mark.parametrize("controller, expected", [
    (SHELL.format("echo no licence; exit 3"),
     "controller: ended with 3 at step 0, before the flight was over: no licence"),
    (SHELL.format("exit 0"), "controller: ended with 0 at step 0, before the flight was over, without a word"),
    (SHELL.format("sleep 1000"), "outcome finished: expected it, got failed: not ready within 4 s: controller"),
    (SHELL.format("echo hello; sleep 1000") + ", ready: joined, ready_s: 3",
     "controller: expected 'joined' in its output within 3 s, got hello"),
    ("python: law.py:crash", "controller: ended by SIGSEGV at step 300, before the flight was over"),
    ("python: law.py:hang, silent_s: 1", "controller: expected an answer within 1 s, got none after step 299"),
    (f"{CLIENT}, silent_s: 1", "controller: expected an answer within 1 s, got none after step 299"),
    ("python: law.py:nonsense", "failed: controller 'controller' answered step 300 with a force beyond"),
    ("python: law.py:broken", "controller: ended with 1 at step 0, before the flight was over: controller: "),
])
def test_the_verdict_names_what_a_controller_did(check, impatient, monkeypatch, tmp_path, controller, expected):
    # Drawing takes seconds.
    monkeypatch.setattr(sls.figures, "save", lambda figure, path, *_, **__: path.write_text("<svg></svg>"))
    if "not ready within 4 s" in expected:
        (tmp_path / "mine.yaml").write_text(SCENARIO.replace("timeout_s: 60", "timeout_s: 4"))
    has_page = "licence" in controller or "crash" in controller  # without steps, and with figures
    code, flights, said = check(controller, "--placement", "shm", *["--report", "pages"] * has_page)
    assert code == 1 and flights[0]["verdict"] == "not held", said
    assert any(expected in problem for problem in flights[0]["problems"]), flights[0]["problems"]
    if not has_page:
        return
    page = (tmp_path / "pages/check-shm/report.html").read_text()
    assert expected.partition(",")[0].replace("'", "&#x27;") in page and "Output of the programs" in page
    assert re.search('class="badge (.*?)<', page)[1] == 'bad">not held'
    index = (tmp_path / "pages/index.html").read_text()
    assert "<h1>Checks</h1>" in index and "1 flight: 1 not held" in index and "badge bad" in index, index
    assert "<th>verdict</th>" in index and expected.partition(",")[0].replace("'", "&#x27;") in index


@pytest.mark.parametrize("controller, expected", [
    ("python: law.py:hang, silent_s: 1", "controller: expected an answer within 1 s, got none after step 299"),
    ("python: late.py:law, ready_s: 2", "controller: expected an answer within 2 s, got none"),
    ("python: law.py:crash", "controller: ended by SIGSEGV at step 299, before the flight was over"),
])
def test_the_verdict_names_what_a_law_did_in_one_process(check, tmp_path, controller, expected):
    (tmp_path / "late.py").write_text("import time\ntime.sleep(1000)\n")
    code, flights, said = check(controller, "--placement", "in-process")
    assert code == 1 and flights[0]["problems"][0].startswith(expected), said


def test_a_library_that_hangs_is_named_with_its_step(check, tmp_path):
    source = (ROOT / "examples/ci/my_law.c").read_text()
    begin = "const sls_controller_setup* setup = controller;\n"
    assert source.count(begin) == 1
    (tmp_path / "hang.c").write_text("#include <unistd.h>\n" + source.replace(
        begin, begin + "  while (now->step == 300) pause();\n"))
    (tmp_path / "include").mkdir()
    (tmp_path / "include/sls").symlink_to(ROOT / "control_client/laws/shared_library")
    subprocess.run(["gcc", "-fPIC", "-shared", "-Iinclude", "-o", "hang.so", "hang.c"], cwd=tmp_path, check=True)
    code, flights, said = check("library: hang.so, silent_s: 4", "--placement", "in-process,shm", "--jobs", "2")
    assert code == 1 and [one["verdict"] for one in flights] == ["not held"] * 2, said
    for one in flights:
        assert re.match(r"controller: expected an answer within 4 s, got none( after step \d+)?: \w+: warning: .*hang.so: "
                        r"answer, vehicle 0, step 300: has not returned for 2 s", one["problems"][0]), one["problems"]


@pytest.mark.parametrize("controller, expected", [
    ("command: [./docker, run, image]", "controller: ended with 125 at step 0, before the flight was over: docker: Cannot "
     "connect"),
    ("python: law.py:none", "controller: ended with 2 at step 0, before the flight was over: controller: "),
])
def test_a_controller_that_cannot_be_used_is_a_mistake(check, tmp_path, controller, expected):
    (tmp_path / "docker").write_text("#!/bin/sh\necho docker: Cannot connect; echo Run docker --help; exit 125\n")
    (tmp_path / "docker").chmod(0o755)
    code, flights, said = check(controller, "--placement", "shm")
    assert code == 2 and flights[0]["verdict"] == "unusable" and flights[0]["problems"][0].startswith(expected), said


CHECK = f"{sys.executable} -BP -m sls.check check.yaml --junit junit.xml"
SHM = f"{CHECK} --placement shm"


@pytest.mark.parametrize("code, command, expected", [
    (0, f"PYTHONIOENCODING=ascii {CHECK}", "<= 0.05"),
    (0, f"PYTHONIOENCODING=latin-1 {CHECK}", "<= 0.05"),
    (0, f"{CHECK} 2>&1 | true; exit $PIPESTATUS", ""),
    (2, f"{CHECK} >/dev/full", "No space"),
    (0, f"ROS_DISCOVERY_SERVER=127.0.0.1:1 FASTDDS_ENVIRONMENT_FILE=none SLS_DOMAIN=x {SHM}", "1 held"),
    (2, f"TMPDIR=$PWD/$'\\xff' && mkdir $TMPDIR && export TMPDIR && {CHECK}", "expected a path in UTF-8, got byte 0xff"),
    (2, f"mkdir full && mount -t tmpfs -o size=40k none full && TMPDIR=$PWD/full {CHECK}", "flight, got: No space"),
    (2, f"mkdir full && mount -t tmpfs -o size=40k none full && TMPDIR=$PWD/full {SHM}", "flight, got: No space"),
    (2, f"mount -t tmpfs -o size=64k none /dev/shm && {SHM}", "/dev/shm: expected room for a flight, got: No space"),
    (2, f"mount -t tmpfs -o ro none /dev/shm && {SHM}", "/dev/shm: expected room for a flight, got: Read-only"),
    (0, f"mount -t tmpfs -o ro none /dev/shm && {CHECK} --placement udp", "1 held"),
    (2, f"echo raise OSError >numpy.py; PYTHONPATH=.:$PYTHONPATH {CHECK}", "OSError"),
])
def test_the_environment_is_not_the_controller(tmp_path, code, command, expected):
    if "mount" in command and not IS_ROOT:
        pytest.skip("a file system of its own needs root")
    (tmp_path / "mine.yaml").write_text(SCENARIO.replace("for_s: 20", "for_s: 6"))
    (tmp_path / "check.yaml").write_text("scenario: mine.yaml\nexpect: [{ measure: load_error_end_m, max: 0.05 }]\n")
    done = subprocess.run([*["unshare", "-m"] * IS_ROOT, "bash", "-c", command], cwd=tmp_path, text=True, timeout=60,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, errors="replace")
    assert done.returncode == code and expected in done.stdout and "Traceback" not in done.stdout, done.stdout
    suites = ElementTree.parse(tmp_path / "junit.xml").getroot()
    assert [suites.get(key) for key in ("failures", "errors")] == ["0", str(code // 2)]


def test_a_process_that_does_not_stop_is_killed_and_named(check, impatient):
    client = f"{BUILD}/bin/control_client --scenario mine.yaml --domain {{domain}}"
    stubborn = f"trap : TERM; {client}; sleep 1000 & wait; wait"
    code, flights, said = check(f"command: [bash, -c, '{stubborn}']", "--placement", "shm")
    assert code == 1 and "expected an end within 1 s after SIGTERM, got none: killed" in said


def test_an_interrupted_check_ends_its_programs_and_says_so(tmp_path):
    (tmp_path / "mine.yaml").write_text(SCENARIO)
    controller = "{ command: [sh, -c, 'echo $$ > pid; sleep 1000'] }"
    (tmp_path / "check.yaml").write_text("scenario: mine.yaml\nexpect: [{ outcome: finished }]\n"
                                         f"participants: {{ controller: {controller} }}\n")
    running = start(tmp_path, "check.yaml", "--junit", "junit.xml")
    while running.poll() is None and not (tmp_path / "pid").exists():
        pass
    running.send_signal(signal.SIGINT)
    assert running.wait(60) == 130
    assert "interrupted" in (tmp_path / "junit.xml").read_text()
    assert not Path("/proc", (tmp_path / "pid").read_text().strip() or "none").exists()


def test_two_flights_that_differ_are_named_with_the_first_step(check, tmp_path):
    (tmp_path / "law.py").write_text("import os, time\nSEED = os.stat('/proc/self').st_ino % 1000\n"
                                     "def law(now):\n    return 0.0, 1e-9 * SEED * (now.step == 5), -1.7 * 9.8\n")
    code, flights, said = check("python: law.py:law", "--repeat", "2", expect="{ outcome: finished }")
    assert code == 1 and flights[0]["verdict"] == "held", said
    assert re.search(r"differs from in-process 1 \(A\): command.csv, vehicle 0, step 5, force_y_n: \S+ in A, \S+ in B "
                     r"\(topic sls/command\)", flights[1]["problems"][0])

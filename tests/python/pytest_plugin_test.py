"""The pytest plug-in, in a pytest of its own as a user starts it."""

import os
import re
from pathlib import Path
from xml.etree import ElementTree

import pytest

pytest_plugins = ["pytester"]

# A hovering law whose force depends on the placement in its last bits.
LAW = """import sys

def law(now):
    return 0.0, 0.0, -16.66 - 1e-9 * (sys.argv[1] == "client" and now.step >= 7)
"""
CHECK = """scenario: short
participants: {{ controller: {{ python: law.py:law }} }}
placements: [in-process, shm]
expect:
  - {{ measure: load_error_max_m, max: {most} }}
"""


@pytest.fixture
def run(pytester):
    """A function that runs pytest with the plug-in on the text of a test file, and returns the result."""
    pytester.makepyfile(law=LAW)
    for name, most in (("wide", 2), ("narrow", 0.01)):
        (pytester.path / f"{name}.yaml").write_text(CHECK.format(most=most))

    def run(text, *options):
        pytester.makepyfile(test_flights="import pytest, sls\n" + text)
        return pytester.runpytest_subprocess("-p", "sls.pytest_plugin", "-p", "no:cacheprovider", *options, timeout=120)
    return run


def test_a_check_is_flown_on_each_placement_and_the_first_difference_is_named(run, pytester):
    done = run("""
@pytest.mark.sls(check="wide.yaml")
def test_flight(sls_flight):
    assert sls.Recording(sls_flight.recording).certificate == sls_flight.certificate
    assert [one.is_held for one in sls_flight.judged] == [True, True]
""", "--junit-xml=junit.xml")
    done.assert_outcomes(passed=1, failed=1)
    line = "differs from in-process (A): *command.csv, *step 7, * (topic sls/command)"
    done.stdout.fnmatch_lines([line, "*- sls report -*", "*- sls difference -*", line, "FAILED *::test_flight?shm?*"])
    properties = ElementTree.parse(pytester.path / "junit.xml").iter("property")
    values = {one.get("name"): one.get("value") for one in properties}
    assert Path(values["sls_report"]).is_file() and "step 7" in values["sls_difference"]


def test_an_expectation_that_does_not_hold_fails_before_the_body(run, pytester):
    done = run("""
@pytest.mark.sls(check="narrow.yaml", placements=["in-process"])
def test_judged(sls_flight):
    print("body of", "judged")

@pytest.mark.sls(check="narrow.yaml", placements=["in-process"], judge=False)
def test_not_judged(sls_flight):
    print("body of", "other")
    assert [one.is_held for one in sls_flight.judged] == [True, False]
""", "-s", "--sls-report=pages")
    done.assert_outcomes(passed=1, failed=1)
    done.stdout.fnmatch_lines(["*narrow.yaml:5: load_error_max_m: expected ≤ 0.01, got * m at step *"])
    assert "body of other" in done.stdout.str() and "body of judged" not in done.stdout.str()
    page, = (pytester.path / "pages").rglob("report.html")
    assert str(page) in done.stdout.str()


def test_a_fault_that_a_placement_cannot_do_is_named_and_hosts_without_root_are_skipped(run, pytester):
    pytester.makeconftest("import os\nos.geteuid = lambda: 1000")
    done = run("""
@pytest.mark.sls(check="wide.yaml", placements=["shm", "hosts"])
@pytest.mark.parametrize("sls_network", ["loss=0.2"], indirect=True)
def test_lossy(sls_flight):
    pass

@pytest.mark.sls(check="wide.yaml", placements=["in-process"], under="kill=controller")
def test_killed(sls_flight):
    pass
""", "-rs")
    done.assert_outcomes(errors=2, skipped=1)
    done.stdout.fnmatch_lines(["*--under loss=0.2: expected a placement that can do it (hosts, worlds), got shm",
                               "*--under kill=controller: expected a placement that can do it (shm, *), got in-process",
                               "*placement hosts: expected root, got another user"])


def test_a_server_flies_on_its_own_domain_and_ends_with_its_test(run, pytester):
    done = run("""
from law import law

def test_flight(sls_server):
    server = sls_server("short")
    sls.Client(law, server.scenario, domain=server.domain, qos=server.qos).run()
    assert server.wait() == 0
    assert sls.Recording(server.recording).certificate == sls.fly("short", law).certificate

def test_left_running(sls_server):
    first, second = sls_server("short"), sls_server("short", "udp")
    assert first.domain != second.domain
    print("left:", first.process.pid, second.recorder.pid)
    assert False
""")
    done.assert_outcomes(passed=1, failed=1)
    left, = re.findall(r"left: (\d+) (\d+)", done.stdout.str())
    assert not any(os.path.exists(f"/proc/{pid}") for pid in left)


def test_each_mistake_is_one_line_at_collection(run, pytester):
    mistakes = {
        "(check='none.yaml')": "*none.yaml: *",
        "(check='wide.yaml', placement='shm')": "*expected @pytest.mark.sls(check=FILE), maybe with *",
        "(check='wide.yaml', placements=['worlds'])": "*expected another placement, because * got worlds",
        "(check='wide.yaml', placements=['moon'])": "*expected one of in-process, shm, * got 'moon'"}
    for number, mistake in enumerate(mistakes):
        pytester.makepyfile(**{f"test_{number}": f"""
            import pytest
            @pytest.mark.sls{mistake}
            def test_flight(sls_flight):
                pass"""})
    done = run("def test_flight(sls_flight):\n    pass\n")
    assert (done.ret, done.parseoutcomes()["errors"]) == (2, 5)
    done.stdout.fnmatch_lines([*mistakes.values(), "*::test_flight: expected @pytest.mark.sls(check=FILE), *, got none"])
    assert "Traceback" not in done.stdout.str()

"""pytest's plug-in: checks as tests, and servers for tests. python/README.md, "pytest", shows the use.

The package's other modules are imported late, because pytest loads the plug-in also for tests that do not fly."""

import os
import re
import subprocess
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from sls.check.check_file import Check
    from sls.check.cli import Comparison
    from sls.check.faults import Fault
    from sls.check.results import Result

KEYS = ("check", "placements", "under", "judge")
PATIENCE_S = 30.0  # a program exits at the latest 20 s after its stop signal
RESULT = pytest.StashKey["Result"]()
COMPARISON = pytest.StashKey["Comparison"]()


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.getgroup("sls").addoption(
        "--sls-report", type=Path, metavar="DIR",
        help="folder for page, recording and logs of each flight whose test failed (default: a temporary one)")


def pytest_configure(config: pytest.Config) -> None:
    config.addinivalue_line("markers", "sls(check, placements, under, judge=True): what the fixture sls_flight flies")


# --- the flight of a check ------------------------------------------------------------------------


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """One test for each check and placement."""
    if "sls_case" not in metafunc.fixturenames:
        return
    from sls.check.check_file import find_checks, find_refusal, load_check
    from sls.check.cli import parse_placements
    marker = metafunc.definition.get_closest_marker("sls")
    values = marker.kwargs if marker else {}
    if marker is None or marker.args or "check" not in values or not set(values) <= set(KEYS):
        fail(f"{metafunc.definition.nodeid}: expected @pytest.mark.sls(check=FILE), maybe with {', '.join(KEYS[1:])}, got "
             f"{marker or 'none'}")
    path = metafunc.definition.path.parent / values["check"]
    cases, names = [], []
    try:
        checks = [load_check(file) for file in find_checks(str(path if path.exists() else values["check"]))]
        for check in checks:
            given = values.get("placements", check.placements)
            for placement in parse_placements(given if isinstance(given, str) else ",".join(given)):
                if refusal := find_refusal(check, placement):
                    fail(f"{check.file}: placements: expected {refusal}, got {placement}")
                cases.append((check, placement))
                names.append(placement if len(checks) == 1 else f"{check.name}-{placement}")
    except Exception as error:  # each error of the package has one line, and says where
        fail(f"{metafunc.definition.nodeid}: {error}")
    metafunc.parametrize("sls_case", cases, ids=names, indirect=True)


def fail(text: str) -> None:
    pytest.fail(text, pytrace=False)


@pytest.fixture
def sls_case(request: pytest.FixtureRequest) -> "tuple[Check, str]":
    """Check and placement of this test."""
    return request.param


@pytest.fixture
def sls_network(request: pytest.FixtureRequest, sls_case: "tuple[Check, str]") -> "tuple[Fault, ...]":
    """The faults of the flight: those of an indirect parameter, of the marker's `under`, or of the check. The texts are
    those of `./sls check --under`."""
    from sls.check.faults import check_able, parse_fault
    from sls.input_error import InputError
    check, placement = sls_case
    if placement == "hosts" and os.geteuid() != 0:
        pytest.skip("placement hosts: expected root, got another user")
    text = getattr(request, "param", request.node.get_closest_marker("sls").kwargs.get("under"))
    try:
        faults = check.faults if text is None else tuple(parse_fault(word) for word in text.split(",") if word)
        check_able(faults, placement)
    except InputError as error:
        fail(f"{check.file}: {error}")
    return faults


@pytest.fixture
def sls_flight(request: pytest.FixtureRequest, sls_case: "tuple[Check, str]", sls_network: "tuple[Fault, ...]",
               tmp_path: Path) -> "Result":
    """The flight of the check, flown and judged: `recording` (its folder), `judged`, `certificate`, `logs` …"""
    from sls.check.cli import Comparison, Job, fly_and_judge
    from sls.check.results import UNUSABLE
    check, placement = sls_case
    result = fly_and_judge(Job(check, placement, sls_network, 1, 1, tmp_path / "flight"))
    request.config.stash.setdefault(COMPARISON, Comparison(True)).compare(check, result)
    request.node.stash[RESULT] = result
    if result.verdict == UNUSABLE:
        fail("\n".join(result.list_problems()))
    return result


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_call(item: pytest.Item) -> None:
    """Fails the test before its body if an expectation does not hold."""
    if RESULT in item.stash and item.get_closest_marker("sls").kwargs.get("judge", True):
        if problems := item.stash[RESULT].list_problems():
            fail("\n".join(problems))


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_makereport(item: pytest.Item, call: "pytest.CallInfo[None]") -> Iterator[None]:
    """Adds page, difference and output of the flight to the report of a failed test, and to JUnit as properties."""
    is_failed = call.excinfo and call.when != "teardown" and not call.excinfo.errisinstance(pytest.skip.Exception)
    found = describe_flight(item) if is_failed and RESULT in item.stash else []
    item.user_properties += [(f"sls_{name}", text) for name, text in found if name != "output"]
    outcome = yield
    outcome.get_result().sections += [(f"sls {name}", text) for name, text in found]


def describe_flight(item: pytest.Item) -> list[tuple[str, str]]:
    """Makes the page of a failed flight. Returns the titles and texts of its sections in the report."""
    result = item.stash[RESULT]
    folder = item.config.getoption("--sls-report") or Path(result.folder).parent
    try:
        from sls.check.pages import write_page
        write_page(folder.resolve() / re.sub(r"[^\w.-]+", "-", item.nodeid), result)
    except (ImportError, OSError) as error:
        result.page = f"none: {error}"
    logs = "\n".join(f"{name}: {line}" for name, text in result.logs.items() for line in text.splitlines())
    found = [("report", result.page), ("difference", result.difference), ("output", logs)]
    return [(name, text) for name, text in found if text]


# --- a server alone -------------------------------------------------------------------------------


class Server:
    """A server and its recorder, with the `scenario`, `qos` and `domain` for a client."""

    def __init__(self, folder: Path, scenario: Path, qos: Path, domain: int, options: Sequence[str]) -> None:
        self.scenario, self.qos, self.domain, self.recording = scenario, qos, domain, folder / "recording"
        self.recorder = self._start(folder, "recorder", f"--out={self.recording}")
        self.process = self._start(folder, "sim_server", f"--scenario={scenario}", *options)

    def _start(self, folder: Path, name: str, *words: str) -> "subprocess.Popen[bytes]":
        from sls.launcher.place import BUILD
        network = [f"--qos={self.qos}", f"--domain={self.domain}"]
        with (folder / f"{name}.log").open("wb") as log:
            return subprocess.Popen(["setpriv", "--pdeathsig", "TERM", "--", BUILD / f"bin/{name}", *network, *words],
                                    stdout=log, stderr=log, stdin=subprocess.DEVNULL)

    def wait(self, timeout_s: float = 60.0) -> int:
        """The exit code of the server, once server and recorder have ended. Raises subprocess.TimeoutExpired."""
        code = self.process.wait(timeout_s)
        self.recorder.wait(timeout_s)
        return code

    def end(self) -> None:
        for process in (self.process, self.recorder):
            process.terminate()
            try:
                process.wait(PATIENCE_S)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()


@pytest.fixture
def sls_server(tmp_path: Path) -> "Iterator[Callable[..., Server]]":
    """A function that starts a server and a recorder on a DDS domain of their own: sls_server(scenario, placement="shm"
    or "udp", options=[…]). They end with the test."""
    from sls.check.flights import PROFILES
    from sls.dds_domain import own_domain
    from sls.launcher.place import ROOT
    from sls.scenario import find_scenario

    with ExitStack() as stack:
        def start(scenario: str | Path, placement: str = "shm", options: Sequence[str] = ()) -> Server:
            domain = stack.enter_context(own_domain())
            folder = tmp_path / f"server-{domain}"
            folder.mkdir()
            qos = ROOT / f"config/qos/{PROFILES[placement]}.xml"
            server = Server(folder, find_scenario(scenario), qos, domain, options)
            stack.callback(server.end)
            return server
        yield start

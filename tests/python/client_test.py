"""sls.Client: real flights, with server, recorder and Python clients in separate processes."""

import contextlib
import json
import signal
import subprocess
import sys
import threading

import numpy as np
import pytest
import sls
from client_program import LAWS
from own_domain import own_domain
from places import BUILD, ROOT
from processes import Processes, wait_until

DEADLINE_S = 60


@pytest.fixture
def domain():
    with own_domain() as number:
        yield number


class Flight(Processes):
    """Server, recorder and clients."""

    def __init__(self, folder, domain, scenario):
        super().__init__(folder)
        self.domain, self.scenario = domain, scenario
        self.recording = folder / "recording"
        self.start("recorder", [BUILD / "bin/recorder", f"--out={self.recording}", f"--domain={domain}"])
        self.start("server", [BUILD / "bin/sim_server", f"--scenario={scenario}", f"--domain={domain}"])

    def start_client(self, name="python", strength=0, law="pid"):
        return self.start(name, [sys.executable, "-B", ROOT / "tests/python/client_program.py", self.scenario,
                                 str(self.domain), name, str(strength), law])

    def logs(self):
        return "\n".join(f"--- {name}\n{self.output(name)}" for name in self.started)

    def wait(self, name):
        """Waits for the end of a process and returns its exit code."""
        try:
            return self.started[name].wait(DEADLINE_S)
        except subprocess.TimeoutExpired:
            pytest.fail(f"{name} goes on and on\n{self.logs()}")

    def wait_for_steps(self):
        """Waits until a part of the flight is recorded."""
        file = self.recording / "state.csv"
        wait_until(lambda: file.exists() and file.stat().st_size > 100_000, DEADLINE_S, "steps")

    @property
    def manifest(self):
        return json.loads((self.recording / "manifest.json").read_text())


@contextlib.contextmanager
def make_flight(folder, domain, for_s=32, controllers=1):
    """A figure eight of `for_s` seconds with `controllers` clients. Server and recorder are started."""
    text = sls.load_scenario("figure_eight_pid", changes={
        "mission.0.for_s": for_s, "sync.wait_for.controllers": controllers}).text
    scenario = folder / "scenario.yaml"
    scenario.write_text(text)
    flight = Flight(folder, domain, scenario)
    try:
        yield flight
    finally:
        flight.end_all()


def expect_flown(flight, law):
    """Checks that the flight is complete, and equal, bit for bit, to one of the same law in this process."""
    assert flight.wait("server") == 0, flight.logs()
    assert flight.wait("recorder") == 0, flight.logs()
    assert flight.manifest["complete"], flight.logs()
    alone = sls.fly(sls.load_scenario(flight.scenario), LAWS[law])
    assert flight.manifest["certificate"] == alone.certificate


def test_a_python_law_flies_a_server_to_the_same_bits_as_in_process(tmp_path, domain):
    with make_flight(tmp_path, domain) as flight:
        flight.start_client(law="counting")
        expect_flown(flight, "counting")
        assert flight.wait("python") == 0, flight.logs()
        steps = (flight.recording / "flight.txt").read_text()
        print(next(line for line in steps.splitlines() if "steps/s" in line))


def test_the_example_flies_a_server(tmp_path, domain):
    with make_flight(tmp_path, domain) as flight:
        flight.start("python", [sys.executable, "-B", ROOT / "examples/python/pid_client.py", flight.scenario,
                                f"--domain={domain}"])
        for name in ("server", "recorder", "python"):
            assert flight.wait(name) == 0, flight.logs()
        assert flight.manifest["complete"]
        load = sls.Recording(flight.recording).state["load_x_m"]
        built_in = sls.fly(sls.load_scenario(flight.scenario))
        # Python and C++ use the same sines of the C library. Sums have another order.
        assert np.abs(load - built_in.state["load_x_m"]).max() < 1e-12


def test_signals_end_clients_in_order_and_the_next_one_flies_on(tmp_path, domain):
    ends = {"first": (signal.SIGINT, 130), "second": (signal.SIGTERM, 143)}
    with make_flight(tmp_path, domain, for_s=48, controllers=3) as flight:
        for strength, name in enumerate(("standby", *ends)):
            flight.start_client(name, strength=strength)
        flight.wait_for_steps()
        for name, (number, code) in ends.items():
            flight.started[name].send_signal(number)
            assert flight.wait(name) == code, flight.logs()
            assert ("interrupted" in flight.output(name)) == (number == signal.SIGINT)
        expect_flown(flight, "pid")


def test_a_law_that_does_not_return_can_be_interrupted(tmp_path, domain):
    with make_flight(tmp_path, domain) as flight:
        client = flight.start_client(law="sleepy")
        wait_until(lambda: "sleeps" in flight.output("python"), DEADLINE_S, "law that sleeps")
        client.send_signal(signal.SIGINT)
        assert flight.wait("python") == 130, flight.logs()
        assert "sls.Client: error: did not end after the stop signal" in flight.output("python")


def test_stop_ends_a_run_in_another_thread(domain):
    client = sls.Client(LAWS["pid"], "figure_eight_pid", domain=domain, log_level="error")
    thread = threading.Thread(target=client.run)
    thread.start()
    client.stop()
    thread.join(DEADLINE_S)
    assert not thread.is_alive()


def test_a_law_that_raises_ends_the_client_with_the_reason(tmp_path, domain):
    with make_flight(tmp_path, domain) as flight:
        flight.start_client(law="broken")
        assert flight.wait("python") == 1, flight.logs()
        assert "RunError: Broken: vehicle 0, step 150: ValueError: no idea" in flight.output("python")


def test_without_a_server_it_says_so(domain):
    scenario = sls.load_scenario("figure_eight_pid", changes={"sync.wait_for.timeout_s": 0.5})
    client = sls.Client(LAWS["pid"], scenario, domain=domain, log_level="error")
    for _ in range(2):  # a client can run again
        with pytest.raises(sls.RunError, match="^no server for vehicle 0 within 0.5 s"):
            client.run()


@pytest.mark.parametrize("arguments, message", [
    ({"law": 3}, "controller: expected an object that can be called with sls.Now, got 3"),
    ({"name": "a b"}, "name: expected 1 to 32 letters, digits, '_', '-' or '.', got 'a b'"),
    ({"domain": 233}, "domain: expected a whole number from 0 to 232, got 233"),
    ({"strength": 0.5}, "strength: expected a whole number from -2147483648 to 2147483647"),
    ({"vehicles": [1]}, "vehicles: expected 0, the scenario's only vehicle, got '1'"),
    ({"log_level": "loud"}, "log_level: expected one of debug, info, warning, error, got 'loud'"),
])
def test_bad_arguments_are_named(arguments, message):
    with pytest.raises(sls.ConfigError) as error:
        sls.Client(**{"law": LAWS["pid"], "scenario": "figure_eight_pid", **arguments})
    assert message in str(error.value)

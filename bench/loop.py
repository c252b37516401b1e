"""The closed loop: lockstep speed, where its time goes, its round trips, real time, QoS profiles."""

import csv
import statistics
import time
from collections.abc import Callable
from pathlib import Path

from bench.programs import Flight, MeasurementError, Placement, Programs, find_placements
from bench.results import LESS, Figure

PERIOD_S = "0.001"
TRANSPORTS = {"default": "shared memory", "udp": "UDP"}
UNRECORDED_BOUND = "the same without recorder"
PROFILES = ("default", "udp", "lan", "wifi", "secure")
BOUND = ("1 / (raw Fast DDS round trip of the same samples with the same QoS profiles + plant step "
         "+ control law)")


def without_recorder(text: str) -> str:
    return text.replace("recorders: 1", "recorders: 0")


def lasting(seconds: float) -> Callable[[str], str]:
    """figure_eight.yaml for so long."""
    return lambda text: text.replace("for_s: 32", f"for_s: {seconds:g}")


def fly_lockstep(programs: Programs, qos: str, seconds: float, is_recorded: bool,
                 placement: Placement = Placement()) -> Flight:
    def change(text: str) -> str:
        text = lasting(seconds)(text)
        return text if is_recorded else without_recorder(text)

    scenario = programs.scenario("figure_eight", change)
    flight = programs.fly(scenario, qos=qos, is_recorded=is_recorded,
                          server=("--period-s", PERIOD_S), placement=placement)
    if is_recorded and not flight.manifest["complete"]:
        raise MeasurementError(f"{qos}: the recording is not complete")
    return flight


class StepCosts:
    """What a step costs at least, measured in each round: in µs."""

    def __init__(self, programs: Programs, is_quick: bool):
        self.programs = programs
        self.round_trips = 2000 if is_quick else 20000
        self.flight = programs.scenario("figure_eight", lasting(2 if is_quick else 16))

    def ping(self, qos: str, *flags: str, placement: Placement = Placement()) -> float:
        """A round trip."""
        programs = self.programs
        return programs.probe("ping", "--qos", programs.qos(qos), "--domain", str(programs.domain),
                              "--round-trips", str(self.round_trips), *flags,
                              processors=placement.loop)["mean_us"]

    def plant_and_law(self, placement: Placement = Placement()) -> float:
        return self.programs.probe("fly", "--scenario", self.flight, "--period-s", PERIOD_S,
                                   processors=placement.loop)["mean_us"]


def measure_lockstep(programs: Programs, rounds: int, is_quick: bool) -> list[Figure]:
    costs = StepCosts(programs, is_quick)
    seconds = 2 if is_quick else 32
    bounds: dict[tuple[Placement, str], list[float]] = {}
    speeds: dict[tuple[Placement, str, bool], list[float]] = {}
    placements = find_placements()
    for _ in range(rounds):
        for placement in placements:
            for qos in TRANSPORTS:
                bounds.setdefault((placement, qos), []).append(
                    1e6 / (costs.ping(qos, placement=placement) + costs.plant_and_law(placement)))
                for is_recorded in (True, False):
                    flight = fly_lockstep(programs, qos, seconds, is_recorded, placement)
                    speeds.setdefault((placement, qos, is_recorded), []).append(flight.steps_per_s)
    figures = []
    for (placement, qos, is_recorded), values in speeds.items():
        name = f"{TRANSPORTS[qos]}, {'with' if is_recorded else 'without'} recorder, {placement.name}"
        figures.append(Figure("lockstep", name, "steps/s", values, BOUND, bounds[placement, qos],
                              goal=0.85 if is_recorded else None, is_goal_of_ratio=True))
    for placement, qos in bounds:
        name = f"{TRANSPORTS[qos]}, with recorder, {placement.name}, beside the same without"
        figures.append(Figure("lockstep", name, "steps/s", speeds[placement, qos, True],
                              UNRECORDED_BOUND, speeds[placement, qos, False],
                              goal=0.9, is_goal_of_ratio=True))
    figures.append(Figure("lockstep", f"shared memory, with recorder, {placements[0].name}, by itself",
                          "steps/s", speeds[placements[0], "default", True], goal=12000))
    return figures


# --- where the time goes --------------------------------------------------------------------------


def calc_parts(bare: float, through_bus: float, plant_and_law: float, unrecorded: float,
               recorded: float) -> dict[str, float]:
    """Of one step, `recorded`; the first two are round trips."""
    return {
        "raw round trip of state and command": bare,
        "common/bus around Fast DDS": through_bus - bare,
        "plant step and control law": plant_and_law,
        "rest: our own code": unrecorded - through_bus - plant_and_law,
        "the recorder and its batches": recorded - unrecorded,
        "sum: one step with recorder": recorded,
    }


def measure_breakdown(programs: Programs, rounds: int, is_quick: bool) -> list[Figure]:
    """The parts of one step with a recorder. They add up: each is what a round trip or a step takes
    longer with it than without."""
    costs = StepCosts(programs, is_quick)
    seconds = 2 if is_quick else 32
    parts: dict[str, list[float]] = {}
    for _ in range(rounds):
        for placement in find_placements():
            for qos, transport in TRANSPORTS.items():
                bare = costs.ping(qos, placement=placement)
                through_bus = costs.ping(qos, "--bus", placement=placement)
                plant_and_law = costs.plant_and_law(placement)
                unrecorded, recorded = (
                    1e6 / fly_lockstep(programs, qos, seconds, is_recorded, placement).steps_per_s
                    for is_recorded in (False, True))
                for name, value in calc_parts(bare, through_bus, plant_and_law, unrecorded,
                                              recorded).items():
                    parts.setdefault(f"{transport}, {placement.name}: {name}", []).append(value)
    return [Figure("breakdown", name, "µs", values, better=LESS) for name, values in parts.items()]


# --- distributions --------------------------------------------------------------------------------

PERCENTILES = {"p50": 0.5, "p99": 0.99, "p99.9": 0.999, "max": 1.0}


def percentile(values: list[float], share: float) -> float:
    """Nearest rank."""
    ordered = sorted(values)
    rank = -(-share * len(ordered) // 1)  # rounded up
    return ordered[max(int(rank), 1) - 1]


def parse_stamps(text: str) -> dict[int, int]:
    """The time in ns at which the state of a step was first written."""
    states: dict[int, int] = {}
    for step, written in csv.reader(text.splitlines()):
        states.setdefault(int(step), int(written))
    return states


def calc_step_times(batches: list[dict[int, int]]) -> list[float]:
    """µs from each state to the next. The run rested after the last state of a batch, and a batch
    reaches back into the one before: no step is counted twice or with a rest in it."""
    times = []
    seen = -1
    for states in batches:
        for step in sorted(states):
            if step > seen and step + 1 in states:
                times.append((states[step + 1] - states[step]) / 1e3)
        seen = max(states)
    return times


def measure_round_trips(programs: Programs, rounds: int, is_quick: bool) -> list[Figure]:
    """By the history that the writer keeps, asked for while the run is paused."""
    costs = StepCosts(programs, is_quick)
    pauses = 1 if is_quick else 8
    figures: dict[str, list[float]] = {}
    bounds: dict[str, list[float]] = {}
    counts = []
    for _ in range(rounds):
        scenario = programs.scenario("figure_eight", lasting(24 if is_quick else 160))
        batches: list[dict[int, int]] = []

        def look(batches: list[dict[int, int]] = batches) -> None:
            ctl = [programs.build / "bin/sim_ctl", "--timeout-s", "4", "--domain",
                   str(programs.domain)]
            wait_until_running(programs)
            for _ in range(pauses):
                time.sleep(0.4)  # steps to look at
                try:
                    programs.run(*ctl, "pause")
                except MeasurementError:
                    if batches:
                        return  # the flight is over
                    raise
                stamps = programs.run(programs.probe_program, "stamps",
                                      "--domain", str(programs.domain))
                batches.append(parse_stamps(stamps))
                programs.run(*ctl, "resume")

        flight = programs.fly(scenario, qos=with_history(programs), during=look,
                              server=("--period-s", PERIOD_S))
        times = calc_step_times(batches)
        counts.append(len(times))
        raw = programs.probe("ping", "--domain", str(programs.domain), "--round-trips",
                             str(costs.round_trips))
        work = costs.plant_and_law()
        for name, share in PERCENTILES.items():
            figures.setdefault(f"state to next state, {name}", []).append(percentile(times, share))
            key = {"p50": "p50_us", "p99": "p99_us", "p99.9": "p999_us", "max": "max_us"}[name]
            bounds.setdefault(f"state to next state, {name}", []).append(raw[key] + work)
        assert flight.recording
        with (flight.recording / "status.csv").open() as file:
            last = list(csv.DictReader(file))[-1]
        for name in ("p50", "p99"):
            figures.setdefault(f"round trip as the server sees it, {name}", []).append(
                float(last[f"round_trip_{name}_us"]))
            bounds.setdefault(f"round trip as the server sees it, {name}", []).append(
                raw[f"{name}_us"])
    if min(counts) == 0:
        raise MeasurementError("round-trip: no steps between two pauses")
    name = "raw Fast DDS round trip, and plant step and control law for a whole step"
    return [Figure("round-trip", title, "µs", values, name, bounds[title], LESS)
            for title, values in figures.items()]


def with_history(programs: Programs) -> Path:
    """default.xml, but the last 5,000 states are kept, not 64: that costs memory alone."""
    depth, longer = "<depth>64</depth></historyQos>", "<depth>5000</depth></historyQos>"
    limits = "".join(f"<{name}>5000</{name}>" for name in ("max_samples", "max_samples_per_instance"))
    profile = programs.qos("endpoints").read_text().split("<profiles>")[1].split("<data_reader")[0]
    assert depth in profile
    path = programs.make_path(".xml")
    path.write_text(programs.qos("default").read_text().replace("</profiles>", profile.replace(
        depth, f"{longer}<resourceLimitsQos>{limits}</resourceLimitsQos>") + "</profiles>"))
    return path


def wait_until_running(programs: Programs) -> None:
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline:
        status = programs.run(programs.build / "bin/sim_ctl", "--domain", str(programs.domain),
                              "status", "--json")
        if '"running"' in status:
            return
        time.sleep(0.05)
    raise MeasurementError("the run did not begin within 60 s")


# --- real time ------------------------------------------------------------------------------------


def calc_lateness(states: dict[int, int], period_ns: int) -> list[float]:
    """µs by which each state was published later, for its step, than the earliest was."""
    offsets = [written - step * period_ns for step, written in states.items()]
    earliest = min(offsets)
    return [(offset - earliest) / 1e3 for offset in offsets]


def measure_realtime(programs: Programs, rounds: int, is_quick: bool) -> list[Figure]:
    figures: dict[str, list[float]] = {}
    bounds: dict[str, list[float]] = {}
    seconds = 2 if is_quick else 10
    for _ in range(rounds):
        for period_s, title in ((0.001, "1 kHz"), (0.004, "250 Hz")):
            stamps: list[str] = []

            def listen(stamps: list[str] = stamps) -> None:
                stamps.append(programs.run(programs.probe_program, "stamps",
                                           "--live", "--domain", str(programs.domain)))

            scenario = programs.scenario("figure_eight", lasting(seconds))
            timer = programs.probe("timer", "--period-s", str(period_s), "--seconds", str(seconds))
            flight = programs.fly(scenario, during=listen, server=(
                "--mode", "realtime", "--rtf", "1", "--period-s", str(period_s)))
            late = calc_lateness(parse_stamps(stamps[0]), round(period_s * 1e9))
            for name, share in PERCENTILES.items():
                key = {"p50": "p50_us", "p99": "p99_us", "p99.9": "p999_us", "max": "max_us"}[name]
                figures.setdefault(f"{title}: states late, {name}", []).append(
                    max(percentile(late, share), 0.001))
                bounds.setdefault(f"{title}: states late, {name}", []).append(
                    max(timer[key] - timer["min_us"], 0.001))
            figures.setdefault(f"{title}: steps without an answer in time", []).append(
                count_late(flight.label))
    name = "a thread that does nothing but sleep until the same times; both count from their earliest"
    return [Figure("realtime", title, "steps" if "steps" in title else "µs", values,
                   name if title in bounds else "", bounds.get(title, []), LESS)
            for title, values in figures.items()]


def count_late(label: str) -> float:
    """Of "real-time, 3 of 500 late, …" and "degraded: …, 3 of 500 late, …": 3."""
    words = label.replace(",", " ").replace(";", " ").split()
    for index in range(len(words) - 3):
        if words[index + 1] == "of" and words[index + 3] == "late":
            return float(words[index])
    raise MeasurementError(f"expected a label with 'k of n late', got '{label}'")


# --- QoS profiles ---------------------------------------------------------------------------------


def measure_qos(programs: Programs, rounds: int, is_quick: bool) -> list[Figure]:
    """Each profile's closed loop beside its own bound, and a whole short flight, most of which is
    discovery and, with security, handshakes."""
    costs = StepCosts(programs, is_quick)
    seconds = 2 if is_quick else 16
    speeds: dict[str, list[float]] = {qos: [] for qos in PROFILES}
    bounds: dict[str, list[float]] = {qos: [] for qos in PROFILES}
    starts: dict[str, list[float]] = {qos: [] for qos in PROFILES}
    for _ in range(rounds):
        for qos in PROFILES:
            bounds[qos].append(1e6 / (costs.ping(qos) + costs.plant_and_law()))
            speeds[qos].append(fly_lockstep(programs, qos, seconds, True).steps_per_s)
            starts[qos].append(programs.fly(programs.scenario("short"), qos=qos).wall_s)
    udp = statistics.median(speeds["udp"])
    figures = [Figure("qos", f"{qos}: {statistics.median(speeds[qos]) / udp:.2f} of udp", "steps/s",
                      speeds[qos], BOUND, bounds[qos]) for qos in PROFILES]
    return figures + [Figure("qos", f"{qos}: a whole short flight", "s", starts[qos], better=LESS)
                      for qos in PROFILES]

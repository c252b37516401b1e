"""The closed loop: its bounds and speed in lockstep, the parts of a step, its speed on a busy machine,
real time."""

import csv
import itertools
import json
import os
import re
from dataclasses import dataclass, replace

from bench.programs import Flight, Programs
from bench.results import LESS, Figure, Rounds
from sls.errors import RunError

PERIOD_S = "0.001"
TRANSPORTS = {"default": "shared memory", "udp": "UDP"}
LOADS = (0, 1, 2, 4)  # busy loops
QUICK_LOADS = (0, 1)
WAITING = {True: "spinning", False: "blocking"}  # a thread that waits may spin before it blocks
FUTEX_BOUND = ("1 / (plant step + control law + hand-over of two processes by futex, the fastest of "
               "spinning and blocking, on one processor and on two)")
IN_PROCESS_BOUND = "1 / (plant step + control law)"


@dataclass(frozen=True)
class Loop:
    """Settings of a flight of the closed loop."""

    qos: str = "default"
    is_recorded: bool = True
    may_spin: bool = True

    @property
    def name(self) -> str:
        return (f"{TRANSPORTS[self.qos]}, {'with' if self.is_recorded else 'without'} recorder, "
                f"{WAITING[self.may_spin]}")


LOOPS = tuple(Loop(*how) for how in itertools.product(TRANSPORTS, (False, True), (False, True)))


def fly_lockstep(programs: Programs, loop: Loop, seconds: float) -> Flight:
    flight = programs.fly(programs.figure_eight(seconds, is_recorded=loop.is_recorded), qos=loop.qos,
                          is_recorded=loop.is_recorded, server=("--period-s", PERIOD_S),
                          may_spin=loop.may_spin)
    if loop.is_recorded and not flight.manifest["complete"]:
        raise RunError(f"{loop.qos}: the recording is not complete")
    return flight


# --- bounds ---------------------------------------------------------------------------------------


Times = dict[tuple[bool, str], float]  # µs; key: True if waiting threads may spin, and the processors


def find_fastest(times: Times, may_spin: bool) -> float:
    return min(time for (spins, _), time in times.items() if may_spin or not spins)


def find_pairs() -> dict[str, tuple[int, int]]:
    """The processors on which two processes may run."""
    first, *others = sorted(os.sched_getaffinity(0))
    pairs = {"on one processor": (first, first)}
    return {**pairs, "on two processors": (first, others[0])} if others else pairs


def calc_parts(step: float, work: dict[str, float], hand_over: float) -> dict[str, float]:
    """Parts of a step of two processes, µs."""
    parts = {"plant": work["plant_us"], "law": work["law_us"], "futex": hand_over}
    return {**parts, "rest": step - sum(parts.values())}


class StepCosts:
    """The smallest possible cost of a step, µs; measured in each round."""

    def __init__(self, programs: Programs, is_quick: bool):
        self.programs = programs
        self.rounds = 2000 if is_quick else 20000
        self.scenario = programs.figure_eight(2 if is_quick else 16)
        self.work: dict[str, float] = {}
        self.futex: Times = {}

    def measure(self) -> None:
        """Measures plant and law, then two processes that take turns by futex with the same work."""
        self.work = json.loads(self.programs.run_probe(
            "fly", "--scenario", self.scenario, "--period-s", PERIOD_S, "--folder", self.programs.make_path("")))
        for may_spin in WAITING:
            for place, (ours, theirs) in find_pairs().items():
                self.futex[may_spin, place] = json.loads(self.programs.run_probe(
                    "hand-over", "--rounds", str(self.rounds), "--work-us", str(self.in_process),
                    "--processors", str(ours), str(theirs), *["--spin"] * may_spin))["mean_us"]

    @property
    def in_process(self) -> float:
        """Time of plant step and control law, µs."""
        return self.work["plant_us"] + self.work["law_us"]

    def hand_over(self, may_spin: bool) -> float:
        """Time of a round of the futex turns without the work, µs."""
        return find_fastest(self.futex, may_spin) - self.in_process


# --- lockstep -------------------------------------------------------------------------------------


def add_bounds(figures: Rounds, costs: StepCosts) -> None:
    work, bound = costs.work, 1e6 / costs.in_process
    parts = {"plant": work["plant_us"], "law": work["law_us"], "record entries": work["entries_us"]}
    figures.add("one process, without files", "steps/s", 1e6 / sum(parts.values()), IN_PROCESS_BOUND,
                bound, parts)
    parts["files"] = work["recorded_us"] - sum(parts.values())
    figures.add("one process, with files", "steps/s", 1e6 / work["recorded_us"], IN_PROCESS_BOUND,
                bound, parts)
    for (may_spin, place), time_us in costs.futex.items():
        name = f"two processes by futex, {WAITING[may_spin]}, {place}"
        figures.add(name, "µs", time_us, better=LESS)
        figures.add(name, "steps/s", 1e6 / time_us)


def add_speeds(figures: Rounds, costs: StepCosts, flights: dict[Loop, Flight]) -> None:
    for loop, flight in flights.items():
        speed = flight.steps_per_s
        unrecorded = flights[replace(loop, is_recorded=False)].steps_per_s
        parts = calc_parts(1e6 / unrecorded, costs.work, costs.hand_over(loop.may_spin))
        if loop.is_recorded:
            parts["recorder"] = 1e6 / speed - 1e6 / unrecorded
        figures.add(loop.name, "steps/s", speed, FUTEX_BOUND,
                    1e6 / (costs.in_process + costs.hand_over(may_spin=True)), parts)
        if loop.is_recorded:
            figures.add(f"{loop.name}, beside the same without", "steps/s", speed,
                        "the same without recorder", unrecorded, goal=0.85, is_goal_of_ratio=True)


def add_processor_times(figures: Rounds, flights: dict[Loop, Flight]) -> None:
    for loop, flight in flights.items():
        title, time_us = f"{loop.name}: processor time", flight.processor_us
        for program, value in time_us.items():
            figures.add(f"{title}, {program}", "µs/step", value, better=LESS)
        if not loop.may_spin:
            figures.add(f"{title}, all", "µs/step", sum(time_us.values()), better=LESS)
            continue
        blocking = flights[replace(loop, may_spin=False)].processor_us
        figures.add(f"{title}, all", "µs/step", sum(time_us.values()), "the same, blocking",
                    sum(blocking.values()), better=LESS, goal=1 / 1.3, is_goal_of_ratio=True)


def measure_lockstep(programs: Programs, rounds: int, is_quick: bool) -> list[Figure]:
    costs = StepCosts(programs, is_quick)
    parts = [Rounds("lockstep") for _ in range(3)]
    for _ in range(rounds):
        costs.measure()
        flights = {loop: fly_lockstep(programs, loop, 2 if is_quick else 32) for loop in LOOPS}
        add_bounds(parts[0], costs)
        add_speeds(parts[1], costs, flights)
        add_processor_times(parts[2], flights)
    return [figure for part in parts for figure in part.make_figures()]


def measure_load(programs: Programs, rounds: int, is_quick: bool) -> list[Figure]:
    """Over shared memory, while other processes keep the processors busy."""
    figures, comparison = Rounds("load"), Rounds("load")
    loops = [loop for loop in LOOPS if loop.qos == "default" and (loop.is_recorded or not is_quick)]
    for _ in range(rounds):
        speeds: dict[tuple[int, Loop], float] = {}
        for count, loop in itertools.product(QUICK_LOADS if is_quick else LOADS, loops):
            with programs.busy_loops(count):
                flight = fly_lockstep(programs, loop, 1 if is_quick else 16)
            speeds[count, loop] = flight.steps_per_s
        for (count, loop), speed in speeds.items():
            name = f"{loop.name}, {count} busy loop{'s' if count != 1 else ''}"
            figures.add(name, "steps/s", speed, "the same without busy loops",
                        speeds[0, loop] if count else None)
            if loop.may_spin:
                comparison.add(f"{name}, beside blocking", "steps/s", speed, "the same, blocking",
                               speeds[count, replace(loop, may_spin=False)])
    return figures.make_figures() + comparison.make_figures()


# --- real time ------------------------------------------------------------------------------------

PERCENTILES = {"p50": 0.5, "p99": 0.99, "p99.9": 0.999, "max": 1.0}


def percentile(values: list[float], share: float) -> float:
    """Nearest rank."""
    ordered = sorted(values)
    rank = -(-share * len(ordered) // 1)  # rounded up
    return ordered[max(int(rank), 1) - 1]


def parse_stamps(text: str) -> dict[int, int]:
    """The first time of each step, ns."""
    states: dict[int, int] = {}
    for step, written in csv.reader(text.splitlines()):
        states.setdefault(int(step), int(written))
    return states


def calc_lateness(states: dict[int, int], period_ns: int) -> list[float]:
    """Delay of each step relative to the earliest one, µs, after subtraction of its due time."""
    offsets = [written - step * period_ns for step, written in states.items()]
    earliest = min(offsets)
    return [(offset - earliest) / 1e3 for offset in offsets]


def measure_realtime(programs: Programs, rounds: int, is_quick: bool) -> list[Figure]:
    figures = Rounds("realtime")
    bound_name = ("a thread that does nothing but sleep until the same times; both count from their "
                  "earliest")
    seconds = 0.5 if is_quick else 10
    for _ in range(rounds):
        for period_s, title in ((0.001, "1 kHz"), (0.004, "250 Hz")):
            stamps: list[str] = []

            def listen(stamps: list[str] = stamps) -> None:
                stamps.append(programs.run_probe("stamps", "--domain", str(programs.domain)))

            scenario = programs.figure_eight(seconds)
            timer = programs.run_probe("timer", "--period-s", str(period_s), "--seconds", str(seconds))
            flight = programs.fly(scenario, during=listen, server=(
                "--mode", "realtime", "--rtf", "1", "--period-s", str(period_s)))
            late, bound = (calc_lateness(parse_stamps(text), round(period_s * 1e9))
                           for text in (stamps[0], timer))
            for name, share in PERCENTILES.items():
                figures.add(f"{title}: states late, {name}", "µs", max(percentile(late, share), 0.001),
                            bound_name, max(percentile(bound, share), 0.001),
                            better=LESS)
            figures.add(f"{title}: steps without an answer in time", "steps",
                        count_late(flight.label), better=LESS)
    return figures.make_figures()


def count_late(label: str) -> float:
    """The number of late steps in a label: 3 in "real-time, 3 of 500 late, …" and "degraded: …, 3 of 500 late, …"."""
    if found := re.search(r"(\d+) of \d+ late", label):
        return float(found[1])
    raise RunError(f"expected a label with 'k of n late', got '{label}'")

"""Everything except the loop: plant, recorder, fleets."""

import json
import os
from pathlib import Path

from bench.loop import PERIOD_S, StepCosts, calc_parts, count_late, find_fastest, lasting
from bench.programs import MeasurementError, Programs, end_all
from bench.results import LESS, Figure, Rounds

FLEETS = (1, 2, 5, 10, 20, 50, 100, 200)
QUICK_FLEETS = (1, 2, 10)
MCAP_TOO = "record: { format: [csv, mcap] }\n"
MCAP_GOAL = 150_000  # rows/s


# --- plant ----------------------------------------------------------------------------------------


MULTIROTORS = {f"{name}_step": name for name in ("px4_published", "multirotor_figure_eight")}


def measure_plant(programs: Programs, rounds: int, is_quick: bool) -> list[Figure]:
    """Measured with Google Benchmark, which interleaves the repetitions at random."""
    output = programs.run(
        programs.build / "bin/sls_microbench", "--benchmark_format=json",
        f"--benchmark_repetitions={rounds}", "--benchmark_enable_random_interleaving=true",
        f"--benchmark_min_time={0.01 if is_quick else 0.2}")
    times: dict[str, list[float]] = {}
    for run in json.loads(output)["benchmarks"]:
        if run["run_type"] == "iteration":
            times.setdefault(run["run_name"], []).append(run["cpu_time"])
    figures = []
    for name in sorted(times, key=split_name):
        (function, vehicles), values = split_name(name), times[name]
        if function == "plant_step":
            figures.append(Figure(
                "plant", f"RK4 step of one vehicle, {vehicles} in turn", "ns", values,
                "the same equations in closed form", times[f"closed_form_step/{vehicles}"], LESS,
                goal={1: 10_000, 100: 8_000}.get(vehicles)))
        elif function in MULTIROTORS:
            figures.append(Figure(
                "plant", f"RK4 step of one multirotor of {MULTIROTORS[function]}, {vehicles} in turn",
                "ns", values, better=LESS, goal=30_000))
        elif function != "closed_form_step":
            what = function.replace("_", " ") + (f", vehicles: {vehicles}" if vehicles else "")
            figures.append(Figure("plant", what, "ns", values, better=LESS))
    return figures


def split_name(name: str) -> tuple[str, int]:
    """Function and number of vehicles of a name such as "plant_step/100"; 0 vehicles if it has no number."""
    function, _, vehicles = name.partition("/")
    return function, int(vehicles or 0)


# --- recorder -------------------------------------------------------------------------------------


def measure_recorder(programs: Programs, rounds: int, is_quick: bool) -> list[Figure]:
    """The rows are those of state.csv, command.csv, reference.csv and flight.csv together."""
    figures = []
    for vehicles, steps in ((1, 2000), (100, 20)) if is_quick else ((1, 32000), (100, 1000)):
        scenario = programs.scenario("figure_eight", of_fleet(vehicles))
        speeds, bounds, megabytes, ends = [], [], [], []
        for _ in range(rounds):
            result = programs.probe("record", "--scenario", scenario, "--period-s", PERIOD_S,
                                    "--vehicles", str(vehicles), "--steps", str(steps),
                                    "--folder", programs.scratch)
            speeds.append(result["rows"] / result["recording_s"])
            bounds.append(result["rows"] / result["plain_s"])
            megabytes.append(result["bytes"] / result["recording_s"] / 1e6)
            ends.append(result["finish_s"] / result["rows"] * 1e6)
        title = f"Recording, {vehicles} vehicle{'s' if vehicles > 1 else ''}"
        figures += [Figure("recorder", title, "rows/s", speeds,
                           "std::to_chars and fwrite of the same bytes", bounds, goal=100_000),
                    Figure("recorder", title, "MB/s", megabytes),
                    Figure("recorder", f"{title}: hashes at the end", "µs/row", ends, better=LESS)]
        figures.append(measure_recorder_process(programs, rounds, scenario, vehicles, steps))
        figures += measure_mcap(programs, rounds, vehicles, steps)
    return figures


def measure_mcap(programs: Programs, rounds: int, vehicles: int, steps: int) -> list[Figure]:
    """The same with sls.mcap in addition to the CSV files, whose rows are counted; and the size of sls.mcap."""
    of_both = programs.scenario("figure_eight", lambda text: of_fleet(vehicles)(text) + MCAP_TOO)
    alone = programs.scenario("figure_eight", of_fleet(vehicles))
    speeds, speeds_alone, ratios = [], [], []
    for _ in range(rounds):
        common = ["--vehicles", str(vehicles), "--steps", str(steps), "--folder", programs.scratch]
        both = programs.probe("record", "--scenario", of_both, *common)
        csv = programs.probe("record", "--scenario", alone, *common)
        speeds.append(both["rows"] / both["recording_s"])
        speeds_alone.append(csv["rows"] / csv["recording_s"])
        ratios.append(both["mcap_bytes"] / both["bytes"])
    title = f"Recording with MCAP, {vehicles} vehicle{'s' if vehicles > 1 else ''}, 4 ms"
    return [Figure("recorder", title, "rows/s", speeds, "the same without", speeds_alone,
                   goal=MCAP_GOAL),
            Figure("recorder", f"{title}: size", "of the CSV files'", ratios, goal=1 / 3, better=LESS),
            measure_recorder_process(programs, rounds, of_both, vehicles, steps, with_mcap=True)]


def measure_recorder_process(programs: Programs, rounds: int, scenario: Path, vehicles: int,
                             steps: int, with_mcap: bool = False) -> Figure:
    speeds = []
    for _ in range(rounds):
        folder, log = programs.make_path(""), programs.make_path(".log")
        common = ["--domain", str(programs.domain)]
        recorder = programs.start([str(programs.build / "bin/recorder"), *common, "--out", str(folder)],
                                  log)
        try:
            result = programs.probe("feed", *common, "--scenario", scenario, "--period-s", PERIOD_S,
                                    "--vehicles", str(vehicles), "--steps", str(steps))
            code = recorder.wait(timeout=60)
        finally:
            end_all([recorder])
        check_recording(folder, code, log)
        speeds.append(result["rows"] / result["seconds"])
    return Figure("recorder", f"recorder process{' with MCAP' if with_mcap else ''}, over shared memory, "
                  f"{vehicles} vehicle{'s' if vehicles > 1 else ''}, 0 lost", "rows/s", speeds,
                  goal=MCAP_GOAL if with_mcap else 400_000 if vehicles == 1 else 500_000)


def check_recording(folder: Path, code: int, log: Path) -> None:
    if code != 0 or not json.loads((folder / "manifest.json").read_text())["complete"]:
        raise MeasurementError(f"recorder ended with {code}: {log.read_text().strip()}")


# --- fleets ---------------------------------------------------------------------------------------


def of_fleet(vehicles: int, seconds: float = 32):
    """Changes figure_eight.yaml to `vehicles` vehicles and to a plant step as long as the period."""
    def change(text: str) -> str:
        text = lasting(seconds)(text).replace("step_s: 0.001", "step_s: 0.004")
        return text if vehicles == 1 else f"{text}vehicles: {vehicles}\n"

    return change


def choose_seconds(vehicles: int, is_quick: bool) -> float:
    """Simulated time with which a flight in lockstep takes some seconds."""
    return 1.0 if is_quick else {1: 64, 2: 64, 5: 32, 10: 32, 20: 16}.get(vehicles, 8)


def measure_fleet(programs: Programs, rounds: int, is_quick: bool) -> list[Figure]:
    fleets = QUICK_FLEETS if is_quick else FLEETS
    costs = StepCosts(programs, is_quick)
    cores = len(os.sched_getaffinity(0))
    speeds, times = Rounds("fleet"), Rounds("fleet")
    memory: dict[int, list[float]] = {count: [] for count in fleets}
    name = ("1 / (raw Fast DDS round trip of the fleet's samples + plant step and control "
            "law of each vehicle, spread over the cores)")
    for _ in range(rounds):
        costs.round_trips = 2000 if is_quick else 20000
        costs.measure()
        costs.round_trips = 200 if is_quick else 2000
        per_vehicle = {}
        for count in fleets:
            scenario = programs.scenario("figure_eight",
                                         of_fleet(count, choose_seconds(count, is_quick)))
            raw = find_fastest(costs.ping("default", "--vehicles", str(count)), may_spin=True)
            work = {part: count / min(count, cores) * time for part, time in costs.work.items()}
            flight = programs.fly(scenario)
            if flight.lost or not flight.manifest["complete"]:
                raise MeasurementError(f"{count} vehicles: the recording is not complete")
            step_us = 1e6 / flight.steps_per_s
            title = f"{count} vehicle{'s' if count > 1 else ''}"
            speeds.add(title, "steps/s", flight.steps_per_s, name,
                       1e6 / (raw + work["plant_us"] + work["law_us"]),
                       calc_parts(step_us, work, costs.hand_over(True), raw))
            per_vehicle[count] = step_us / count
            times.add(f"{title}, per step and vehicle", "µs", per_vehicle[count], better=LESS,
                      goal=12.0 if count == 100 else None)
            memory[count].append(flight.server_memory_kb)
        if 200 in fleets:
            times.add("time per step and vehicle, 200 over 10 vehicles", "1",
                      per_vehicle[200] / per_vehicle[10], better=LESS, goal=1.0)
    least, most = (2, 10) if is_quick else (10, 200)  # fleets only: one vehicle has histories of another size
    figures = speeds.make_figures() + times.make_figures()
    figures.append(Figure("fleet", "server memory per vehicle", "kB", [
        (large - small) / (most - least) for large, small in zip(memory[most], memory[least])],
        better=LESS))
    figures.append(find_most_in_real_time(programs, is_quick))
    return figures


def holds_real_time(programs: Programs, vehicles: int, seconds: float) -> bool:
    scenario = programs.scenario("figure_eight", of_fleet(vehicles, seconds))
    try:
        flight = programs.fly(scenario, server=("--mode", "realtime", "--rtf", "1"))
    except MeasurementError:
        return False  # a recorder that lost samples ends with exit code 1
    is_on_time = flight.label.startswith("real-time") and count_late(flight.label) == 0
    return is_on_time and flight.lost == 0 and flight.manifest["complete"]


def find_most_in_real_time(programs: Programs, is_quick: bool) -> Figure:
    """By bisection, to ten vehicles. Each size has two attempts, because other work can disturb one."""
    seconds = 1.0 if is_quick else 10.0

    def holds(vehicles: int) -> bool:
        return any(holds_real_time(programs, vehicles, seconds) for _ in range(2))

    held, failed = 0, 256 // 10 * 10 + 10
    candidate = 10 if is_quick else 100
    while failed - held > 10:
        if holds(candidate):
            held = candidate
        else:
            failed = candidate
        if is_quick:
            break
        candidate = (held + failed) // 20 * 10
    return Figure("fleet", f"most in real time at 250 Hz for {seconds:g} s, 0 late, 0 lost",
                  "vehicles", [float(held)], goal=100)



"""What a user waits for around a flight: from the command to the prompt."""

import os
import re
import time
from pathlib import Path

from bench.programs import LONGEST_S, ROOT, MeasurementError, Programs, end_all
from bench.results import LESS, Figure, Rounds

SHORT_STEPS = 100


def run_together(programs: Programs, commands: dict[str, list[str]]) -> tuple[float, float, dict[str, str]]:
    """Starts the commands together. Returns wall time until all have ended, their processor time (s)
    and what each printed."""
    logs = {name: programs.make_path(f"-{name}.log") for name in commands}
    processes = {}
    began = time.monotonic()
    try:
        for name, command in commands.items():
            processes[name] = programs.start(["timeout", f"{LONGEST_S:.0f}", *command], logs[name])
        processor_s = 0.0
        for process in processes.values():
            _, status, usage = os.wait4(process.pid, 0)
            process.returncode = os.waitstatus_to_exitcode(status)
            processor_s += usage.ru_utime + usage.ru_stime
    finally:
        end_all(list(processes.values()))
    wall_s = time.monotonic() - began
    said = {name: log.read_text() for name, log in logs.items()}
    for name, process in processes.items():
        if process.returncode != 0:
            raise MeasurementError(f"{name} ended with {process.returncode}: {said[name].strip()}")
    return wall_s, processor_s, said


def run_launcher(programs: Programs, *words: str | Path) -> tuple[float, float, float]:
    """Wall time and processor time of `./sls run`, and the time of its flight, s."""
    # With SLS_BUILD the launcher does not look whether the build is stale, which takes time.
    elsewhere = [] if programs.build == ROOT / "build" else ["env", f"SLS_BUILD={programs.build}"]
    command = [*elsewhere, str(ROOT / "sls"), "run", *map(str, words), "--out", str(programs.make_path("")),
               "--domain", str(programs.domain)]
    wall_s, processor_s, said = run_together(programs, {"sls": command})
    flight = re.search(r"simulated in ([\d.]+) s", said["sls"])
    if not flight:
        raise MeasurementError(f"sls run: expected the time of the flight, got: {said['sls']}")
    return wall_s, processor_s, float(flight[1])


def run_programs(programs: Programs, scenario: Path) -> tuple[float, float]:
    """Wall time and processor time of the three programs without the launcher, s."""
    common = ["--domain", str(programs.domain)]
    flown = [*common, "--scenario", str(scenario)]
    words = {"recorder": [*common, "--out", str(programs.make_path(""))],
             "sim_server": flown, "control_client": flown}
    wall_s, processor_s, _ = run_together(
        programs, {name: [str(programs.build / "bin" / name), *flags] for name, flags in words.items()})
    return wall_s, processor_s


def measure_start(programs: Programs, rounds: int, is_quick: bool) -> list[Figure]:
    short = programs.scenario(
        "figure_eight", lambda text: re.sub(r"for_s: [\d.]+", f"for_s: {SHORT_STEPS * 0.004}", text))
    eight = short if is_quick else programs.scenario("figure_eight")
    figures = Rounds("start")
    for _ in range(rounds):
        wall_s, processor_s, _ = run_launcher(programs, short)
        figures.add(f"./sls run of {SHORT_STEPS} steps: wall", "s", wall_s, better=LESS, goal=0.8)
        figures.add(f"./sls run of {SHORT_STEPS} steps: processor", "s", processor_s, better=LESS, goal=0.7)
        wall_s, processor_s = run_programs(programs, short)
        figures.add("its three programs alone: wall", "s", wall_s, better=LESS, goal=0.6)
        figures.add("its three programs alone: processor", "s", processor_s, better=LESS)
        wall_s, _, flight_s = run_launcher(programs, eight, "--period-s", "0.001")
        figures.add("./sls run figure_eight --period-s 0.001, less its flight", "s", wall_s - flight_s,
                    better=LESS, goal=0.9)
    return figures.make_figures()

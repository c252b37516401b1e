"""What a user waits for around a flight: from the command to the prompt."""

import re
import time
from pathlib import Path

from bench.programs import ROOT, Programs
from bench.results import LESS, Figure, Rounds
from sls.errors import RunError

SHORT_STEPS = 100


def time_together(programs: Programs, commands: dict[str, list[str]]) -> tuple[float, float, dict[str, str]]:
    """Wall time until all commands have ended, their processor time (s) and what each printed."""
    began = time.monotonic()
    processor_s, said = programs.run_together(commands)
    return time.monotonic() - began, sum(processor_s.values()), said


def run_launcher(programs: Programs, *words: str | Path) -> tuple[float, float, float]:
    """Wall time and processor time of `./sls run`, and the time of its flight, s."""
    # With SLS_BUILD the launcher does not look whether the build is stale, which takes time.
    elsewhere = [] if programs.build == ROOT / "build" else ["env", f"SLS_BUILD={programs.build}"]
    command = [*elsewhere, str(ROOT / "sls"), "run", *map(str, words), "--out", str(programs.make_path("")),
               "--domain", str(programs.domain)]
    wall_s, processor_s, said = time_together(programs, {"sls": command})
    flight = re.search(r"simulated in ([\d.]+) s", said["sls"])
    if not flight:
        raise RunError(f"sls run: expected the time of the flight, got: {said['sls']}")
    return wall_s, processor_s, float(flight[1])


def measure_start(programs: Programs, rounds: int, is_quick: bool) -> list[Figure]:
    short = programs.figure_eight(SHORT_STEPS * 0.004)
    eight = short if is_quick else programs.figure_eight()
    figures = Rounds("start")
    for _ in range(rounds):
        wall_s, processor_s, _ = run_launcher(programs, short)
        figures.add(f"./sls run of {SHORT_STEPS} steps: wall", "s", wall_s, better=LESS, goal=0.8)
        figures.add(f"./sls run of {SHORT_STEPS} steps: processor", "s", processor_s, better=LESS, goal=0.7)
        wall_s, processor_s, _ = time_together(programs, programs.make_commands(short, programs.make_path("")))
        figures.add("its three programs alone: wall", "s", wall_s, better=LESS, goal=0.6)
        figures.add("its three programs alone: processor", "s", processor_s, better=LESS)
        wall_s, _, flight_s = run_launcher(programs, eight, "--period-s", "0.001")
        figures.add("./sls run figure_eight --period-s 0.001, less its flight", "s", wall_s - flight_s,
                    better=LESS, goal=0.9)
    return figures.make_figures()

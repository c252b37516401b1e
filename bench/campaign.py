"""A campaign on all cores, compared with as many C++ processes that fly the same runs; and the CPU
time of the parts of a run."""

import json
import os
import time
from pathlib import Path

from bench.programs import ROOT, MeasurementError, Programs, end_all, wait_for
from bench.results import LESS, Figure, Rounds

MEASURES = ("load_error_rms", "load_error_max", "settling", "overshoot", "tilt_max", "force_max",
            "time_of_loss", "outcome")
VARIED = "vehicle.load_mass_kg"
MOST_S = 60.0  # for 10,000 figure eights on two cores


def fly_in_closed_form(text: str) -> str:
    """figure_eight.yaml without Simbody, with a step of the plant as long as the period."""
    return text.replace("pendulum: ideal", "model: analytic").replace("step_s: 0.001", "step_s: 0.004")


def make_values(runs: int) -> list[str]:
    """Load masses, in kg, as YAML."""
    return [repr(round(0.15 + 0.1 * run / runs, 9)) for run in range(runs)]


def write_campaign(programs: Programs, scenario: Path, values: list[str], certify: str) -> Path:
    file = programs.make_path("-campaign.yaml")
    file.write_text(f"base: {scenario.name}\nvary:\n  {VARIED}: {{ list: [{', '.join(values)}] }}\n"
                    f"measure: [{', '.join(MEASURES)}]\nkeep: none\ncertify: {certify}\n")
    return file


def time_campaign(programs: Programs, file: Path) -> tuple[float, int]:
    """Flies a campaign by `./sls campaign` with its report. Returns seconds and the number of its runs."""
    folder = programs.make_path("-runs")
    began = time.monotonic()
    programs.run("env", f"SLS_BUILD={programs.build}", ROOT / "sls", "campaign", file, "--out", folder,
                 "--on", "local")
    seconds = time.monotonic() - began
    rows = (folder / "runs.csv").read_text().count("\n") - 1
    return seconds, rows


def time_processes(programs: Programs, scenario: Path, values: list[str], certify: bool,
                   count: int) -> float:
    """Flies the runs in `count` C++ processes at once. Returns seconds from their start to the last end."""
    processes, logs = [], []
    began = time.monotonic()
    try:
        for part in range(count):
            lines = programs.make_path("-values.txt")
            lines.write_text("\n".join(values[part::count]) + "\n")
            logs.append(programs.make_path("-fly.log"))
            processes.append(programs.start(
                [str(programs.build / "bin/sls_bench_campaign"), "fly", "--scenario", str(scenario),
                 "--path", VARIED, "--values", str(lines), *["--certify"] * certify], logs[-1]))
        for process, log in zip(processes, logs):
            wait_for(process, began + 300)
            if process.returncode != 0:
                raise MeasurementError(f"sls_bench_campaign: {log.read_text().strip()}")
        seconds = time.monotonic() - began
    finally:
        end_all(processes)
    flown = sum(json.loads(log.read_text())["finished"] for log in logs)
    if flown != len(values):
        raise MeasurementError(f"sls_bench_campaign: expected {len(values)} finished flights, got {flown}")
    return seconds


def measure_campaign(programs: Programs, rounds: int, is_quick: bool) -> list[Figure]:
    """10,000 figure eights of 32 s at 250 Hz, with and without certificates."""
    runs = 20 if is_quick else 10_000
    cores = len(os.sched_getaffinity(0))
    scenario = programs.scenario("figure_eight", fly_in_closed_form)
    values = make_values(runs)
    figures = Rounds("campaign")
    bound = f"{cores} C++ processes at once"
    for _ in range(rounds):
        for certify, title in (("all", "all measures, all certificates"),
                               ("none", "all measures, no certificate")):
            seconds, rows = time_campaign(programs, write_campaign(programs, scenario, values, certify))
            if rows != runs:
                raise MeasurementError(f"./sls campaign: expected {runs} rows, got {rows}")
            processes_s = time_processes(programs, scenario, values, certify == "all", cores)
            figures.add(f"./sls campaign, {title}", "runs/s", runs / seconds, bound, runs / processes_s,
                        goal=None if is_quick else 0.9, is_goal_of_ratio=True)
            figures.add(f"{runs:,} figure eights, {title}", "s", seconds, better=LESS,
                        goal=MOST_S if certify == "all" else None)
        add_parts(programs, figures, scenario, values[:20 if is_quick else 500])
    return figures.make_figures()


def add_parts(programs: Programs, figures: Rounds, scenario: Path, values: list[str]) -> None:
    """CPU time of the parts of a run, in one process."""
    lines = programs.make_path("-values.txt")
    lines.write_text("\n".join(values) + "\n")
    parts = json.loads(programs.run(programs.build / "bin/sls_bench_campaign", "parts", "--scenario",
                                    scenario, "--path", VARIED, "--values", lines))
    names = {"scenario": "reading its scenario", "flight": "making plant and controller",
             "steps": "plant and controller", "measures": "all measures", "certificate": "certificate"}
    for key, name in names.items():
        figures.add(f"a run: {name}", "ms", 1e3 * parts[f"{key}_s"] / len(values), better=LESS)

"""The functions of a step alone: plant, law, serialisation."""

import json

from bench.programs import Programs
from bench.results import LESS, Figure

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

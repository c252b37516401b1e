"""`./sls bench`: its command line."""

import argparse
import json
import os
import platform
import signal
import sys
import tempfile
from collections.abc import Callable
from datetime import datetime, timezone
from pathlib import Path
from typing import Any, NoReturn

from bench import instructions, loop, plant, start
from bench.programs import DOMAINS, Programs
from bench.results import Figure, format_table
from sls.campaign.arguments import Parser
from sls.dds_domain import own_domain
from sls.errors import RunError
from sls.input_error import InputError
from sls.launcher.place import say

Measure = Callable[[Programs, int, bool], list[Figure]]
PARTS: dict[str, tuple[Measure, int]] = {  # int: number of rounds
    "lockstep": (loop.measure_lockstep, 3),
    "load": (loop.measure_load, 3),
    "realtime": (loop.measure_realtime, 3),
    "plant": (plant.measure_plant, 5),
    "start": (start.measure_start, 9),
    "instructions": (instructions.measure_instructions, 1),
}


def parse_arguments() -> argparse.Namespace:
    parser = Parser(prog="./sls bench", description="Measures speed, each figure beside its bound from the same run, "
                    "and prints a table. Takes minutes and needs an idle machine.")
    parser.add_argument("--quick", action="store_true",
                        help="one short round of every part, to check that it works")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the figures of every round to FILE")
    parser.add_argument("--only", nargs="+", choices=PARTS, metavar="NAME",
                        help=f"run only these parts: {', '.join(PARTS)}")
    parser.add_argument("--out", type=Path, metavar="DIR", help="draw plots (PNG and SVG) into DIR")
    parser.add_argument("--build", type=Path, required=True, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.json and not options.json.resolve().parent.is_dir():
        raise InputError(f"--json {options.json}: expected a file in a folder that exists")
    if options.out:
        try:
            options.out.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InputError(f"--out {options.out}: expected a folder, got: {error.strerror}") from None
    return options


def read_processor() -> str:
    for line in Path("/proc/cpuinfo").read_text().splitlines():
        if line.startswith("model name"):
            return line.split(": ", 1)[1]
    return platform.processor()


def describe_machine() -> dict[str, Any]:
    return {"processor": read_processor(), "cores": len(os.sched_getaffinity(0)),
            "kernel": platform.release()}


def now() -> str:
    return datetime.now(timezone.utc).strftime("%Y-%m-%dT%H:%M:%SZ")


def measure(options: argparse.Namespace, programs: Programs) -> dict[str, Any]:
    json_parts: dict[str, Any] = {"machine": describe_machine(), "began": now(),
                                  "load_before": os.getloadavg()[0], "quick": options.quick}
    figures: list[Figure] = []
    for name in options.only or PARTS:
        measure_part, rounds = PARTS[name]
        say(f"measures {name}")
        figures += measure_part(programs, 1 if options.quick else rounds, options.quick)
    json_parts["ended"] = now()
    json_parts["figures"] = [figure.to_json() for figure in figures]
    machine = json_parts["machine"]
    print(f"{machine['processor']}, {machine['cores']} cores, load before: "
          f"{json_parts['load_before']:.2f}{', quick' if options.quick else ''}")
    print(format_table(figures))
    return json_parts


def main() -> int:
    try:
        options = parse_arguments()
        with own_domain(DOMAINS, "bench") as domain, tempfile.TemporaryDirectory(prefix="sls-bench-") as scratch:
            result = measure(options, Programs(options.build, domain, Path(scratch)))
        if options.json:
            options.json.write_text(json.dumps(result, indent=2) + "\n")
        if options.out:
            from bench.plots import save_plots  # needs python3-matplotlib

            for file in save_plots(result, options.out):
                say(f"plot: {file}")
    except (InputError, RunError, OSError, ImportError) as error:
        say(f"error: {error}")
        return 2 if isinstance(error, InputError) else 1
    return 0


def interrupt(number: int, frame: Any) -> NoReturn:
    raise SystemExit(128 + number)


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, interrupt)
    signal.signal(signal.SIGINT, interrupt)
    sys.exit(main())

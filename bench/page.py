"""The page and the Foxglove bridge of sls_view, measured with Chromium and with a client of npm's `ws`."""

import json
import os
import subprocess
from typing import Any

from bench.programs import ROOT, MeasurementError, Programs
from bench.results import LESS, Figure, Rounds

NODE_TESTS = ROOT / "tests/tools/view"
SECONDS = 10.0
QUICK_SECONDS = 1.0
BRIDGE_RATE = 55_000  # samples/s that the publisher writes; the goal is 50,000
LONGEST_S = 120.0


def run_node(programs: Programs, script: str, *words: object) -> Any:
    """The JSON line that a script of tests/tools/view prints."""
    command = ["node", str(NODE_TESTS / script), *map(str, words)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=LONGEST_S,
                          env={**os.environ, "SLS_BUILD": str(programs.build)})
    if not done.stdout.startswith("{"):
        raise MeasurementError(f"{script}: expected a JSON line, got exit code {done.returncode}: {done.stderr.strip()}")
    return json.loads(done.stdout)


def measure_page(programs: Programs, rounds: int, is_quick: bool) -> list[Figure]:
    """Chromium runs without a display, so it draws in software."""
    figures = Rounds("page")
    seconds = QUICK_SECONDS if is_quick else SECONDS
    for _ in range(rounds):
        load = run_node(programs, "page/measure.mjs", "load", programs.build, programs.domain, seconds)
        figures.add("first load on loopback, until the first frame", "ms", load["first_frame_ms"], better=LESS,
                    goal=1000)
        figures.add("size of the page, not compressed", "MB", load["bytes"] / 1e6, better=LESS, goal=1.5)
        latency = run_node(programs, "page/measure.mjs", "latency", programs.build, programs.domain, seconds)
        figures.add("state published to drawn, p50, 250 Hz in real time", "ms", latency["p50_ms"], better=LESS,
                    goal=40)
        figures.add("state published to drawn, p99, 250 Hz in real time", "ms", latency["p99_ms"], better=LESS,
                    goal=100)
        fleet = run_node(programs, "page/measure.mjs", "fleet", programs.build, programs.domain, seconds)
        figures.add("100 vehicles in Chromium", "frames/s", fleet["frames_per_s"], goal=20)
        bridge = run_node(programs, "foxglove/throughput.mjs", BRIDGE_RATE, seconds)
        figures.add("Foxglove bridge, samples of sls/state to one client", "messages/s", bridge["per_s"],
                    goal=50_000)
        figures.add(f"lost of {BRIDGE_RATE} messages/s", "messages", bridge["lost"], better=LESS, goal=0)
    return figures.make_figures()

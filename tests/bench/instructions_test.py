"""Instructions per step of server, client and recorder, without waits, beside committed ones: a
guard that needs no idle machine. Callgrind counts them in flights of plant `analytic` with
recorder; `./sls bench --only instructions` measures more and lists parts and functions.

    tests/bench/instructions_test.py BUILD [--write]    --write: writes this machine's figures
"""

import json
import pathlib
import re
import shutil
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "python")]

from bench.instructions import count_flight, count_without_waits  # noqa: E402
from bench.programs import DOMAINS, Programs  # noqa: E402
from sls.dds_domain import own_domain  # noqa: E402

BUILD = pathlib.Path(sys.argv.pop(1)).resolve()
FIGURES = pathlib.Path(__file__).with_name("instructions.json")  # by version of Fast DDS
# Of the committed figure; five counts beside 9 to 13 busy processes were within 2.2 %.
MOST_MORE, MOST_LESS = 0.05, 0.1


def read_cache(name: str) -> str:
    """The value of a variable of the build; empty if there is none."""
    found = re.search(rf"^{name}:\w+=(.*)$", (BUILD / "CMakeCache.txt").read_text(), re.MULTILINE)
    return found[1] if found else ""


def read_fast_dds() -> str:
    """The version of Fast DDS, which has half of the instructions."""
    for name in ("fastrtps_DIR", "fastdds_DIR"):
        for file in pathlib.Path(read_cache(name)).glob("*-config-version.cmake"):
            if found := re.search(r'PACKAGE_VERSION "([\d.]+)"', file.read_text()):
                return found[1]
    return "unknown"


def read_figures() -> dict[str, dict[str, int]]:
    return json.loads(FIGURES.read_text()) if FIGURES.exists() else {}


def find_obstacle() -> str:
    """Why nothing can be compared; empty if it can."""
    if not shutil.which("valgrind"):
        return "no valgrind (apt-get install valgrind)"
    if read_cache("CMAKE_BUILD_TYPE") != "Release":
        return "the figures are those of a Release build"
    if read_fast_dds() not in read_figures():
        return f"{FIGURES.name} has no figures with Fast DDS {read_fast_dds()}"
    return ""


def measure() -> dict[str, int]:
    with own_domain(DOMAINS, "bench") as domain, tempfile.TemporaryDirectory() as scratch:
        counted = count_flight(Programs(BUILD, domain, pathlib.Path(scratch)), "analytic", True)
    return {name: count_without_waits(functions) for name, functions in counted.items()}


class InstructionsTest(unittest.TestCase):
    def test_a_step_has_as_many_instructions_as_committed(self):
        committed = read_figures()[read_fast_dds()]
        for name, counted in measure().items():
            with self.subTest(name):
                self.assertLessEqual(
                    counted, committed[name] * (1 + MOST_MORE),
                    f"{name}: more instructions per step (./sls bench --only instructions)")
                self.assertGreaterEqual(
                    counted, committed[name] * (1 - MOST_LESS),
                    f"{name}: fewer instructions per step: write the new figures (--write)")


if __name__ == "__main__":
    if "--write" in sys.argv:
        known = {**read_figures(), read_fast_dds(): measure()}
        FIGURES.write_text(json.dumps(known, indent=2) + "\n")
    elif obstacle := find_obstacle():
        print(f"skipped: {obstacle}")
        sys.exit(77)
    else:
        unittest.main()

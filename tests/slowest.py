"""Prints the table of tests/README.md for the slowest tests of a run, longest first, with what the README says of each.

    python3 -B tests/slowest.py [LOG] [--count N] [--write]

LOG: of ctest, build/Testing/Temporary/LastTest.log by default, or its output. --write: writes the table into the README.
"""

import argparse
import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
README = ROOT / "tests/README.md"
TABLE = re.compile(r"\| test \| s \|.*\n\|.*\n((?:\|.*\n)+)")


def read_times(text: str) -> dict[str, float]:
    """Seconds by the name of the test, from a log or an output of ctest."""
    logged = re.findall(r"^\d+/\d+ Test: (\S+)$(?:.*\n)*?^Test time = +([\d.]+) sec", text, re.MULTILINE)
    printed = re.findall(r"Test +#\d+: (\S+) \.*.*? ([\d.]+) sec", text)
    return {name: float(time_s) for name, time_s in logged or printed}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("log", nargs="?", type=Path, default=ROOT / "build/Testing/Temporary/LastTest.log")
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--write", action="store_true")
    options = parser.parse_args()
    page = README.read_text(encoding="utf-8")
    needs = {cells[1].strip("` "): cells[3].strip() for row in TABLE.search(page)[1].splitlines()
             if (cells := row.split("|"))}
    times = read_times(options.log.read_text(encoding="utf-8", errors="replace"))
    slowest = sorted(times.items(), key=lambda item: -item[1])[:options.count]
    rows = "".join(f"| `{name}` | {time_s:.0f} | {needs.get(name, '?')} |\n" for name, time_s in slowest)
    if options.write:
        README.write_text(page.replace(TABLE.search(page)[1], rows), encoding="utf-8")
    print(rows, end="")


if __name__ == "__main__":
    main()

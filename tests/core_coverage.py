"""Prints how many branches of the cores their scripts take, or worlds, and those that none takes.

    python3 -B tests/core_coverage.py [--build FOLDER] [--worlds A-B]

Branches that only an exception takes do not count: the compiler adds one to almost every call.
"""

import argparse
import collections
import json
import pathlib
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[1]
CORES = ("common/sync", "control_client/core", "recorder/core", "sim_server/core")
TESTS = ("sync_test", "client_core_test", "recorder_core_test", "server_core_test", "fault_line_test")


def run(folder: pathlib.Path, seeds: str | None) -> None:
    """Builds the tests of the cores, or the worlds of the seeds, with counters, and runs them."""
    configure = ["cmake", "--preset", "release", "-B", folder, "-DSLS_BUILD_PROGRAMS=OFF",
                 f"-DCMAKE_PROJECT_sls_INCLUDE={ROOT / 'tests/core_coverage.cmake'}"]
    targets = TESTS if seeds is None else ("sls_worlds",)
    for command in (configure, ["ninja", "-C", folder, *targets]):
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL, cwd=ROOT)
    for counters in folder.rglob("*.gcda"):
        counters.unlink()
    for target in targets:
        command = [folder / "tests" / target] if seeds is None else [folder / "bin" / target, "--seeds", seeds]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)


def count(folder: pathlib.Path) -> dict:
    """The branches of each file of a core: {file: {line: [times taken, ...]}}."""
    files = collections.defaultdict(dict)
    for counters in folder.rglob("*.gcda"):
        report = subprocess.run(["gcov", "--json-format", "--stdout", "--branch-probabilities", counters],
                                check=True, capture_output=True, cwd=folder).stdout
        for line in report.splitlines():
            for file in json.loads(line)["files"]:
                path = (folder / file["file"]).resolve()
                name = str(path.relative_to(ROOT)) if ROOT in path.parents else ""
                if not name.startswith(tuple(core + "/" for core in CORES)):
                    continue
                for entry in file["lines"]:
                    taken = [branch["count"] for branch in entry["branches"] if not branch["throw"]]
                    known = files[name].setdefault(entry["line_number"], taken)
                    if known is not taken and len(known) == len(taken):
                        files[name][entry["line_number"]] = [a + b for a, b in zip(known, taken)]
    return files


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build-coverage")
    parser.add_argument("--worlds", metavar="A-B", help="flies worlds of these seeds instead of the scripts")
    options = parser.parse_args()
    folder = options.build.resolve()
    run(folder, options.worlds)
    files = count(folder)
    print(f"{'file':48} {'branches':>8} {'taken':>6}")
    everything = taken = 0
    for name in sorted(files):
        branches = [times for line in files[name].values() for times in line]
        hit = sum(times != 0 for times in branches)  # several threads count: a sum may overflow
        everything, taken = everything + len(branches), taken + hit
        missed = sorted(line for line, times in files[name].items() if 0 in times)
        if branches:
            print(f"{name:48} {len(branches):8} {hit:6}  {' '.join(map(str, missed))}")
    print(f"{'all':48} {everything:8} {taken:6}  {100 * taken / max(everything, 1):.1f} %")
    return 0


if __name__ == "__main__":
    sys.exit(main())

"""Prints how many branches of the cores their scripts and worlds take, and those that none takes.

    python3 -B tests/core_coverage.py [--build FOLDER] [--worlds A-B] [--no-scripts]

A branch is one outcome of a condition in the source, as Clang counts them (packages clang and llvm): each operand of
`&&` and `||` has two, and each label of a switch one.
"""

import argparse
import collections
import json
import os
import pathlib
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[1]
CORES = ("common/sync", "control_client/core", "recorder/core", "sim_server/core")
TESTS = ("sync_test", "client_core_test", "recorder_core_test", "server_core_test", "fault_line_test")


def run(folder: pathlib.Path, options: argparse.Namespace) -> list[pathlib.Path]:
    """Builds the programs that were asked for, with counters, and runs them. Returns them."""
    configure = ["cmake", "--preset", "release", "-B", folder, "-DSLS_BUILD_PROGRAMS=OFF",
                 "-DCMAKE_C_COMPILER=clang", "-DCMAKE_CXX_COMPILER=clang++",
                 f"-DCMAKE_PROJECT_sls_INCLUDE={ROOT / 'tests/core_coverage.cmake'}"]
    programs = [] if options.no_scripts else [[folder / "tests" / test] for test in TESTS]
    programs += [[folder / "bin/sls_worlds", "--seeds", options.worlds]] if options.worlds else []
    for command in (configure, ["ninja", "-C", folder, *(program.name for program, *_ in programs)]):
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL, cwd=ROOT)
    for command in programs:
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL,
                       env={**os.environ, "LLVM_PROFILE_FILE": f"{command[0]}.profraw"})
    counters = [f"{program}.profraw" for program, *_ in programs]
    subprocess.run(["llvm-profdata", "merge", "-o", folder / "counters", *counters], check=True)
    return [program for program, *_ in programs]


def count(folder: pathlib.Path, programs: list[pathlib.Path]) -> dict:
    """The branches of each file of a core: {file: {(line, column): [times true, times false]}}."""
    objects = [argument for program in programs[1:] for argument in ("-object", program)]
    report = subprocess.run(["llvm-cov", "export", f"-instr-profile={folder / 'counters'}", programs[0], *objects],
                            check=True, capture_output=True).stdout
    files = collections.defaultdict(lambda: collections.defaultdict(lambda: [0, 0]))
    for file in json.loads(report)["data"][0]["files"]:
        path = pathlib.Path(file["filename"]).resolve()
        name = str(path.relative_to(ROOT)) if ROOT in path.parents else ""
        if not name.startswith(tuple(core + "/" for core in CORES)):
            continue
        for line, column, _, _, is_true, is_false, *_ in file["branches"]:
            taken = files[name][line, column]  # a template has several instances
            taken[0] += is_true
            taken[1] += is_false
    return files


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build-coverage")
    parser.add_argument("--worlds", metavar="A-B", help="also fly worlds of these seeds")
    parser.add_argument("--no-scripts", action="store_true", help="count what worlds take alone")
    options = parser.parse_args()
    folder = options.build.resolve()
    files = count(folder, run(folder, options))
    print(f"{'file':48} {'branches':>8} {'taken':>6}")
    everything = taken = 0
    for name in sorted(files):
        branches = [times for condition in files[name].values() for times in condition]
        hit = sum(times > 0 for times in branches)
        everything, taken = everything + len(branches), taken + hit
        missed = [f"{line}:{column}" for (line, column), times in sorted(files[name].items()) if 0 in times]
        print(f"{name:48} {len(branches):8} {hit:6}  {' '.join(missed)}")
    print(f"{'all':48} {everything:8} {taken:6}  {100 * taken / max(everything, 1):.1f} %")
    return 0


if __name__ == "__main__":
    sys.exit(main())

"""Runs the two commands in clean Debian systems and prints a table: ./sls systems."""

import argparse
import pathlib
import subprocess
import sys
import time

import aarch64
import results
import tree
from results import say

COMMANDS = ("demo", "test", "package")
SYSTEMS = (*tree.CODENAMES, tree.ARM)
USUAL = ("debian12", "debian13")
VERSIONS = {
    "Debian": "cat /etc/debian_version",
    "Fast DDS": "dpkg-query -W -f '${Version}' libfastdds-dev 2>/dev/null || dpkg-query -W -f '${Version}' libfastrtps-dev",
    "Eigen": "dpkg-query -W -f '${Version}' libeigen3-dev",
    "g++": "{ g++ -dumpfullversion || aarch64-linux-gnu-g++ -dumpfullversion; } 2>/dev/null",
    "CMake": "cmake --version | sed -n 's/cmake version //p'",
    "Python": "python3 --version 2>/dev/null | sed 's/Python //'",
}


def parse(words):
    parser = argparse.ArgumentParser(prog="./sls systems", usage="./sls systems [OPTIONS] [SYSTEM…]", description="""\
Makes clean Debian systems with debootstrap, copies this checkout into each, runs the two commands in it and prints a
table. In aarch64 it builds for ARM instead, and flies under qemu. Needs root. The systems use the network of this
machine: do not fly on it meanwhile. Nothing is mounted outside the systems, and they are deleted, also after Ctrl-C.
Exit code 0: every command ended with 0, and the certificates are as they must be.""")
    parser.add_argument("system", nargs="*", metavar="SYSTEM",
                        help=f"{', '.join(SYSTEMS[:-1])} or {SYSTEMS[-1]} (default: {' and '.join(USUAL)})")
    parser.add_argument("--commands", default="demo,test", metavar="LIST",
                        help=f"the commands, of {', '.join(COMMANDS)} (default: demo,test)")
    parser.add_argument("--only", metavar="REGEX",
                        help="run only the tests, in aarch64 fly only the scenarios, whose names match")
    parser.add_argument("--limit-minutes", type=float, default=180, metavar="X",
                        help="stop the commands of a system after this time (default: 180)")
    parser.add_argument("--need-gib", type=float, metavar="X",
                        help="free disk that each system must find (default: 16 with test, else 8)")
    parser.add_argument("--folder", type=pathlib.Path, default=tree.ROOT / "build/systems", metavar="DIR",
                        help="folder of the systems, their logs and bases (default: build/systems)")
    parser.add_argument("--keep", action="store_true", help="do not delete the systems")
    parser.error = lambda message: fail(f"systems: {message}", 2)
    arguments = parser.parse_args(words)
    # The tests of a system fly with programs of the one before: ARM is the last.
    arguments.system = sorted(dict.fromkeys(arguments.system or USUAL), key=tree.ARM.__eq__)
    arguments.commands = arguments.commands.split(",")
    for name, values, known in (("SYSTEM", arguments.system, SYSTEMS), ("--commands", arguments.commands, COMMANDS)):
        for value in values:
            if value not in known:
                fail(f"systems: {name}: expected one of {', '.join(known)}, got '{value}'", 2)
    if not arguments.limit_minutes > 0:
        fail(f"systems: --limit-minutes: expected > 0, got {arguments.limit_minutes:g}", 2)
    if "package" in arguments.commands and tree.ARM in arguments.system:
        fail("systems: --commands: expected no package for aarch64, got 'package'", 2)
    arguments.folder = arguments.folder.absolute()
    return arguments


def fail(text, code=1):
    say(f"error: {text}")
    sys.exit(code)


def look_at_commands(system, arguments, column):
    """Runs the commands in a tree and reads what they left there."""
    if "demo" in arguments.commands:
        column.run("./sls demo", system, "demo", "./sls", "demo")
        column.certificate = results.find_certificate(system.checkout)
        column.rows["certificate"] = column.certificate[:16]
    if "test" in arguments.commands:
        column.run("./sls test", system, "test", "./sls", "test",
                   *(["--only", arguments.only] if arguments.only else []))
        if (file := system.checkout / "build/test.xml").is_file():
            column.tests = results.read_tests(file)
            column.rows["tests"] = str(column.tests)
    if "package" in arguments.commands:
        column.run("./sls package", system, "package", "./sls", "package")
        for file in system.checkout.glob("build/package/*.deb"):
            place = tree.ROOT / "build/package" / file.name
            place.parent.mkdir(parents=True, exist_ok=True)
            place.write_bytes(file.read_bytes())
            column.rows["package"] = str(place.relative_to(tree.ROOT))


def look_at(system, arguments):
    """Makes a tree and runs the commands in it. Returns the column of the table."""
    column = results.Column(system.system)
    is_arm = system.system == tree.ARM
    needed_gib = 8 if is_arm or "test" not in arguments.commands else 16
    try:
        tree.check_disk(arguments.folder, needed_gib if arguments.need_gib is None else arguments.need_gib)
        say(f"{system.system}: making a clean system in {system.path}")
        start = time.monotonic()
        system.make()
        column.rows["commit"] = system.copy_checkout()
        column.rows["clean system"] = f"{time.monotonic() - start:.0f} s"
        try:
            (aarch64.look_at if is_arm else look_at_commands)(system, arguments, column)
        finally:
            for row, command in VERSIONS.items():
                column.rows[row] = system.ask(command)
    except tree.Failure as failure:
        say(f"error: {system.system}: {failure}")
        column.is_good = False
    return column


def look_at_all(names, arguments):
    """The columns of these systems, one after the other. The tests of the second fly with programs of the first."""
    columns, systems = [], []
    try:
        for name in names:
            other = systems[-1] if systems and columns[-1].is_good and "test" in arguments.commands else None
            systems.append(tree.Tree(name, arguments.folder, time.monotonic() + arguments.limit_minutes * 60, other))
            columns.append(look_at(systems[-1], arguments))
    finally:
        for system in systems:
            if arguments.keep:
                say(f"{system.system}: kept {system.path}")
            else:
                tree.remove(system.path)
    return columns


def main():
    arguments = parse(sys.argv[1:])
    try:
        tree.handle_signals()
        tree.check_machine()
        if tree.ARM in arguments.system:
            aarch64.check(arguments)
        arguments.folder.mkdir(parents=True, exist_ok=True)
        with tree.lock(arguments.folder):
            columns = look_at_all(arguments.system, arguments)
        if any(column.rows for column in columns):
            print(results.make_table(columns))
        is_good = all(column.is_good for column in columns)
        if len({column.certificate for column in columns if column.certificate}) > 1:
            say("error: the demos have different certificates")
            is_good = False
    except (tree.Failure, OSError, subprocess.CalledProcessError) as failure:
        fail(f"systems: {failure}")
    except tree.Interrupted as signal:
        return signal.code
    return 0 if is_good else 1


if __name__ == "__main__":
    sys.exit(main())

"""Runs the two commands in clean Debian systems and prints a table: ./sls systems."""

import argparse
import pathlib
import subprocess
import sys
import time

import results
import tree

HERE = pathlib.Path(__file__).resolve().parent
COMMANDS = ("demo", "test", "package")
SYSTEMS = (*tree.CODENAMES, "aarch64")
VERSIONS = {
    "Debian": "cat /etc/debian_version",
    "Fast DDS": "dpkg-query -W -f '${Version}' libfastdds-dev 2>/dev/null || dpkg-query -W -f '${Version}' libfastrtps-dev",
    "g++": "g++ -dumpfullversion",
    "CMake": "cmake --version | sed -n 's/cmake version //p'",
    "Python": "python3 --version | sed 's/Python //'",
}


def say(text):
    print(f"sls: {text}", file=sys.stderr, flush=True)


def parse(words):
    parser = argparse.ArgumentParser(prog="./sls systems", usage="./sls systems [OPTIONS] [SYSTEM…]",
                                     formatter_class=argparse.RawDescriptionHelpFormatter, description="""\
Makes clean Debian systems with debootstrap, copies this checkout into each, runs the two commands in it and prints a
table. aarch64 cross-builds and flies under qemu instead. Needs root. The systems use the network of this machine: do
not fly on it meanwhile. Nothing is mounted outside the systems, and they are deleted, also after Ctrl-C. Exit code 0:
every command ended with 0, and all demos had one certificate.""")
    parser.add_argument("system", nargs="*", metavar="SYSTEM",
                        help=f"{', '.join(SYSTEMS[:-1])} or {SYSTEMS[-1]} (default: {' and '.join(tree.CODENAMES)})")
    parser.add_argument("--commands", default="demo,test", metavar="LIST",
                        help=f"the commands, of {', '.join(COMMANDS)} (default: demo,test)")
    parser.add_argument("--only", metavar="REGEX", help="run only the tests whose names match")
    parser.add_argument("--limit-minutes", type=float, default=180, metavar="X",
                        help="stop the commands of a system after this time (default: 180)")
    parser.add_argument("--need-gib", type=float, metavar="X",
                        help="free disk that each system must find (default: 16 with test, else 8)")
    parser.add_argument("--folder", type=pathlib.Path, default=tree.ROOT / "build/systems", metavar="DIR",
                        help="folder of the systems, their logs and bases (default: build/systems)")
    parser.add_argument("--keep", action="store_true", help="do not delete the systems")
    parser.error = lambda message: fail(f"systems: {message}", 2)
    arguments = parser.parse_args(words)
    arguments.system = list(dict.fromkeys(arguments.system)) or list(tree.CODENAMES)
    arguments.commands = arguments.commands.split(",")
    for name, values, known in (("SYSTEM", arguments.system, SYSTEMS), ("--commands", arguments.commands, COMMANDS)):
        for value in values:
            if value not in known:
                fail(f"systems: {name}: expected one of {', '.join(known)}, got '{value}'", 2)
    if not arguments.limit_minutes > 0:
        fail(f"systems: --limit-minutes: expected > 0, got {arguments.limit_minutes:g}", 2)
    if arguments.need_gib is None:
        arguments.need_gib = 16 if "test" in arguments.commands else 8
    arguments.folder = arguments.folder.absolute()
    return arguments


def fail(text, code=1):
    say(f"error: {text}")
    sys.exit(code)


def run_command(system, name, words, column):
    """Runs ./sls with `words` in the tree; puts how it ended into a row."""
    say(f"{system.system}: ./sls {' '.join(words)} (log: {system.log(name)})")
    ended, start = results.Ended(), time.monotonic()
    try:
        ended.code = system.run(name, "./sls", *words)
    except tree.Failure as failure:
        ended.stopped = str(failure)
        raise
    finally:
        ended.seconds = time.monotonic() - start
        column.is_good &= ended.code == 0
        column.rows[f"./sls {name}"] = str(ended)


def look_at_commands(system, arguments, column):
    """Runs the commands in a tree and reads what they left there."""
    if "demo" in arguments.commands:
        run_command(system, "demo", ["demo"], column)
        column.certificate = results.find_certificate(system.checkout)
        column.rows["certificate"] = column.certificate[:16]
    if "test" in arguments.commands:
        run_command(system, "test", ["test", *(["--only", arguments.only] if arguments.only else [])], column)
        if (file := system.checkout / "build/test.xml").is_file():
            column.tests = results.read_tests(file)
            column.rows["tests"] = str(column.tests)
    if "package" in arguments.commands:
        run_command(system, "package", ["package"], column)
        for file in system.checkout.glob("build/package/*.deb"):
            place = tree.ROOT / "build/package" / file.name
            place.parent.mkdir(parents=True, exist_ok=True)
            place.write_bytes(file.read_bytes())
            column.rows["package"] = str(place.relative_to(tree.ROOT))


def look_at(system, arguments):
    """Makes a tree and runs the commands in it. Returns the column of the table."""
    column = results.Column(system.system)
    try:
        tree.check_disk(arguments.folder, arguments.need_gib)
        say(f"{system.system}: making a clean system in {system.path}")
        start = time.monotonic()
        system.make()
        column.rows["commit"] = system.copy_checkout()
        column.rows["clean system"] = f"{time.monotonic() - start:.0f} s"
        try:
            look_at_commands(system, arguments, column)
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


def look_at_aarch64(arguments):
    """aarch64.py prints its own table. True if it ended with 0."""
    with subprocess.Popen([sys.executable, "-B", HERE / "aarch64.py"]) as process:
        try:
            return process.wait(timeout=arguments.limit_minutes * 60) == 0
        except (subprocess.TimeoutExpired, tree.Interrupted) as error:
            process.terminate()  # it deletes its tree
            if isinstance(error, tree.Interrupted):
                raise
            raise tree.Failure("aarch64: stopped at the limit of time") from None


def main():
    arguments = parse(sys.argv[1:])
    columns, is_good = [], True
    try:
        tree.handle_signals()
        trees = [name for name in arguments.system if name in tree.CODENAMES]
        if trees:
            tree.check_machine()
            arguments.folder.mkdir(parents=True, exist_ok=True)
            with tree.lock(arguments.folder):
                columns = look_at_all(trees, arguments)
            if any(column.rows for column in columns):
                print(results.make_table(columns))
            is_good = all(column.is_good for column in columns)
            if len({column.certificate for column in columns if column.certificate}) > 1:
                say("error: the demos have different certificates")
                is_good = False
        if "aarch64" in arguments.system:
            is_good &= look_at_aarch64(arguments)
    except (tree.Failure, OSError, subprocess.CalledProcessError) as failure:
        fail(f"systems: {failure}")
    except tree.Interrupted as signal:
        return signal.code
    return 0 if is_good else 1


if __name__ == "__main__":
    sys.exit(main())

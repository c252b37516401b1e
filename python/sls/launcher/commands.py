"""The commands of `./sls`."""

import importlib.util
import os
import re
import shutil
import subprocess
from collections.abc import Callable
from typing import NoReturn

from sls import __version__
from sls.launcher import building, completion, flights
from sls.launcher.arguments import POSITIVE, Parser, filled, make_unknown_option, one_of, whole
from sls.launcher.building import (FLYING, PROGRAMS, PYTHON, build_programs, call_script, is_help_asked, replace_by,
                                   replace_by_module, replace_by_program)
from sls.launcher.completion import CONTROLS, FLOWN
from sls.launcher.docker_demo import docker_demo
from sls.launcher.fuzzing import fuzz
from sls.launcher.listing import print_list
from sls.launcher.place import (BUILD, IS_BUILT_ELSEWHERE, IS_INSTALLED, IS_OF_PIP, PYTHON_PATH, ROOT, SELF, STRAY_VARIABLES, Failure,
                                expect_no_folder_of_recordings, find_file, list_choices, say, suggest)

USAGE = """\
usage: ./sls COMMAND [OPTIONS]
       ./sls COMMAND --help     options of a command

Fly
  demo [SCENARIO]         set up, build, fly figure_eight and print a summary
  run SCENARIO            fly a scenario on this machine and record it
  check FILE…             fly scenarios as tests: expectations and verdicts
  view [DIR [DIR]]        show a live flight or recordings in the browser
  ctl COMMAND             pause, step, resume, start, reset or stop a run
  list                    print the scenarios, laws, plants and campaigns
  docker-demo [NAME]      fly in containers

Recordings
  verify A [B]            compare two recordings, or one with its manifest
  convert DIR             write a recording as one MCAP file
  plot DIR…               draw figures of recordings and of published logs
  report DIR              write DIR/report.html: metrics, figures, events
  python [ARGS]           run Python with the package `sls`

Many flights
  campaign FILE           fly one scenario with varied keys
  campaign-worker DIR     fly chunks of a campaign (Slurm starts it)
  study                   repeat the published study, write docs/study.md
  delay-margin SCENARIO   find the delay at which the controller loses the load
  worlds [SCENARIO]       fly simulated worlds with faults, from seeds

Network
  doctor                  find out why data does not flow
  keys DIR                make keys and permissions for config/qos/secure.xml
  discovery-server        serve the clients of config/qos/discovery_server.xml
  network-table           fly each QoS profile through network disturbances

Development
  test                    set up, build and run the tests
  bench                   measure speed, each figure beside its bound
  chaos                   stop, kill and restart processes of flights at random
  fuzz                    feed mutated input to readers of files and samples
  mutants                 make defects in the cores, and see which are found
  reference               write docs/reference
  package                 build a Debian package: build/package/
  systems [NAME…]         run the two commands in clean Debian systems
  setup | build | clean   install packages | build programs | remove them
  help [COMMAND]          this text, or the options of a command

environment: SLS_DOMAIN is the DDS domain of programs without --domain
--version: the version of sls
--no-install with any command: install no Debian packages
exit codes: 0 done; 1 the run or a test failed; 2 bad usage or configuration;
130/143 interrupted
"""
# Commands whose options a program or another Python module reads.
FOREIGN = ("view", "ctl", "verify", "convert", "plot", "report", "study", "campaign", "campaign-worker", "doctor",
           "bench", "worlds", "check", "network-table", "chaos", "mutants", "reference", "systems")
SOURCE_COMMANDS = ("bench", "build", "chaos", "clean", "docker-demo", "fuzz", "mutants", "network-table",
                   "package", "reference", "setup", "study", "systems", "test")


def set_up(words: list[str]) -> int:
    Parser("setup", "", "Installs the packages that building and flying need.").parse(words)
    call_script("@setup")
    return 0


def build(words: list[str]) -> int:
    Parser("build", "", "Sets up and builds; the programs are in build/bin.").parse(words)
    try:
        import yaml  # noqa: F401
        has_yaml = True
    except Exception:  # missing or broken: then no man page can be made
        has_yaml = False
    build_programs(*PROGRAMS, "_sls_core", *(["man_pages"] if has_yaml else []))
    say(f"programs in build/bin: {' '.join(PROGRAMS)}; the module of the package sls in build/python"
        + (", the man pages in build/man" if has_yaml else ""))
    return 0


def start(program: str, folder: str = "bin") -> Callable[[list[str]], int]:
    """A command that takes the options of a program and becomes this program."""
    return lambda words: replace_by_program(program, words, folder)


def delay_margin(words: list[str]) -> NoReturn:
    parser = Parser("delay-margin", "SCENARIO [--period-s X] [--vehicle N]",
                    "Finds the command delay at which the controllers lose the load; prints a table.")
    parser.add_argument("--period-s", type=POSITIVE, metavar="X", help="control period (default: the scenario's)")
    parser.add_argument("--vehicle", type=whole(0, 255), metavar="N",
                        help="delay the commands of vehicle N alone (default: of all)")
    options, scenario = parser.parse_scenario(words)
    replace_by_program("delay_margin", [f"--scenario={scenario}", *flights.pass_on(options, "period_s", "vehicle")])


def worlds(words: list[str]) -> NoReturn:
    # A first word without a dash is the scenario; the options are the program's.
    if words and not words[0].startswith("-"):
        words = ["--scenario", find_file("scenarios", words[0]), *words[1:]]
    if any(word.split("=")[0] == "--plot" for word in words):
        run_module(words, ["sls_worlds"], "sls.worlds_plot", SLS_WORLDS=str(BUILD / "bin/sls_worlds"))
    replace_by_program("sls_worlds", words)


def bench(words: list[str]) -> NoReturn:
    if not is_help_asked(words):
        if not IS_BUILT_ELSEWHERE:
            call_script("@setup", "bench_packages")
        build_programs(*FLYING, "sls_bench_probe", "sls_microbench", "slow_clock")
    replace_by_module("bench", "--build", BUILD, *words, paths=[str(ROOT), *PYTHON_PATH])


def python(words: list[str]) -> NoReturn:
    if is_help_asked(words[:1]):  # the others are the script's
        Parser("python", "[ARGS]", "Runs Debian's Python with the package `sls`. ARGS: a script, -m MODULE,\n"
                                   "-c COMMAND, or none for a prompt.").parse(["--help"])
    call_script("@install", "python_packages")
    build_programs("_sls_core")
    more = [os.environ["PYTHONPATH"]] if os.environ.get("PYTHONPATH") else []
    replace_by(PYTHON, "-B", *words, PYTHONPATH=":".join([*PYTHON_PATH, *more]))


def run_module(words: list[str], targets: list[str], *command: str, **variables: str) -> NoReturn:
    """Builds the targets unless help is asked for, and becomes a module of the package."""
    if targets and not is_help_asked(words):
        build_programs(*targets)
    call_script("@install", "python_packages")
    if IS_OF_PIP and not importlib.util.find_spec("matplotlib"):
        raise Failure("this needs packages that are not installed: pip install scipy matplotlib")
    replace_by_module(*command, *words, **variables)


def plot(words: list[str]) -> NoReturn:
    run_module(words, ["_sls_core"], "sls", "plot")


def report(words: list[str]) -> NoReturn:
    # The program draws the report's scene.
    run_module(words, ["sls_view", "_sls_core"], "sls", "report", SLS_VIEW=str(BUILD / "bin/sls_view"))


def study(words: list[str]) -> NoReturn:
    # The flights of the study fly side by side and must not build.
    targets = ["_sls_core"] if "--reuse" in words else [*FLYING, "delay_margin", "_sls_core"]
    run_module(words, targets, "sls", "study", SLS_BUILD=str(BUILD))


def campaign(words: list[str]) -> NoReturn:
    targets = [] if words[:1] and words[0] in FLOWN else ["_sls_core"]
    if any(word.startswith("--verify") for word in words):
        targets += [*FLYING, "sls_verify"]
    run_module(words, targets, "sls.campaign", SLS_BUILD=str(BUILD))  # flights over DDS must not build


def campaign_worker(words: list[str]) -> NoReturn:
    run_module(words, ["_sls_core"], "sls.campaign.worker", SLS_BUILD=str(BUILD))


def check(words: list[str]) -> NoReturn:
    is_judging = any(word.startswith("--recording") for word in words)
    has_pages = any(word.startswith("--report") for word in words)
    try:
        if not is_help_asked(words):
            build_programs("_sls_core", *([] if is_judging else [*FLYING, "sls_worlds"]), *["sls_view"] * has_pages)
        call_script("@install", "python_packages")
    except SystemExit as error:
        from sls.check.results import refuse  # the launcher alone need not load it
        text = "expected programs that can be built, got the errors above"
        raise error if error.code in (130, 143) else SystemExit(refuse(words, text)) from None
    replace_by_module("sls.check", *words, SLS_BUILD=str(BUILD), SLS_VIEW=str(BUILD / "bin/sls_view"))


def keys(words: list[str]) -> NoReturn:
    if not shutil.which("openssl"):
        call_script("@setup")
    replace_by(ROOT / "config/security/keys.sh", *words)


def discovery_server(words: list[str]) -> NoReturn:
    parser = Parser("discovery-server", "[--listen ADDRESS] [--port N]",
                    "Runs a discovery server for config/qos/discovery_server.xml until it is stopped.")
    parser.add_argument("--listen", metavar="ADDRESS",
                        help="address to listen on (default: every address of this machine)")
    parser.add_argument("--port", type=whole(1, 65535), metavar="N", default="11811",
                        help="UDP port (default: 11811)")
    options, _ = parser.parse(words)
    if not shutil.which("fast-discovery-server"):
        call_script("@setup", "fastdds-tools")
    say(f"discovery server on port {options.port}; clients: "
        f"SLS_DISCOVERY_SERVER={options.listen or 'this machine'}")
    # Since Fast DDS 3.2 the program wants the number by which `fastdds discovery` asks for a server.
    asked = subprocess.run(["fast-discovery-server", "-v"], capture_output=True, text=True, check=False)
    number = ["42"] if "Invalid command index" in asked.stderr else []
    # Number 0 has the identity that discovery_server.xml expects.
    listen = ["-l", options.listen] if options.listen else []
    replace_by("fast-discovery-server", *number, "-i", "0", *listen, "-p", options.port)


def network_table(words: list[str]) -> NoReturn:
    if not IS_BUILT_ELSEWHERE and not is_help_asked(words):
        call_script("@setup", "test_packages")
    replace_by_program("network_table", words, "tests")


def test(words: list[str]) -> NoReturn:
    parser = Parser("test", "[--slow | --sanitize KIND] [--only REGEX]",
                    "Sets up, builds and runs the tests, the unit suites with AddressSanitizer.\n"
                    "build/test.xml has the output of each.")
    parser.add_argument("--slow", action="store_true",
                        help="also run the tests that take minutes; they need an idle machine")
    parser.add_argument("--sanitize", type=one_of("address", "thread"), metavar="KIND",
                        help="address: run only the unit suites; thread: those with several threads, built with "
                             "ThreadSanitizer")
    parser.add_argument("--only", type=filled("pattern"), metavar="REGEX",
                        help="run only the tests whose names match")
    options, _ = parser.parse(words)
    preset = {None: "release", "address": "asan", "thread": "tsan"}[options.sanitize]
    folder = BUILD if preset == "release" else ROOT / f"build-{preset}"
    which = ["--tests-regex", options.only] if options.only else []
    if preset == "tsan":
        which += ["--label-regex", "threaded"]
    elif not options.slow:
        which += ["--label-exclude", "slow"]
    call_script("@setup", "test_packages", "python_packages", "bench_packages", "package_packages",
                *([] if preset == "tsan" else ["fuzz_packages"]))
    call_script("@npm", ROOT / "tests/tools/view")
    if preset != "tsan":  # the unit suites, which run with those of `build`: tests/CMakeLists.txt
        call_script("@tree", "asan", ROOT / "build-asan", "test_programs")
    if preset != "asan":
        call_script("@tree", preset, folder, *(["threaded_tests"] if preset == "tsan" else []))
    hidden = [f"--unset={name}" for name in STRAY_VARIABLES]
    # Most tests wait for processes and discovery: two more than there are cores leave none idle.
    os.chdir(ROOT)
    replace_by("env", *hidden, "ctest", "--preset", preset, "--parallel", str(len(os.sched_getaffinity(0)) + 2),
               "--output-junit", folder / "test.xml", *which)


def reference(words: list[str]) -> NoReturn:
    if not is_help_asked(words):
        call_script("@install", "python_packages")
        build_programs(*PROGRAMS, "_sls_core", "sls_scenario_keys", "network_table", "chaos")
    replace_by(PYTHON, "-B", ROOT / "tools/reference", "--build", BUILD, *words)


def mutants(words: list[str]) -> NoReturn:
    if not is_help_asked(words):
        call_script("@setup", "test_packages")
    replace_by(PYTHON, "-B", ROOT / "tests/worlds/mutants.py", *words)


def systems(words: list[str]) -> NoReturn:
    if "aarch64" in words and not is_help_asked(words):
        call_script("@install", "python_packages")
        build_programs(*FLYING)  # the other side of its flights
    replace_by(PYTHON, "-B", ROOT / "tools/systems", *words)


def package(words: list[str]) -> int:
    parser = Parser("package", "[--system NAME]",
                    "Builds a Debian package of all that a user needs:\nbuild/package/sls_VERSION_ARCHITECTURE.deb. "
                    "The version ends with the name\nof the system, such as debian12.")
    parser.add_argument("--system", metavar="NAME", help="build it in a clean tree of another system, debian12 "
                        "or debian13, as ./sls systems does")
    options, _ = parser.parse(words)
    if options.system is not None:
        systems(["--commands", "package", "--", options.system])
    call_script("@setup", "package_packages")
    call_script("@tree", "release", BUILD, "package_contents")
    log = BUILD / "package.log"
    is_made, text = building.run_logged(log, "cpack", "--config", BUILD / "CPackConfig.cmake", "-B", BUILD / "package")
    if not is_made:
        raise Failure(f"cpack failed (whole log: {log})")
    made = re.search(r"^CPack: - package: (.*) generated\.$", text, re.MULTILINE)
    say(f"package: {made[1] if made else ''}")
    return 0


def clean(words: list[str]) -> int:
    Parser("clean", "", "Removes the folders build and build-*.").parse(words)
    for folder in (ROOT / "build", *ROOT.glob("build-*")):
        shutil.rmtree(folder, ignore_errors=True)
    return 0


def show_help(words: list[str]) -> int:
    if not words or is_help_asked(words):
        print(USAGE.replace("./sls", SELF), end="")
        return 0
    return call(words[0], ["--help"])


COMMANDS: dict[str, Callable[[list[str]], int]] = {
    "setup": set_up, "build": build, "run": flights.run, "demo": flights.demo, "list": print_list,
    "view": start("sls_view"), "ctl": start("sim_ctl"), "delay-margin": delay_margin, "worlds": worlds, "bench": bench,
    "verify": start("sls_verify"), "convert": start("sls_convert"), "python": python, "plot": plot, "report": report,
    "study": study, "check": check, "campaign": campaign, "campaign-worker": campaign_worker, "doctor": start("sls_doctor"),
    "keys": keys, "docker-demo": docker_demo, "discovery-server": discovery_server, "network-table": network_table,
    "fuzz": fuzz, "chaos": start("chaos", "tests"), "mutants": mutants, "test": test, "reference": reference,
    "systems": systems, "package": package, "clean": clean, "help": show_help,
}


def check_words(command: str, words: list[str]) -> None:
    """Judges options, subcommands and names by the tables of the completion, before anything is built.

    Commands without a table, and an installed launcher, which builds nothing, leave it to the program; so does `check`,
    which writes a JUnit file for these mistakes, too."""
    if command not in FOREIGN or command == "check" or is_help_asked(words) or IS_INSTALLED:
        return
    known, others, takes_value = completion.read_options(command), [], False
    if not known:
        return
    for word in words:
        if word == "--":
            break
        name = word.partition("=")[0]
        if takes_value:
            takes_value = False
        elif not word.startswith("--"):
            others.append(word)
        elif not any(option.startswith(name) for option in known):
            raise make_unknown_option(command, word, known)
        else:
            takes_value = bool(known.get(word, ("",))[0])
    if command == "ctl" and others and others[0] not in CONTROLS:
        raise Failure(f"ctl: expected {list_choices(CONTROLS)}, got '{others[0]}'{suggest(others[0], CONTROLS)}", 2)
    for name in others if command in ("convert", "plot", "report", "verify", "view") else ():
        expect_no_folder_of_recordings(name)
    if command == "campaign" and len(others) == 1:
        find_file("campaigns", others[0])


def call(command: str, words: list[str]) -> int:
    if command not in COMMANDS:
        raise Failure(f"unknown command '{command}'{suggest(command, COMMANDS)} (see ./sls help)", 2)
    if IS_INSTALLED and command in SOURCE_COMMANDS:
        raise Failure(f"{command}: needs the source tree; this sls is installed without it", 2)
    check_words(command, words)
    return COMMANDS[command](words)


def main(words: list[str]) -> int:
    """Runs the command and returns its exit code."""
    if words[:1] == ["--no-install"]:
        building.is_installing, words = False, words[1:]
    command, words = (words[0], words[1:]) if words else ("help", [])
    if command != "python" and "--no-install" in words:  # the options of python are the script's
        building.is_installing = False
        words = [word for word in words if word != "--no-install"]
    if command == "@complete" and words:
        kind, names = completion.complete(words, COMMANDS)
        print(kind, *names, sep="\n")
        return 0
    if command == "--version":
        print(f"sls {__version__}")
        return 0
    try:
        return call("help" if command in ("--help", "-h") else command, words)
    except Failure as failure:
        say(f"error: {failure}")
        return failure.code

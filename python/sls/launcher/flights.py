"""`./sls run` and `./sls demo`: options of a flight, its programs, its summary."""

import csv
import errno
import json
import os
import re
import socket
import subprocess
import time
from argparse import ArgumentTypeError, Namespace
from pathlib import Path

from sls.launcher.arguments import POSITIVE, Parser, checked, filled, one_of, whole
from sls.launcher.building import FLYING, PYTHON, build_programs
from sls.launcher.building import run as run_program
from sls.launcher.place import BUILD, PACKAGE, PYTHON_PATH, ROOT, SELF, Failure, say, show
from sls.launcher.supervision import WRITERS_PATIENCE_S, Supervisor

DOMAIN = whole(0, 232)


def make_parser(command: str, usage: str, text: str) -> Parser:
    parser = Parser(command, usage, text + "\n\nSCENARIO is a name in config/scenarios or a path.")
    add = parser.add_argument
    add("--out", type=filled("folder"), metavar="DIR",
        help="folder of the recording (default: recordings/NAME-UTCTIME)")
    add("--force", action="store_true", help="replace an existing recording")
    add("--qos", type=filled("file"), metavar="FILE", help="QoS profiles (default: config/qos/default.xml)")
    add("--domain", type=DOMAIN, metavar="N", help="DDS domain, 0 to 232 (default: 0)")
    add("--period-s", type=POSITIVE, metavar="X", help="control period (default: the scenario's)")
    add("--mode", type=one_of("lockstep", "realtime"), metavar="MODE",
        help="lockstep or realtime (default: the scenario's)")
    add("--rtf", type=checked("a number > 0 and <= 1000", float, lambda factor: 0 < factor <= 1000), metavar="X",
        help="real-time factor, realtime mode only (default: the scenario's)")
    add("--in-process", action="store_true", help="fly in one process without DDS: same data, same certificate")
    add("--view", action="store_true",
        help="also show the flight in the browser; prints the address of the page")
    add("--view-port", type=whole(0, 65535), metavar="N",
        help="like --view, on port N; 0: any free port (default: 8765)")
    return parser


def pass_on(options: Namespace, *names: str) -> list[str]:
    """The given ones of these options, for a program."""
    return [f"--{name.replace('_', '-')}={value}" for name in names
            if (value := getattr(options, name)) is not None]


def prepare(options: Namespace) -> None:
    """Checks the options that need no program, then builds the programs."""
    if options.view and options.view_port is None:
        options.view_port = "8765"
    if options.in_process:
        if pass_on(options, "qos", "domain", "mode", "rtf", "view_port"):
            raise Failure("--in-process: expected no --qos, --domain, --mode, --rtf or --view with "
                          "it: one process has no network and no clock", 2)
    elif options.domain is None:
        try:
            DOMAIN(os.environ.get("SLS_DOMAIN") or "0")
        except ArgumentTypeError as error:
            raise Failure(f"SLS_DOMAIN: {error}", 2) from None
    if options.view_port is not None:
        check_port(options.view_port)
    if options.out is None:
        if not os.access("recordings" if os.path.exists("recordings") else ".", os.W_OK) or os.path.isfile("recordings"):
            raise Failure("recordings: expected a folder to write in, got none here (--out DIR names another)", 2)
    programs = [*FLYING, *([] if options.view_port is None else ["sls_view"])]
    build_programs(*(["flight"] if options.view_port is None else programs))
    for program in programs:
        if not os.access(BUILD / "bin" / program, os.X_OK):
            raise Failure(f"{BUILD}/bin/{program}: expected a program, got no such file")


def check_port(port: str) -> None:
    """Opens the viewer's port for a moment: without its page the flight is not what was asked for."""
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind(("127.0.0.1", int(port)))
            probe.listen()
        except OSError as error:
            reason = "another program uses it" if error.errno == errno.EADDRINUSE else error.strerror
            raise Failure(f"port of the page: expected a free one, got {port}: {reason} (--view-port 0 takes any "
                          "free one)", 2) from None


def fly(options: Namespace, file: str) -> tuple[int, str]:
    """Flies; returns the exit code and the folder of the recording."""
    name = Path(file).name.removesuffix(".yaml")
    recording = options.out or f"recordings/{name}-{time.strftime('%Y%m%dT%H%M%SZ', time.gmtime())}"
    scenario = f"--scenario={file}"
    out = [f"--out={recording}", *(["--force"] if options.force else [])]
    network = pass_on(options, "qos", "domain")
    flight = {"recorder": [*out, *network],
              "sim_server": [scenario, *network, *pass_on(options, "period_s", "mode", "rtf")],
              "control_client": [scenario, *network]}
    if options.in_process:
        flight = {"closed_loop": [scenario, *out, *pass_on(options, "period_s")]}
    else:  # Checks first, so that a mistake gives one error line and not one from each program.
        for name in ("sim_server", "recorder"):
            run_program(BUILD / "bin" / name, "--check", *flight[name], stdout=subprocess.DEVNULL)
    with Supervisor() as supervisor:
        if options.view_port is not None:
            supervisor.start_beside("sls_view", [BUILD / "bin/sls_view", f"--port={options.view_port}",
                                                 f"--recording={recording}", *network])
        for name, words in flight.items():
            patience = [WRITERS_PATIENCE_S] if name in ("recorder", "closed_loop") else []
            supervisor.start(name, [BUILD / "bin" / name, *words], *patience)
        return supervisor.wait_all(), recording


def print_json(code: int, recording: str) -> None:
    """Prints the parts of the manifest that are not about files or the machine."""
    try:
        manifest = json.loads((Path(recording) / "manifest.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        manifest = {}
    names = ("scenario", "complete", "outcome", "reason", "last_step", "period_s", "mode", "timing", "vehicle_ids",
             "certificate", "run_id")
    print(json.dumps({"exit_code": code, "recording": recording, **{name: manifest.get(name) for name in names}}))


def run(words: list[str]) -> int:
    parser = make_parser("run", "SCENARIO [OPTIONS]", """\
Runs server, client and recorder on this machine. Exit code 0: the mission
finished and the recording is complete.""")
    parser.add_argument("--json", action="store_true",
                        help="print a summary for machines on stdout: one line of JSON")
    options, scenario = parser.parse_scenario(words)
    prepare(options)
    code, recording = fly(options, scenario)
    if options.json:
        print_json(code, recording)
    if code == 0:
        say(f"recording: {recording}")
    return code


def demo(words: list[str]) -> int:
    options, scenario = make_parser("demo", "[SCENARIO] [OPTIONS]", """\
Sets up, builds, flies a scenario (default: figure_eight) and prints a summary.""").parse_scenario(
        words, "figure_eight")
    prepare(options)
    say(f"flying {Path(scenario).name.removesuffix('.yaml')}")
    code, recording = fly(options, scenario)
    if code == 0:
        print_summary(Path(recording))
        if not pass_on(options, "period_s", "mode", "rtf"):
            code = print_verdict(Path(scenario), recording)
    return code


def print_verdict(scenario: Path, recording: str) -> int:
    """Judges the flight by the check of a shipped scenario. The flight alone needs neither the module of the package nor
    numpy or yaml: where one is missing or broken, a line says so and the exit code stays that of the flight."""
    check = ROOT / f"config/checks/{scenario.name}"
    if scenario.resolve() != ROOT / "config/scenarios" / scenario.name or not check.is_file():
        return 0
    path = {"PYTHONPATH": ":".join(PYTHON_PATH)} if PYTHON_PATH else {}
    done = subprocess.run([PYTHON, "-BP", "-m", "sls.check", check, "--recording", recording], check=False, text=True,
                          capture_output=True, env={**os.environ, **path})
    if done.returncode not in (0, 1) or not done.stdout:  # Python ends with 1 after an exception, too
        errors = re.findall(rf"^(?:sls: error|{re.escape(check.stem)}|[\w.]*(?:Error|Exception)): (.+)",
                            done.stdout + done.stderr, re.MULTILINE)
        reason = errors[-1] if errors else f"Python ended with {done.returncode}"
        say(f"no verdict on this flight ({reason}); later: {SELF} check {check.stem} --recording {recording}")
        return 0
    print(f"\n{done.stdout}", end="")
    return done.returncode


def print_comparison(lap: list[str]) -> None:
    """The errors of the second lap beside the published figures of the same figure eight."""
    print("Load position error on the second lap, beside the published figures (m)")
    with open(PACKAGE / "published_lap_2.csv", encoding="utf-8", newline="") as table:
        head, *rows = csv.reader(table)
    for cells in (["", *head[1:]], ["this flight", *(f"{float(error):.1e}" for error in lap)], *rows):
        print("  {:<34}{:>8} {:>8} {:>8} {:>8} {:>8}".format(*cells))
    print()


def print_summary(recording: Path) -> None:
    text = (recording / "flight.txt").read_text(encoding="utf-8")
    show(f"\n{text}")
    rows = [line.split() for line in text.splitlines()]
    lap = next((row[2:7] for row in rows if row[:2] == ["lap", "2"] and row[2] != "(part)"), None)
    if lap and rows[0][:1] == ["figure_eight:"]:
        print_comparison(lap)
    print(f"Files in {recording}")
    for file in sorted(recording.iterdir()):
        if file.is_file():
            show(f"  {file.name:<16} {file.stat().st_size:>10} bytes")

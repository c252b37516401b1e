"""`./sls run` and `./sls demo`: options of a flight, its programs, its summary."""

import csv
import subprocess
import time
from argparse import Namespace
from pathlib import Path

from sls.launcher.arguments import Parser
from sls.launcher.building import FLYING, build_programs
from sls.launcher.place import BUILD, ROOT, SELF, Failure, find_scenario, say
from sls.launcher.supervision import WRITERS_PATIENCE_S, Supervisor

TIMING = ("--period-s", "--mode", "--rtf")


def make_parser(command: str, usage: str, text: str) -> Parser:
    parser = Parser(command, usage, text + "\n\nSCENARIO is a name in config/scenarios or a path.")
    add = parser.add_argument
    add("--out", metavar="DIR", help="folder of the recording (default: recordings/NAME-UTCTIME)")
    add("--force", action="store_true", help="replace an existing recording")
    add("--qos", metavar="FILE", help="QoS profiles (default: config/qos/default.xml)")
    add("--domain", metavar="N", help="DDS domain, 0 to 232 (default: 0)")
    add("--period-s", metavar="X", help="control period (default: the scenario's)")
    add("--mode", metavar="MODE", help="lockstep or realtime (default: the scenario's)")
    add("--rtf", metavar="X", help="real-time factor, realtime mode only (default: the scenario's)")
    add("--in-process", action="store_true",
        help="fly in one process without DDS: same data, same certificate")
    add("--view", action="store_true",
        help="also show the flight in the browser; prints the address of the page")
    add("--view-port", metavar="N", help="like --view, on port N; 0: any free port (default: 8765)")
    return parser


def pass_on(options: Namespace, *names: str) -> list[str]:
    """The given ones of these options, for a program."""
    values = [(name, getattr(options, name[2:].replace("-", "_"))) for name in names]
    return [word for name, value in values if value is not None for word in (name, value)]


def build_for_flight(options: Namespace) -> None:
    viewer = ["sls_view"] if options.view or options.view_port is not None else []
    build_programs(*FLYING, *viewer)


def fly(options: Namespace, scenario: str) -> tuple[int, str]:
    """Flies; returns the exit code and the folder of the recording."""
    file = find_scenario(scenario)
    name = Path(file).name.removesuffix(".yaml")
    recording = options.out or f"recordings/{name}-{time.strftime('%Y%m%dT%H%M%SZ', time.gmtime())}"
    out = ["--out", recording, *(["--force"] if options.force else [])]
    network = pass_on(options, "--qos", "--domain")
    with Supervisor() as supervisor:
        if options.in_process:
            if network or options.view or pass_on(options, "--view-port", "--mode", "--rtf"):
                raise Failure("--in-process: expected no --qos, --domain, --mode, --rtf or --view with "
                              "it: one process has no network and no clock", 2)
            supervisor.start("closed_loop", [BUILD / "bin/closed_loop", "--scenario", file, *out,
                                             *pass_on(options, "--period-s")], WRITERS_PATIENCE_S)
            return supervisor.wait_all(), recording

        server = ["--scenario", file, *network, *pass_on(options, *TIMING)]
        recorder = [*out, *network]
        # Checks first, so that a mistake gives one error line and not one from each program.
        check("sim_server", *server)
        check("recorder", *recorder)
        if options.view or options.view_port is not None:
            port = "8765" if options.view_port is None else options.view_port
            supervisor.start_beside("sls_view", [BUILD / "bin/sls_view", "--port", port, *network])
        supervisor.start("recorder", [BUILD / "bin/recorder", *recorder], WRITERS_PATIENCE_S)
        supervisor.start("sim_server", [BUILD / "bin/sim_server", *server])
        supervisor.start("control_client",
                         [BUILD / "bin/control_client", "--scenario", file, *network])
        return supervisor.wait_all(), recording


def check(program: str, *words: str) -> None:
    done = subprocess.run([BUILD / "bin" / program, "--check", *words], check=False,
                          stdout=subprocess.DEVNULL)
    if done.returncode != 0:
        raise SystemExit(done.returncode if done.returncode > 0 else 128 - done.returncode)


def run(words: list[str]) -> int:
    options, scenario = make_parser("run", "SCENARIO [OPTIONS]", """\
Runs server, client and recorder on this machine. Exit code 0: the mission finished and the
recording is complete.""").parse_scenario(words)
    build_for_flight(options)
    code, recording = fly(options, scenario)
    if code == 0:
        say(f"recording: {recording}")
    return code


def demo(words: list[str]) -> int:
    options, scenario = make_parser("demo", "[SCENARIO] [OPTIONS]", """\
Sets up, builds, flies a scenario (default: figure_eight) and prints a summary.""").parse_scenario(
        words, "figure_eight")
    build_for_flight(options)
    say(f"flying {scenario}")
    code, recording = fly(options, scenario)
    if code == 0:
        print_summary(Path(recording))
    return code


def print_comparison(lap: list[str]) -> None:
    """The errors of the second lap beside the published figures of the same figure eight."""
    print("Load position error on the second lap, beside the published figures (m)")
    with open(ROOT / "python/sls/published_lap_2.csv", encoding="utf-8", newline="") as table:
        head, *rows = csv.reader(table)
    for cells in (["", *head[1:]], ["this flight", *lap], *rows):
        print("  {:<34} {:>9} {:>9} {:>9}  {:>9} {:>9}".format(*cells))
    print()


def print_summary(recording: Path) -> None:
    text = (recording / "flight.txt").read_text(encoding="utf-8")
    print(f"\n{text}")
    rows = [line.split() for line in text.splitlines()]
    lap = next((row[2:7] for row in rows if row[:2] == ["lap", "2"] and row[2] != "(part)"), None)
    if lap and rows[0][:1] == ["figure_eight:"]:
        print_comparison(lap)
    print(f"Files in {recording}")
    for file in sorted(recording.iterdir()):
        if file.is_file():
            print(f"  {file.name:<16} {file.stat().st_size:>10} bytes")

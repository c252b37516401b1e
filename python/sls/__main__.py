"""Command lines of `./sls plot`, `./sls report` and `./sls study`. That of `./sls campaign` is in
campaign/cli.py."""

import argparse
import os
import re
import signal
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

if __name__ == "__main__":  # before the other imports
    signal.signal(signal.SIGINT, lambda *_: (os.write(2, b"sls: interrupted\n"), os._exit(130)))

from sls.campaign.arguments import Parser
from sls.errors import ConfigError, RunError
from sls.input_error import InputError
from sls.launcher.place import PACKAGE, say

if TYPE_CHECKING:  # numpy and matplotlib are loaded once the arguments are judged
    from sls.recordings import Recording
    from sls.trajectory import Trajectory


def make_folder(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"--out {folder}: expected a folder, got: {error.strerror}") from None


def load_recording(recording: "Recording", name: str | None, vehicle_id: int) -> "Trajectory":
    """Loads the flight of one vehicle, and prints the notes on it, such as missing samples."""
    flight = recording.load_flight(vehicle_id, name or recording.folder.resolve().name)
    for note in flight.notes:
        say(f"{recording.folder}: {note}")
    return flight


def plot(options: argparse.Namespace) -> None:
    from sls.figures import PAPER, STYLE, make_figures, save
    from sls.published_logs import load_log
    from sls.recordings import Recording
    names = options.name or [None] * len(options.source)
    if len(names) != len(options.source):
        raise InputError(f"--name: expected {len(options.source)} names, one for each source, "
                         f"got {len(names)}")
    flights, fleet, out = [], [], options.out or Path("figures")
    for source, name in zip(options.source, names):
        if not source.is_dir():
            flights.append(load_log(source, name or source.stem, options.format,
                                    options.rod_length_m))
            continue
        recording = Recording(source)
        flights.append(load_recording(recording, name, options.vehicle))
        if len(names) == 1:
            fleet = recording.load_fleet() if len(recording.vehicle_ids) > 1 else []
            out = options.out or source / "figures"
    figures = make_figures(flights, fleet, options.paper, dict(options.panels) if options.panels else None)
    if not figures:
        raise InputError(f"{options.source[0]}: expected a flight of two states or more, got one that ended "
                         "at its first")
    make_folder(out)
    for name, figure in figures.items():
        for kind in ("pdf",) if options.paper else ("png", "pdf"):
            file = out / f"{name}.{kind}"
            try:
                save(figure, file, style=PAPER if options.paper else STYLE)
            except OSError as error:
                raise InputError(f"{file}: expected to write it, got: {error.strerror}") from None
    say(f"figures: {out}")


def read_panels(text: str) -> tuple[str, list[int]]:
    """The figure and the panels of `errors:1,3`; of `errors` no panels, which means all."""
    name, _, numbers = text.partition(":")
    if not re.fullmatch(r"\w+(:\d+(,\d+)*)?", text, re.ASCII):
        raise argparse.ArgumentTypeError(f"expected NAME or NAME:N,…, got '{text}'")
    return name, [int(number) for number in numbers.split(",") if number]


def read_paper(text: str) -> float:
    if not re.fullmatch(r"[1-4](\.\d+)?|0\.[5-9]\d*", text) or float(text) > 4:
        raise argparse.ArgumentTypeError(f"expected 0.5 to 4 columns, got '{text}'")
    return float(text)


def report(options: argparse.Namespace) -> None:
    if not options.recording.is_dir():
        raise InputError(f"{options.recording}: expected a recording, got no such folder")
    from sls.recordings import Recording
    from sls.report import make_report
    page = make_report(Recording(options.recording), options.vehicle)
    file = options.recording / "report.html"
    if file.exists() and not file.is_file():  # a pipe would wait for a reader
        raise InputError(f"{file}: expected a file or none, got another kind")
    try:
        file.write_text(page, encoding="utf-8", errors="replace")
    except OSError as error:
        raise InputError(f"{file}: expected to write it, got: {error.strerror}") from None
    say(f"report: {file}")


def run_study(options: argparse.Namespace) -> None:
    from sls import study
    make_folder(options.out)
    if not options.reuse:
        study.fly_all(options.recordings, say)
    page = study.write_study(options.recordings, options.out)
    say(f"study: {page}")


def add_vehicle(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--vehicle", type=int, default=0, metavar="N",
                        help="vehicle of a fleet (default: 0)")


def make_parser() -> argparse.ArgumentParser:
    parser = Parser(prog="./sls")
    commands = parser.add_subparsers(dest="command", required=True)

    plotting = commands.add_parser("plot", description="Draws figures of recordings and published logs, overlaid: PNG "
                                                   "and PDF.")
    plotting.add_argument("source", nargs="+", type=Path, metavar="DIR",
                          help="a recording's folder, or the file of a published log")
    plotting.add_argument("--out", type=Path, metavar="DIR",
                          help="folder for the figures (default: DIR/figures for one recording, "
                               "else figures)")
    plotting.add_argument("--name", nargs="+", help="name of each source in the figures "
                                                    "(default: its folder or file)")
    add_vehicle(plotting)
    plotting.add_argument("--format", choices=("matlab-setpoint", "matlab-trajectory", "gazebo", "px4"),
                          help="format of the published logs (default: detected from their columns)")
    plotting.add_argument("--rod-length-m", type=float, metavar="L",
                          help="rod length for published logs without the load's position "
                               "(default: gazebo 1.1, px4 1)")
    plotting.add_argument("--panels", nargs="+", type=read_panels, metavar="NAME[:N,…]",
                          help="figures to draw, such as positions errors:2,4,6, with the panels of these numbers, row "
                               "by row from 1 (default: all)")
    plotting.add_argument("--paper", type=read_paper, metavar="COLUMNS",
                          help="figures for papers: PDF only, no title, as wide as 0.5 to 4 columns of 3.5 in")
    plotting.set_defaults(run=plot)

    reporting = commands.add_parser("report", description="Writes DIR/report.html, one self-contained page: parameters, metrics "
                                                      "of each stage, figures and events.")
    reporting.add_argument("recording", type=Path, metavar="DIR", help="a recording's folder")
    add_vehicle(reporting)
    reporting.set_defaults(run=report)

    studying = commands.add_parser("study", description="Flies the published comparison; writes docs/study.md and its "
                                                    "pictures.")
    studying.add_argument("--out", type=Path, default=PACKAGE.parents[1] / "docs", metavar="DIR",
                          help="folder for study.md and its pictures (default: docs)")
    studying.add_argument("--recordings", type=Path, default=Path("recordings/study"),
                          metavar="DIR", help="folder for the recordings (default: recordings/study)")
    studying.add_argument("--reuse", action="store_true",
                          help="use existing complete recordings instead of flying")
    studying.set_defaults(run=run_study)
    return parser


def main(arguments: Sequence[str]) -> int:
    """Runs the command and returns the exit code."""
    if arguments and arguments[0] == "campaign":
        from sls.campaign.cli import main as fly_campaign
        return fly_campaign(arguments[1:])
    try:
        options = make_parser().parse_args(arguments)
        options.run(options)
    except (ConfigError, ImportError, RunError) as error:
        say(f"error: {error}")
        return 1 if isinstance(error, RunError) else 2
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

"""Command lines of `./sls campaign`."""

import argparse
import shlex
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import Any

from sls.campaign.arguments import Ended, Parser, catch_end_signals, parse_range, to_count
from sls.campaign.engines import ENGINES, EngineError, EngineOptions, load_engine
from sls.campaign.folder import CampaignFolder, opened
from sls.errors import ConfigError, RunError
from sls.input_error import InputError
from sls.launcher.place import printing, say, show
from sls.scenario import ROOT

MOST_CHUNKS = 10_000  # files in a folder
LEAST_CHUNKS = 16     # with fewer chunks, workers would end at very different times
DESCRIPTIONS = {"status": "Prints chunks, rate and outcomes of a campaign so far.",
                "report": "Writes DIR/report.html again.",
                "compare": "Compares two campaigns run by run."}
OTHER_COMMANDS = """commands for flown campaigns:
  ./sls campaign status DIR    print chunks, rate and outcomes so far
  ./sls campaign report DIR    write DIR/report.html again
  ./sls campaign compare A B   compare two campaigns run by run"""


# --- flying ---------------------------------------------------------------------------------------


def make_parser() -> argparse.ArgumentParser:
    parser = Parser(prog="./sls campaign", formatter_class=argparse.RawDescriptionHelpFormatter,
                    description="Flies a campaign: many runs of one scenario in which keys vary. Writes\n"
                                "DIR/runs.csv and DIR/report.html.", epilog=OTHER_COMMANDS)
    parser.add_argument("file", metavar="FILE",
                        help="a campaign file, or a name in config/campaigns")
    parser.add_argument("--out", type=Path, metavar="DIR",
                        help="folder of the campaign (default: campaigns/NAME-UTCTIME)")
    parser.add_argument("--on", default="local", metavar="ENGINE",
                        help=f"where the runs fly: {', '.join(ENGINES)} (default: local)")
    parser.add_argument("--workers", type=to_count, metavar="N",
                        help="number of processes (default: one per core)")
    parser.add_argument("--runs", type=parse_range, metavar="A-B",
                        help="fly only runs A to B (default: all)")
    parser.add_argument("--resume", action="store_true",
                        help="fly the missing and damaged runs of an interrupted campaign in DIR")
    parser.add_argument("--verify", type=to_count, metavar="N",
                        help="fly N runs again over DDS and compare certificates")
    parser.add_argument("--domain", type=int, metavar="N",
                        help="DDS domain of --verify, 0 to 232 (default: a free one from 100)")
    parser.add_argument("--chunk-runs", type=to_count, metavar="N",
                        help="runs per chunk (default: from the duration of a run)")
    parser.add_argument("--sbatch", default="", metavar="OPTIONS",
                        help="further options for Slurm's sbatch, as one text")
    parser.add_argument("--scheduler", default="", metavar="ADDRESS", help="address of Dask's scheduler")
    parser.add_argument("--allow-other-machines", action="store_true",
                        help="also fly on machines whose rows may differ in their last bits; "
                             "manifest.json names them")
    parser.add_argument("--allow-broken-measures", action="store_true",
                        help="end without an error, also if an own measure raised in every run")
    return parser


def find_file(name: str) -> Path:
    if "/" in name or name.endswith((".yaml", ".yml")) or Path(name).is_file():
        return Path(name)
    return ROOT / "config" / "campaigns" / f"{name}.yaml"


def fly(options: argparse.Namespace) -> None:
    """Flies the campaign, collects its table and verifies runs. Raises ConfigError, EngineError."""
    from sls.campaign.campaign_file import load_campaign
    from sls.campaign.collect import collect, describe_broken_measures
    campaign = load_campaign(find_file(options.file))
    engine = load_engine(options.on)
    if options.resume and options.out is None:
        raise InputError("campaign: --resume: expected --out DIR with it, got none")
    out = options.out or Path("campaigns") / (campaign.name + time.strftime("-%Y%m%dT%H%M%SZ",
                                                                            time.gmtime()))
    engine_options = EngineOptions(options.workers, options.sbatch, options.scheduler,
                                   options.chunk_runs, progress=True)
    if hasattr(engine, "check"):
        engine.check(engine_options)  # before the folder is made: without a cluster there is no folder
    with opened(out) as folder:
        try:
            prepare(folder, campaign, engine, options)
            with report_imported():
                engine.run(folder, engine_options)
            collect(folder, options.on)
        except KeyboardInterrupt:
            say_how_to_resume(folder, options)
            raise
        say_result(folder)
        if options.verify:
            from sls.campaign.verify import verify
            if not verify(folder, options.verify, say, options.domain):
                raise EngineError(f"{out}: --verify: expected equal certificates, got others")
        if (broken := describe_broken_measures(folder.manifest)) and not options.allow_broken_measures:
            raise EngineError(f"{out}: {broken} (--allow-broken-measures ends without an error)")


def join_sbatch(arguments: Sequence[str]) -> list[str]:
    """Joins `--sbatch --partition=x` to one argument: argparse would treat the second as an own option."""
    joined: list[str] = []
    for argument in arguments:
        if joined and joined[-1] == "--sbatch":
            joined[-1] += f"={argument}"
        else:
            joined.append(argument)
    return joined


@contextmanager
def report_imported() -> Iterator[None]:
    """Imports the module of the report while the workers fly, because this takes most of a second."""
    importing = threading.Thread(target=import_module, args=("sls.campaign.report",))
    importing.start()
    try:
        yield
    finally:
        importing.join()  # a module cannot be imported while the interpreter ends


def prepare(folder: CampaignFolder, campaign: Any, engine: Any,
            options: argparse.Namespace) -> None:
    """Checks the campaign, then begins or resumes its folder."""
    from sls.campaign.check import check_campaign, check_keep
    from sls.campaign.runs import list_columns, list_own_columns, list_yaml_values, make_runs
    from sls.campaign.own_measures import load_own_measures
    from sls.campaign.sampling import is_certified, make_values
    from sls.campaign.used_files import hash_used_files
    folder.refuse_foreign(campaign, options.resume)
    is_begun = (folder.folder / "plan.json").exists()
    first, last = find_range(folder, campaign, options, is_begun)
    runs = make_runs(campaign)
    check_campaign(campaign, runs)
    check_keep(campaign, [*runs.columns, *list_own_columns(campaign)])
    own = load_own_measures(campaign)
    chunk_runs = 0
    if not is_begun:
        begin = time.monotonic()
        values = list_yaml_values(campaign, make_values(campaign, first, first)[0])
        runs.fly(values, is_certified(campaign, first))
        if own:
            own(runs.scenario_text(values))
        chunk_runs = options.chunk_runs or choose_chunk_runs(
            getattr(engine, "CHUNK_S", 1.0), time.monotonic() - begin, last - first + 1)
    folder.create(campaign, options.on, chunk_runs, first, last, options.resume,
                  list_columns(campaign, runs), {} if is_begun else hash_used_files(campaign),
                  options.allow_other_machines)


def find_range(folder: CampaignFolder, campaign: Any, options: argparse.Namespace,
               is_begun: bool) -> tuple[int, int]:
    """First and last run to fly. Raises InputError if the campaign does not have these runs."""
    if options.runs is None:
        return (folder.plan.first, folder.plan.last) if is_begun else (0, campaign.runs - 1)
    if options.runs[1] >= campaign.runs:
        raise InputError(f"campaign: --runs: expected runs from 0 to {campaign.runs - 1}, got "
                         f"{options.runs[0]}-{options.runs[1]}")
    return options.runs


def choose_chunk_runs(chunk_s: float, run_s: float, count: int) -> int:
    """Number of runs in a chunk, for about `chunk_s` of work. It is limited upwards, because workers
    must not wait long for the last chunk, and downwards, because of the number of files."""
    wanted = min(round(chunk_s / max(run_s, 1e-6)), -(-count // LEAST_CHUNKS))
    return max(wanted, -(-count // MOST_CHUNKS), 1)


def say_result(folder: CampaignFolder) -> None:
    manifest = folder.manifest
    counts = ", ".join(f"{count} {outcome}" for outcome, count in manifest["outcomes"].items())
    say(f"campaign: {manifest['runs']} runs: {counts}")
    if manifest["other_machines"]:
        say("campaign: flown on machines of several kinds, so that rows may differ in their last "
            "bits; manifest.json names them")
    say(f"campaign: {folder.folder}/runs.csv, {folder.folder}/report.html")


def say_how_to_resume(folder: CampaignFolder, options: argparse.Namespace) -> None:
    try:
        whole = sum(not defect for _, defect in folder.check_chunks())
        count = len(folder.chunks)
    except ConfigError:  # not begun
        say("campaign: interrupted before the first run")
        return
    command = ["./sls", "campaign", options.file, "--out", str(folder.folder), "--resume"]
    if options.on != "local":
        command += ["--on", options.on]
    say(f"campaign: interrupted with {whole} of {count} chunks flown; to go on: "
        f"{shlex.join(command)}")


# --- other commands -------------------------------------------------------------------------------


def parse_folders(command: str, arguments: Sequence[str], *names: str) -> list[Path]:
    parser = Parser(prog=f"./sls campaign {command}", description=DESCRIPTIONS[command])
    for name in names:
        parser.add_argument(name, type=Path)
    options = vars(parser.parse_args(arguments))
    return [options[name] for name in names]


def show_status(arguments: Sequence[str]) -> None:
    folder = CampaignFolder(*parse_folders("status", arguments, "DIR"))
    with printing():
        for line in describe_status(folder):
            show(line)


def describe_status(folder: CampaignFolder) -> list[str]:
    """Lines for the user: chunks, rate, outcomes. Reads every chunk once."""
    plan = folder.plan
    whole, flying_s, damaged, missing = 0, 0.0, list[str](), list[int]()
    runs, counts = 0, dict[str, int]()
    outcome = plan.columns.index("outcome")
    for number, defect in folder.check_chunks():
        if defect == "missing":
            missing.append(number)
        elif defect:
            damaged.append(f"{number} ({defect})")
        else:
            whole += 1
            flying_s += folder.read_whole_chunk(number).flown["wall_s"]
            for cells in folder.read_chunk(number):
                counts[cells[outcome]] = counts.get(cells[outcome], 0) + 1
                runs += 1
    lines = [f"campaign  {plan.campaign}, sha256 {plan.sha256}",
             f"runs      {plan.first} to {plan.last} of {plan.campaign_runs}, "
             f"{plan.chunk_runs} in a chunk; engine {plan.engine}",
             f"chunks    {whole} flown, {len(missing)} missing, {len(damaged)} damaged"]
    if missing:
        lines.append(f"missing   {list_some([str(number) for number in missing])}")
    if damaged:
        lines.append(f"damaged   {list_some(damaged)}")
    if runs and flying_s:
        lines.append(f"flown     {runs} runs in {flying_s:.1f} s of workers' time, "
                     f"{runs / flying_s:.1f}/s each")
    if counts:
        lines.append("outcomes  " + ", ".join(f"{count} {name}"
                                              for name, count in sorted(counts.items())))
    if (folder.folder / "runs.csv").exists():
        lines.append(f"table     {folder.folder / 'runs.csv'}")
    describe = getattr(load_engine(plan.engine), "describe_status", None)
    return lines + (describe(folder) if describe else [])


def list_some(items: list[str], most: int = 10) -> str:
    more = f" and {len(items) - most} more" if len(items) > most else ""
    return ", ".join(items[:most]) + more


def make_report(arguments: Sequence[str]) -> None:
    from sls.campaign.collect import write_report
    folder = CampaignFolder(*parse_folders("report", arguments, "DIR"))
    write_report(folder.folder)
    say(f"report: {folder.folder / 'report.html'}")


def show_comparison(arguments: Sequence[str]) -> None:
    from sls.campaign.compare import compare
    with printing():
        show(compare(*parse_folders("compare", arguments, "A", "B")).rstrip("\n"))


COMMANDS = {"status": show_status, "report": make_report, "compare": show_comparison}


def main(arguments: Sequence[str]) -> int:
    """Runs the command and returns the exit code."""
    catch_end_signals()
    try:
        if arguments and arguments[0] in COMMANDS:
            COMMANDS[arguments[0]](arguments[1:])
        else:
            fly(make_parser().parse_args(join_sbatch(arguments)))
    except (ConfigError, ImportError, RunError, OSError) as error:
        say(f"error: {error}")
        return 2 if isinstance(error, (ConfigError, ImportError)) else 1
    except Ended:
        return 143
    except KeyboardInterrupt:
        return 130
    return 0

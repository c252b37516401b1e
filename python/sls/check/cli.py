"""The command line of `./sls check`."""

import argparse
import multiprocessing
import os
import shutil
import signal
import tempfile
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass, replace
from pathlib import Path

from sls.campaign.arguments import Ended, Parser, catch_end_signals, to_count
from sls.check.check_file import Check, find_checks, find_refusal, load_check
from sls.check.difference import find_difference
from sls.check.faults import PLACEMENTS, WORDS, Fault, check_able, parse_fault
from sls.check.flights import fly
from sls.check.judge import judge, open_recording
from sls.check.results import HELD, Result, count_verdicts, describe, find_code, make_rows, write_files
from sls.errors import ConfigError, RunError
from sls.input_error import InputError
from sls.launcher.place import printing, say, show

MOST_LOG_LINES = 30
MEANING = "Flies the scenario of each check file and judges its recording."
EXIT_CODES = """exit codes: 0 every expectation held; 1 one did not hold; 2 a check cannot be
used; 130/143 interrupted"""


@dataclass(frozen=True)
class Job:
    check: Check
    placement: str
    faults: tuple[Fault, ...]
    repeat: int
    repeats: int
    folder: Path


def make_parser() -> argparse.ArgumentParser:
    parser = Parser(prog="./sls check", description=MEANING, epilog=EXIT_CODES, allow_abbrev=False,
                    formatter_class=argparse.RawDescriptionHelpFormatter)
    add = parser.add_argument
    add("files", nargs="+", metavar="FILE", help="a check file, a folder of them, or a name in config/checks")
    add("--junit", type=Path, metavar="FILE", help="write the verdicts as JUnit XML")
    add("--json", type=Path, metavar="FILE", help="write values, bounds and verdicts as JSON")
    add("--report", type=Path, metavar="DIR", help="keep page, recording and logs of each flight that did not hold")
    add("--repeat", type=to_count, default=1, metavar="N",
        help="fly each check N times; all flights must have equal bytes")
    add("--placement", type=parse_placements, metavar="P,…",
        help=f"where to fly: {', '.join(PLACEMENTS)} (default: the file's)")
    add("--under", type=parse_faults, metavar="FAULT,…",
        help=f"faults: {', '.join(f'{word}=…' if kind[0] else word for word, kind in WORDS.items())} "
             "(default: the file's)")
    add("--library", type=Path, metavar="FILE", help="fly this shared library as the controller")
    add("--jobs", type=to_count, default=1, metavar="N", help="flights side by side (default: 1)")
    add("--update", action="store_true", help="write the certificates of the flights into the check files")
    add("--recording", type=Path, metavar="DIR", help="judge this recording instead of flying")
    return parser


def parse_placements(text: str) -> tuple[str, ...]:
    for name in text.split(","):
        if name not in PLACEMENTS:
            raise argparse.ArgumentTypeError(f"expected one of {', '.join(PLACEMENTS)}, got '{name}'")
    return tuple(dict.fromkeys(text.split(",")))


def parse_faults(text: str) -> tuple[Fault, ...]:
    try:
        return tuple(parse_fault(word) for word in text.split(",") if word)
    except InputError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


# --- one flight -----------------------------------------------------------------------------------


def fly_and_judge(job: Job) -> Result:
    result = Result(job.check.name, str(job.check.file), job.placement, ",".join(map(str, job.faults)), job.repeat,
                    job.repeats, folder=str(job.folder))
    try:
        flown = fly(job.check, job.placement, job.faults, job.folder, job.repeat - 1)
        result.wall_s, result.problem, result.is_unusable = flown.wall_s, flown.problem, flown.is_unusable
        result.logs = {name: read_end(file) for name, file in flown.logs.items()}
        if flown.is_whole:
            try:
                recording = open_recording(job.check, flown.recording)
            except InputError as error:  # it has gaps
                result.is_unusable |= not result.problem
                result.problem = result.problem or str(error)
            else:
                result.judged, result.certificate = judge(job.check, recording), recording.certificate
    except Exception as error:  # one of many flights: no verdict on it
        result.problem, result.is_unusable = describe(error), True
    return result


def read_end(file: Path) -> str:
    return "\n".join(file.read_text(encoding="utf-8", errors="replace").splitlines()[-MOST_LOG_LINES:])


def fly_all(jobs: Sequence[Job], workers: int) -> Iterator[Result]:
    if workers == 1:
        yield from map(fly_and_judge, jobs)
        return
    context = multiprocessing.get_context("fork")
    with ProcessPoolExecutor(workers, context, take_signals) as pool:
        try:
            for future in as_completed([pool.submit(fly_in_worker, job) for job in jobs]):
                yield future.result()
        except BaseException:
            for child in multiprocessing.active_children():  # a flight ends its programs first
                child.terminate()
            pool.shutdown(cancel_futures=True)
            raise


def take_signals() -> None:
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_DFL)


def fly_in_worker(job: Job) -> Result:
    try:
        return fly_and_judge(job)
    except KeyboardInterrupt:  # no further flight, although it may be in the queue
        os._exit(130)


# --- all flights ----------------------------------------------------------------------------------


def plan(options: argparse.Namespace, checks: Sequence[Check], folder: Path) -> list[Job]:
    """Raises InputError for what a placement cannot do, before anything flies."""
    jobs = []
    for check in checks:
        faults = check.faults if options.under is None else options.under
        for placement in options.placement or check.placements:
            if refusal := find_refusal(check, placement):
                raise InputError(f"{check.file}: --placement: expected {refusal}, got {placement}")
            check_able(faults, placement)
            jobs += [Job(check, placement, faults, repeat, options.repeat,
                         folder / f"{check.name}-{placement}-{repeat}") for repeat in range(1, options.repeat + 1)]
    return jobs


class Comparison:
    """Compares the certificates of all flights of a check in lockstep, and removes recordings without further use."""

    def __init__(self, keeps_failed: bool) -> None:
        self._first: dict[str, Result] = {}
        self._keeps_failed = keeps_failed

    def add(self, check: Check, result: Result) -> None:
        self.compare(check, result)
        if self._first.get(result.file) is not result and (result.verdict == HELD or not self._keeps_failed):
            shutil.rmtree(result.folder, ignore_errors=True)

    def compare(self, check: Check, result: Result) -> None:
        if not result.certificate or not check.is_lockstep:
            return
        first = self._first.setdefault(result.file, result)
        if first.certificate != result.certificate:
            try:
                text = find_difference(first.recording, result.recording)
            except (ConfigError, RunError) as error:
                text = str(error)
            result.difference = f"differs from {first.flight} (A): {text or 'other certificates, no other row'}"


def check_all(options: argparse.Namespace, folder: Path, results: list[Result]) -> None:
    checks, files = list[Check](), list(dict.fromkeys(file for name in options.files for file in find_checks(name)))
    of_name = {file.stem: file for file in files}  # flights, pages and verdicts have the name of their check
    for file in files:
        if of_name[file.stem] != file:
            raise InputError(f"{file}: expected checks of different names, got {of_name[file.stem]}, too")
        try:
            checks.append(load_check(file, options.library))
        except (ConfigError, ImportError) as error:
            say(f"error: {error}")
            results.append(Result(file.stem, str(file), problem=str(error), is_unusable=True))
    if results:
        return
    if options.recording:
        if len(checks) != 1:
            raise InputError("--recording: expected one check file with it, got several")
        result = Result(checks[0].name, str(files[0]), "recording", folder=str(options.recording))
        results.append(result)
        try:
            result.judged = judge(checks[0], open_recording(checks[0], options.recording))
        except (InputError, OSError) as error:
            result.problem, result.is_unusable = str(error), True
        return
    jobs = plan(options, checks, folder)
    comparison = Comparison(options.report is not None)
    by_file = {str(check.file): check for check in checks}
    for number, result in enumerate(fly_all(jobs, options.jobs), 1):
        comparison.add(by_file[result.file], result)
        results.append(result)
        say(f"[{number}/{len(jobs)}] {result.name}: {result.verdict} ({result.wall_s:.1f} s)")
    order = {(job.check.name, job.placement, job.repeat): index for index, job in enumerate(jobs)}
    results.sort(key=lambda one: order[one.check, one.placement, one.repeat])
    if options.update:
        for check in checks:
            update(check, [one for one in results if one.file == str(check.file)])
    if options.report:
        from sls.check.pages import write_pages
        write_pages(options.report, results)


def update(check: Check, results: Sequence[Result]) -> None:
    """Writes the certificate of the flights into the check file, and nothing else: a bound has a reason, which only a
    person can give."""
    for expected in check.expectations:
        if expected.kind != "certificate":
            continue
        found = {one.certificate for one in results}
        if len(found) != 1 or not (got := found.pop()):
            say(f"{check.file}: not updated: the flights have no certificate, or several")
        elif got != expected.what:
            lines = check.file.read_text(encoding="utf-8").split("\n")
            at = expected.place.line - 1
            at += next(more for more in range(len(lines)) if expected.what in lines[at + more])
            lines[at] = lines[at].replace(expected.what, got)
            check.file.write_text("\n".join(lines), encoding="utf-8")
            say(f"{check.file}:{at + 1}: certificate written: {got[:12]}…")
            for one in results:
                one.judged = [replace(judged, is_held=True) if judged.text == expected.text else judged
                              for judged in one.judged]


def print_results(results: Sequence[Result]) -> None:
    """The table: of repeats with equal results only the first."""
    if not any(one.placement for one in results):
        return
    shown = {(one.check, one.placement, *one.list_problems()): one for one in reversed(results) if one.placement}
    shown = list(reversed(shown.values()))
    for line in make_rows(shown, shutil.get_terminal_size((10**6, 0)).columns):
        show(line)
    for one in shown:
        for problem in one.list_problems():
            show(f"{one.name}: {problem}")
    flown = [(one.check, one.certificate) for one in results if one.certificate]
    are_same = len(set(flown)) == len({check for check, _ in flown}) < len(flown)
    print(count_verdicts(results)
          + ("; the flights of each check have equal bytes" if are_same else ""))


def main(arguments: Sequence[str]) -> int:
    """Runs the command and returns the exit code. Whatever happens, --junit and --json are written."""
    catch_end_signals()
    results = list[Result]()
    folder, code = "", 0
    try:
        folder = tempfile.mkdtemp(prefix="sls-check-")
        options = make_parser().parse_args(arguments)
        if options.report:
            options.report.mkdir(parents=True, exist_ok=True)
        check_all(options, Path(folder), results)
        with printing():
            print_results(results)
    except Ended:
        code = 143
    except KeyboardInterrupt:
        code = 130
    except Exception as error:  # a worker that was killed, for example
        say(f"error: {describe(error)}")
        results.append(Result("sls check", "", problem=describe(error), is_unusable=True))
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    if code:
        results.append(Result("sls check", "", problem="interrupted", is_unusable=True))
    failed = write_files(arguments, results)
    return code or failed or find_code(results)

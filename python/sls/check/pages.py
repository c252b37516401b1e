"""A page for each flight that did not hold: the report of its recording with the verdict and the worst moments."""

import re
import shutil
from collections.abc import Sequence
from pathlib import Path

from sls.check.results import CODES, HELD, NOT_HELD, Result, count_verdicts
from sls.errors import ConfigError, RunError
from sls.recordings import Recording
from sls.report import TEXT, escape, join_page, make_plain_table, make_report, make_section

MOST_PROBLEMS = 3
STYLE = "@media screen { .text td:first-child { white-space: nowrap; } }"


def write_pages(folder: Path, results: Sequence[Result]) -> None:
    """The page of each failed flight. FOLDER/index.html lists all flights. Raises OSError."""
    for result in results:
        if result.verdict != HELD and result.folder:
            write_page(folder, result)
    head = f"<header><h1>Checks</h1><p class=\"sub\">{make_badge(worst(results))}{count_verdicts(results)}</p></header>\n"
    table = make_plain_table(("flight", "verdict", "why"), [
        [name_flight(one, folder), make_badge(one.verdict), "<br>".join(map(escape, one.list_problems()[:MOST_PROBLEMS]))]
        for one in sorted(results, key=lambda one: one.verdict == HELD)], TEXT)
    page = join_page("Checks", [head, make_section("Flights", table)], count_verdicts(results), STYLE)
    (folder / "index.html").write_text(page, encoding="utf-8")


def worst(results: Sequence[Result]) -> str:
    return max((result.verdict for result in results), key=lambda verdict: CODES[verdict], default=HELD)


def make_badge(verdict: str) -> str:
    return f"<span class=\"badge {'good' if verdict == HELD else 'bad'}\">{verdict}</span>"


def write_page(folder: Path, result: Result) -> None:
    """Moves recording and logs of the flight to FOLDER/NAME and writes FOLDER/NAME/report.html beside them."""
    kept = folder / re.sub(r"[^\w.-]+", "-", result.name)
    folder.mkdir(parents=True, exist_ok=True)
    shutil.rmtree(kept, ignore_errors=True)
    shutil.move(result.folder, kept)
    page = kept / "report.html"
    result.folder, result.page = str(kept), str(page)
    page.write_text(make_page(result, result.recording), encoding="utf-8")


def name_flight(result: Result, folder: Path) -> str:
    name = escape(result.name)
    return f"<a href=\"{escape(Path(result.page).relative_to(folder))}\">{name}</a>" if result.page else name


def make_page(result: Result, folder: Path) -> str:
    sections = [make_section("Verdict", make_verdict(result)),
                make_section("Output of the programs", make_logs(result))]
    missed = [one for one in result.judged if not one.is_held]
    marks = [(one.time_s, one.text) for one in missed if one.time_s is not None]
    vehicle = next((one.vehicle for one in missed if one.vehicle is not None), None)
    try:
        recording = Recording(folder)
        return make_report(recording, recording.vehicle_ids[0] if vehicle is None else vehicle, sections, marks,
                           make_badge(result.verdict))
    except (ConfigError, RunError, ImportError) as error:
        sections.append(f"<p class=\"small\">No figures: {escape(error)}</p>")
        head = f"<header><h1>{escape(result.name)}</h1><p class=\"sub\">{make_badge(result.verdict)}</p></header>\n"
        return join_page(result.name, [head, *sections])


def make_verdict(result: Result) -> str:
    table = make_plain_table(
        ("verdict", "expectation", "value", "bound", "worst at", "because"),
        [[make_badge(HELD if one.is_held else NOT_HELD), escape(one.text), f"{escape(one.got)} {escape(one.unit)}", escape(one.bound), one.where,
          escape(one.because)] for one in result.judged], TEXT)
    problems = "".join(f"<li>{escape(problem)}</li>" for problem in result.list_problems())
    return f"<p class=\"sub\">{escape(result.name)}: {result.verdict}</p><ul class=\"notes\">{problems}</ul>{table}"


def make_logs(result: Result) -> str:
    return "".join(f"<details><summary>{escape(name)}</summary><pre>{escape(text)}</pre></details>"
                   for name, text in result.logs.items()) or "<p>None.</p>"

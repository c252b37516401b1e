"""A page for each flight that did not hold: the report of its recording with the verdict and the worst moments."""

import re
import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path

from sls.check.check_file import Check
from sls.check.results import HELD, NOT_HELD, Result
from sls.errors import ConfigError, RunError
from sls.recordings import Recording
from sls.report import escape, join_page, make_report, make_section


def write_pages(folder: Path, checks: Mapping[str, Check], results: Sequence[Result]) -> None:
    """The page of each failed flight. FOLDER/index.html lists all flights. Raises OSError."""
    for result in results:
        if result.verdict != HELD and result.folder:
            write_page(folder, checks[result.file], result)
    rows = "".join(f"<tr><td>{name_flight(one, folder)}</td><td>{escape(one.verdict)}</td>"
                   f"<td>{escape('; '.join(one.list_problems()[:1]))}</td></tr>" for one in results)
    table = f"<div class=\"scroll\"><table class=\"text\">{rows}</table></div>"
    (folder / "index.html").write_text(join_page("checks", [make_section("Checks", table)]), encoding="utf-8")


def write_page(folder: Path, check: Check, result: Result) -> None:
    """Moves recording and logs of the flight to FOLDER/NAME and writes FOLDER/NAME/report.html beside them."""
    kept = folder / re.sub(r"[^\w.-]+", "-", result.name)
    folder.mkdir(parents=True, exist_ok=True)
    shutil.rmtree(kept, ignore_errors=True)
    shutil.move(result.folder, kept)
    page = kept / "report.html"
    result.folder, result.page = str(kept), str(page)
    page.write_text(make_page(check, result, result.recording), encoding="utf-8")


def name_flight(result: Result, folder: Path) -> str:
    name = escape(result.name)
    return f"<a href=\"{escape(Path(result.page).relative_to(folder))}\">{name}</a>" if result.page else name


def make_page(check: Check, result: Result, folder: Path) -> str:
    sections = [make_section("Verdict", make_verdict(result)),
                make_section("Output of the programs", make_logs(result))]
    missed = [one for one in result.judged if not one.is_held]
    marks = [(one.time_s, one.text) for one in missed if one.time_s is not None]
    vehicle = next((one.vehicle for one in missed if one.vehicle is not None), None)
    try:
        recording = Recording(folder)
        return make_report(recording, recording.vehicle_ids[0] if vehicle is None else vehicle, sections, marks)
    except (ConfigError, RunError, ImportError) as error:
        sections.append(f"<p class=\"small\">No figures: {escape(error)}</p>")
        return join_page(result.name, [f"<h1>{escape(result.name)}</h1>\n", *sections])


def make_verdict(result: Result) -> str:
    badges = {True: f"<span class=\"badge good\">{HELD}</span>", False: f"<span class=\"badge bad\">{NOT_HELD}</span>"}
    rows = "".join(
        f"<tr><td style=\"white-space: nowrap\">{badges[one.is_held]}</td>"
        f"<td>{escape(one.text)}</td><td>{escape(one.got)} {escape(one.unit)}</td><td>{escape(one.bound)}</td>"
        f"<td>{one.where}</td><td>{escape(one.because)}</td></tr>"
        for one in result.judged)
    head = "<tr><th>verdict</th><th>expectation</th><th>value</th><th>bound</th><th>worst at</th><th>because</th></tr>"
    problems = "".join(f"<li>{escape(problem)}</li>" for problem in result.list_problems())
    return (f"<p class=\"sub\">{escape(result.name)}: {result.verdict}</p><ul class=\"notes\">{problems}</ul>"
            f"<div class=\"scroll\"><table class=\"text\"><thead>{head}</thead><tbody>{rows}</tbody></table></div>")


def make_logs(result: Result) -> str:
    return "".join(f"<details><summary>{escape(name)}</summary><pre>{escape(text)}</pre></details>"
                   for name, text in result.logs.items()) or "<p>None.</p>"

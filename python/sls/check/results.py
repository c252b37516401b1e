"""Results of checks: the table for people, JUnit XML and JSON for machines."""

import html
import json
import math
import re
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sls.errors import ConfigError, RunError
from sls.launcher.place import say

if TYPE_CHECKING:  # it needs numpy, which may be missing
    from sls.check.judge import Judged

HELD, NOT_HELD, UNUSABLE = "held", "not held", "unusable"
CODES = {HELD: 0, NOT_HELD: 1, UNUSABLE: 2}


@dataclass
class Result:
    """One flight of one check."""

    check: str
    file: str
    placement: str = ""
    under: str = ""
    repeat: int = 1
    repeats: int = 1
    judged: "list[Judged]" = field(default_factory=list)
    problem: str = ""  # of the whole flight, in one line
    is_unusable: bool = False
    difference: str = ""  # from another flight of the check that should have equal bytes
    certificate: str = ""
    wall_s: float = 0.0
    folder: str = ""
    page: str = ""
    logs: dict[str, str] = field(default_factory=dict)  # the end of each

    @property
    def recording(self) -> Path:
        return Path(self.folder) / "recording"

    @property
    def verdict(self) -> str:
        if self.is_unusable:
            return UNUSABLE
        return NOT_HELD if self.list_problems() else HELD

    @property
    def flight(self) -> str:
        """The flight among those of its check."""
        number = f" {self.repeat}" if self.repeats > 1 else ""
        return (f"{self.placement} under {self.under}" if self.under else self.placement) + number

    @property
    def name(self) -> str:
        return f"{self.check}, {self.flight}" if self.placement else self.check

    def list_problems(self) -> list[str]:
        lines = [self.problem] if self.problem else []
        lines += [one.to_line() for one in self.judged if not one.is_held]
        return lines + ([self.difference] if self.difference else [])

    def to_json(self) -> dict[str, Any]:
        return {"check": self.check, "file": self.file, "placement": self.placement, "under": self.under,
                "repeat": self.repeat, "verdict": self.verdict, "problems": self.list_problems(),
                "certificate": self.certificate, "wall_s": round(self.wall_s, 3), "report": self.page,
                "expectations": [to_finite(asdict(one)) for one in self.judged]}


def count_verdicts(results: Sequence[Result]) -> str:
    """`3 flights: 2 held, 1 not held`."""
    verdicts = [one.verdict for one in results]
    words = ", ".join(f"{verdicts.count(word)} {word}" for word in CODES if word in verdicts)
    return f"{len(results)} flight{'s' if len(results) != 1 else ''}: {words}"


def find_code(results: Sequence[Result]) -> int:
    return max((CODES[result.verdict] for result in results), default=0)


def to_finite(values: dict[str, Any]) -> dict[str, Any]:
    """JSON has no infinity and no NaN: they become texts."""
    return {key: str(value) if isinstance(value, float) and not math.isfinite(value) else value
            for key, value in values.items()}


def write_json(file: Path, results: Sequence[Result]) -> None:
    code = find_code(results)
    data = {"exit_code": code, "flights": [result.to_json() for result in results]}
    write(file, json.dumps(data, indent=2, ensure_ascii=False) + "\n")


def write_junit(file: Path, results: Sequence[Result]) -> None:
    """One suite for each check, one case for each flight."""
    checks = list(dict.fromkeys(result.check for result in results))
    suites = "".join(make_suite(check, [one for one in results if one.check == check]) for check in checks)
    write(file, f"<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites {count(results)}>\n{suites}</testsuites>\n")


def count(results: Sequence[Result]) -> str:
    verdicts = [result.verdict for result in results]
    return (f"tests=\"{len(results)}\" failures=\"{verdicts.count(NOT_HELD)}\" errors=\"{verdicts.count(UNUSABLE)}\" "
            f"time=\"{sum(result.wall_s for result in results):.3f}\"")


def make_suite(check: str, results: Sequence[Result]) -> str:
    cases = ""
    for one in results:
        inner = ""
        if one.verdict != HELD:
            lines = one.list_problems()
            kind = "failure" if one.verdict == NOT_HELD else "error"
            place = f"{one.file}: " if kind == "failure" else ""  # an error names its own
            inner = f"<{kind} message={quote(place + lines[0])}>{clean(lines)}</{kind}>" if lines else ""
            inner += f"<system-out>{clean(make_rows([one]))}</system-out>" if one.judged else ""
            logs = [f"{name}: {line}" for name, text in one.logs.items() for line in text.splitlines()]
            inner += f"<system-err>{clean(logs)}</system-err>" if logs else ""
        cases += (f"  <testcase classname={quote(check)} name={quote(one.flight or 'file')} "
                  f"time=\"{one.wall_s:.3f}\">{inner}</testcase>\n")
    return f" <testsuite name={quote(check)} {count(results)}>\n{cases}</testsuite>\n"


NO_XML = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd]")


def clean(lines: Sequence[str]) -> str:
    """Text of an XML element: without the letters that XML cannot have."""
    return html.escape(NO_XML.sub("?", "\n".join(lines)), quote=False)


def quote(text: str) -> str:
    return f"\"{html.escape(NO_XML.sub('?', text))}\""


def write(file: Path, text: str) -> None:
    """Raises OSError."""
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text, encoding="utf-8", errors="backslashreplace")


def write_files(arguments: Sequence[str], results: Sequence[Result]) -> int:
    """Writes what --junit and --json name, also where the command line cannot be read. Returns 2 if it cannot."""
    code = 0
    for name, write_results in (("--junit", write_junit), ("--json", write_json)):
        if file := find_option(arguments, name):
            try:
                write_results(Path(file), results)
            except OSError as error:
                say(f"error: {error.filename or file}: expected to write it, got: {error.strerror}")
                code = 2
    return code


def find_option(arguments: Sequence[str], name: str) -> str:
    for number, word in enumerate(arguments):
        if word.startswith(f"{name}="):
            return word.partition("=")[2]
        if word == name and number + 1 < len(arguments):
            return arguments[number + 1]
    return ""


def refuse(arguments: Sequence[str], problem: str) -> int:
    """Says and writes that nothing was judged; returns the exit code."""
    say(f"error: {problem}")
    write_files(arguments, [Result("sls check", "", problem=problem, is_unusable=True)])
    return 2


def describe(error: Exception) -> str:
    """One line. Errors that nobody expected have their class before it."""
    text = " ".join(str(error).split())
    return text if text and isinstance(error, (ConfigError, RunError, ImportError, OSError)) else (
        f"{type(error).__name__}: {text[:300]}")


# --- for people -----------------------------------------------------------------------------------

HEAD = ("check", "placement", "expectation", "value", "bound", "margin", "worst at", "verdict")


def make_rows(results: Sequence[Result], width: int = 10**6) -> list[str]:
    """A line of at most `width` letters for each expectation, in columns. A flight that could not be judged has one
    line. The widest columns are shortened first."""
    rows = [list(HEAD)]
    for result in results:
        for one in result.judged:
            value = one.got if one.problem or isinstance(one.value, str) else f"{one.value:.4g} {one.unit}".rstrip()
            margin = "" if one.margin is None else f"{one.margin:.3g}"
            rows.append([result.check, result.flight, one.text, value, one.bound, margin, one.where,
                         HELD if one.is_held else "NOT HELD"])
        if result.problem or result.difference:
            text = shorten(result.problem or result.difference)
            verdict = "NOT HELD" if result.verdict == NOT_HELD else result.verdict
            rows.append([result.check, result.flight, "(flight)", text, "", "", "", verdict])
    widths = [max(len(row[column]) for row in rows) for column in range(len(HEAD))]
    while sum(widths) + 2 * (len(widths) - 1) > width and max(widths) > len("expect…"):
        widths[widths.index(max(widths))] -= 1
    return ["  ".join(shorten(cell, most).ljust(most) for cell, most in zip(row, widths)).rstrip() for row in rows]


def shorten(text: str, most: int = 40) -> str:
    return text if len(text) <= most else text[:most - 1] + "…"

"""What the commands said in a tree, and the table of it."""

import dataclasses
import json
import re
import sys
import time
import xml.etree.ElementTree

import tree


def say(text):
    print(f"sls: {text}", file=sys.stderr, flush=True)


@dataclasses.dataclass
class Tests:
    passed: int = 0
    failed: list = dataclasses.field(default_factory=list)
    skipped: dict = dataclasses.field(default_factory=dict)  # reason → names

    def __str__(self):
        return f"{self.passed} passed, {len(self.failed)} failed, {sum(map(len, self.skipped.values()))} skipped"


def read_tests(file):
    """The tests in the JUnit file of ctest."""
    tests = Tests()
    for case in xml.etree.ElementTree.parse(file).iter("testcase"):
        name, status = case.get("name"), case.get("status")
        if status == "run":
            tests.passed += 1
        elif status == "fail":
            tests.failed.append(name)
        else:
            # The second form is GoogleTest's.
            reason = re.search(r"(?:skipped: *|: Skipped\n)(.+)$", case.findtext("system-out") or "", re.MULTILINE)
            tests.skipped.setdefault(reason[1].strip() if reason else "no reason", []).append(name)
    return tests


def find_certificate(checkout):
    """The certificate of the newest recording in a checkout; "none" without one."""
    manifests = sorted(checkout.glob("recordings/*/manifest.json"), key=lambda path: path.stat().st_mtime)
    return json.loads(manifests[-1].read_text(encoding="utf-8"))["certificate"] if manifests else "none"


@dataclasses.dataclass
class Column:
    """All of one system."""

    system: str
    rows: dict = dataclasses.field(default_factory=dict)  # name of a row → text
    tests: Tests | None = None
    certificate: str | None = None
    is_good: bool = True

    def run(self, row, system, name, *command, here=False):
        """Runs a command in the tree `system`, or on this machine; puts how it ended into a row. True if with 0."""
        say(f"{self.system}: {row} (log: {system.log(name)})")
        code, end, start = None, "", time.monotonic()
        try:
            code = (system.run_here if here else system.run)(name, *command)
            end = f"exit {code}"
        except tree.Failure as failure:
            end = str(failure)
            raise
        finally:
            minutes, seconds = divmod(round(time.monotonic() - start), 60)
            self.is_good &= code == 0
            self.rows[row] = f"{end}, {minutes} min {seconds} s"
        return code == 0


def make_table(columns):
    """Markdown: a column for each system, then the tests that failed and the reasons for skipping."""
    names = list(dict.fromkeys(name for column in columns for name in column.rows))
    lines = ["| | " + " | ".join(column.system for column in columns) + " |", "| --- |" + " --- |" * len(columns)]
    lines += [f"| {name} | " + " | ".join(column.rows.get(name, "") for column in columns) + " |" for name in names]
    for column in columns:
        if column.tests:
            lines += [f"{column.system}: failed: {name}" for name in column.tests.failed]
            lines += [f"{column.system}: skipped: {len(tests)}: {reason}: {', '.join(tests[:3])}"
                      + (" …" if len(tests) > 3 else "") for reason, tests in sorted(column.tests.skipped.items())]
    return "\n".join(lines)

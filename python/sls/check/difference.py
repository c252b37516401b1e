"""The first difference of two recordings: step, vehicle, column, both values, and the topic it came from."""

from itertools import zip_longest
from pathlib import Path

from sls.csv_tables import read_records
from sls.recordings import Recording

TOPICS = {"state.csv": "sls/state", "command.csv": "sls/command", "reference.csv": "sls/command",
          "status.csv": "sls/status"}
EVENTS = ("phase", "take_overs", "held", "fail_safe", "rejected_not_finite", "rejected_force_limit", "rejected_step",
          "rejected_client", "rejected_fault")


def find_difference(a: Path, b: Path) -> str:
    """One line; empty if all steps and events are equal. Raises RunError if a file is damaged."""
    first, second = Recording(a), Recording(b)
    if text := first.compare(second).difference:
        file = text.partition(",")[0]
        return text + (f" (topic {TOPICS[file]})" if file in TOPICS else " (topic sls/record)")
    return find_event_difference(first, second)


def find_event_difference(a: Recording, b: Recording) -> str:
    """The first difference that equal steps can hide: in phases, take-overs and refused answers."""
    for one, other in zip_longest(list_changes(a), list_changes(b)):
        if one == other:
            continue
        if one and other and one[:2] == other[:2]:
            step, name, value = one
            return f"status.csv, step {step}, {name}: {value} in A, {other[2]} in B (topic sls/status)"
        is_in_a = other is None or one is not None and one[0] <= other[0]
        step, name, value = one if is_in_a else other
        return f"status.csv, step {step}, {name}: {value} in {'A' if is_in_a else 'B'} alone (topic sls/status)"
    return ""


def list_changes(recording: Recording) -> list[tuple[int, str, str]]:
    """Changes in status.csv once the flight runs."""
    changes, last = [], dict[str, str]()
    for folder, _ in recording.segments:
        for row in read_records(folder / "status.csv"):
            if row["phase"] == "waiting":
                continue
            for name in EVENTS:
                if row.get(name) != last.get(name, "0"):
                    changes.append((int(row["step"]), name, row.get(name) or ""))
            last = row
    return changes

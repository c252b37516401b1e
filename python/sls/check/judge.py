"""Judges a recording by the expectations of a check: from its folder alone."""

import math
import re
from collections.abc import Iterable
from dataclasses import astuple, dataclass, replace
from pathlib import Path

import numpy as np

from sls.campaign.expressions import ExpressionError
from sls.check.check_file import UNKNOWN, Check, Expectation
from sls.columns import Columns
from sls.csv_tables import read_records
from sls.input_error import InputError
from sls.measures import find_rows, measure
from sls.recordings import RecordedVehicle, Recording, align

REFUSED = ("rejected_not_finite", "rejected_force_limit", "rejected_run", "rejected_step", "rejected_vehicle",
           "rejected_client", "rejected_fault")
FILES = ("state", "reference", "command", "measured")


@dataclass(frozen=True)
class Judged:
    """An expectation with what was found. A value that is not defined is None, and `problem` says why."""

    text: str
    is_held: bool
    value: float | str | None = None
    unit: str = ""
    low: float | None = None
    high: float | None = None
    margin: float | None = None
    step: int | None = None
    time_s: float | None = None
    vehicle: int | None = None
    problem: str = ""
    because: str = ""
    place: str = ""

    @property
    def bound(self) -> str:
        parts = [f"{sign} {bound:.6g}" for sign, bound in (("≥", self.low), ("≤", self.high)) if bound is not None]
        return " and ".join(parts)

    @property
    def got(self) -> str:
        if self.problem:
            return self.problem
        return self.value if isinstance(self.value, str) else f"{self.value:.6g}"

    @property
    def where(self) -> str:
        step = "" if self.step is None else f"step {self.step}, {self.time_s:.6g} s"
        return ", ".join(filter(None, (step, "" if self.vehicle is None else f"vehicle {self.vehicle}")))

    def to_line(self) -> str:
        where = f" at {self.where}" if self.where else ""
        unit = f" {self.unit}" if self.unit and not self.problem else ""
        return f"{self.place}: {self.text}: expected {self.bound or 'it'}, got {self.got}{unit}{where}"


def open_recording(check: Check, folder: Path) -> Recording:
    """Raises InputError if the recording cannot be judged by this check."""
    recording = Recording(folder)
    manifest = recording.manifest
    if (got := str(manifest.get("scenario_sha256", ""))) != check.scenario.sha256:
        raise InputError(f"{folder}: expected a recording of {check.scenario_file}, SHA-256 "
                         f"{check.scenario.sha256[:12]}…, got one of '{manifest['scenario']}', {got[:12]}…")
    if manifest["missing"] or manifest["outcome"] in ("recording", "lost", "interrupted"):
        raise InputError(f"{folder}: expected a whole recording, got one with "
                         f"{'; '.join(recording.list_notes())}")
    return recording


def judge(check: Check, recording: Recording) -> list[Judged]:
    """One result for each expectation. Raises InputError if an expectation does not fit a complete flight."""
    return [judge_one(check, expectation, recording) for expectation in check.expectations]


def judge_one(check: Check, expected: Expectation, recording: Recording) -> Judged:
    line = f"{check.file}:{expected.place.line}"
    more = {"because": expected.because, "place": line}
    manifest = recording.manifest
    if expected.kind == "outcome":
        got = f"{manifest['outcome']}: {manifest['reason']}"
        is_held = manifest["outcome"] == expected.what and expected.reason in manifest["reason"]
        last = manifest.get("last_step")
        return Judged(expected.text, is_held, got, step=last, **more,
                      time_s=None if last is None else last * manifest["period_s"])
    if expected.kind == "certificate":
        got = recording.certificate
        return Judged(expected.text, got == expected.what and expected.what != UNKNOWN, got, **more)
    vehicles: Iterable[int] = recording.vehicle_ids if expected.vehicle is None else [expected.vehicle]
    if expected.what in ("take_over", "refused_answer"):
        vehicles = recording.vehicle_ids[:1]  # counted for all vehicles together
    worst: Judged | None = None
    for vehicle in vehicles:
        try:
            judged = judge_number(expected, *FINDERS[expected.kind](recording, expected, vehicle), more)
        except (InputError, ExpressionError) as error:
            if manifest["complete"]:
                raise InputError(f"{line}: {expected.place.path}: {expected.text}: {error}") from None
            problem = "undefined: " + re.sub(re.escape(str(recording.folder)) + "(/|: )", "", str(error))
            return Judged(expected.text, False, unit=expected.unit, low=expected.low, high=expected.high, **more,
                          problem=problem)
        if len(recording.vehicle_ids) > 1:
            judged = replace(judged, vehicle=vehicle)
        if worst is None or not judged.margin >= worst.margin:  # also if the margin is not a number
            worst = judged
    assert worst is not None
    return worst


def judge_number(expected: Expectation, value: float, unit: str, step: int | None, time_s: float | None,
                 more: dict[str, str]) -> Judged:
    margins = [bound - value if is_most else value - bound
               for bound, is_most in ((expected.low, False), (expected.high, True)) if bound is not None]
    margin = min(margins, key=lambda one: -math.inf if math.isnan(one) else one)
    return Judged(expected.text, margin >= 0, value, unit, expected.low, expected.high, margin, step, time_s, **more)


Found = tuple[float, str, int | None, float | None]


def find_measure(recording: Recording, expected: Expectation, vehicle: int) -> Found:
    options = {key: value for key, value in (("stage", expected.stage), ("window_s", expected.window_s))
               if value is not None}
    found = measure(recording, expected.what, vehicle_id=vehicle, **options, **expected.options)
    return found.value, found.unit, found.step, found.time_s


def find_value(recording: Recording, expected: Expectation, vehicle: int) -> Found:
    """An expression at every step where all its columns have a value, then the worst or a mean of them."""
    assert expected.expression is not None
    of = recording.vehicle(vehicle)
    state = of.state
    columns = [find_column(of, name) for name in expected.expression.names]
    rows = find_rows(of, expected.stage, expected.window_s)
    for column in columns:
        rows = rows[np.isfinite(column[rows])]
    if not len(rows):
        raise InputError("expected steps with all columns in this stage and window, got none")
    try:
        values = np.broadcast_to(expected.expression.evaluate_rows([column[rows] for column in columns]), len(rows))
    except ExpressionError as error:
        text, _, row = str(error).rpartition(", row ")
        raise InputError(f"{text or error}, at step {state['step'][rows[int(row)]]:.0f}" if text else text) from None
    over = {"max": lambda: values.max(), "min": lambda: values.min(), "mean": lambda: values.mean(),
            "rms": lambda: np.sqrt(np.mean(values**2)), "end": lambda: values[-1]}[expected.over]
    at = {"max": int(values.argmax()), "min": int(values.argmin()), "end": -1}.get(expected.over)
    where = (None, None) if at is None else (int(state["step"][rows[at]]), float(state["sim_time_s"][rows[at]]))
    return float(over()), "", *where


def find_column(of: RecordedVehicle, name: str) -> np.ndarray:
    """A column at the steps of state.csv: of the first of state, reference and command that has it, or of the file
    before its dot."""
    stem, dot, column = name.rpartition(".")
    if dot and stem not in FILES:
        raise InputError(f"expected {', '.join(FILES)} before the dot, got '{name}'")
    known: list[str] = []
    for file in [stem] if dot else FILES[:3]:
        columns: Columns = getattr(of, file)
        numbers = [one for one in columns if columns[one].dtype.kind in "fi"]
        known += numbers
        if column in numbers:
            return align(of.state["step"], columns, (column,))[:, 0]
    raise InputError(f"expected a column with numbers, got '{name}'; known are {', '.join(dict.fromkeys(known))}")


def find_event(recording: Recording, expected: Expectation, vehicle: int) -> Found:
    """Counts of the whole flight; those of a step have the first of them."""
    if expected.what == "late_step":
        return astuple(measure(recording, "late_steps", vehicle_id=vehicle))
    if expected.what == "fail_safe":
        command = recording.vehicle(vehicle).command
        steps = command["step"][command["fault"] == "fail_safe"]
        first = int(steps[0]) if len(steps) else None
        return float(len(steps)), "", first, None if first is None else first * recording.manifest["period_s"]
    names = REFUSED if expected.what == "refused_answer" else ("take_overs",)
    count = 0
    for folder, manifest in recording.segments:
        for row in read_records(folder / "status.csv"):
            now = sum(int(row.get(name) or 0) for name in names)
            if now > count:
                count, step = now, int(row["step"])
    return (float(count), "", *((step, step * recording.manifest["period_s"]) if count else (None, None)))


FINDERS = {"measure": find_measure, "value": find_value, "event": find_event}

"""How well a flight followed its reference, by stage and lap. The module _sls_core computes; definitions:
common/model/README.md, "Measures"."""

import math
from dataclasses import dataclass, replace

import numpy as np

from sls.core import load_core
from sls.trajectory import Trajectory, Stage

MOST_LAPS = 1000
"""Largest number of laps of a stage, as in flight.txt."""


def calc_errors(error: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """rms and largest size of `error` (n, 3), each per column, (3,)."""
    rms, largest, _, _ = load_core().calc_errors(error)
    return np.array(rms[:3]), np.array(largest[:3])


@dataclass(frozen=True)
class StepMetrics:
    """Metrics of a stage with a constant reference, per axis."""

    settling_time_s: np.ndarray
    overshoot: np.ndarray
    steady_state_error_m: np.ndarray


@dataclass(frozen=True)
class StageMetrics:
    """Load position error over a stage or one of its laps; per axis, m."""

    label: str
    from_s: float
    to_s: float
    rms_m: np.ndarray
    max_m: np.ndarray
    step: StepMetrics | None = None


def calc_stage_metrics(flight: Trajectory) -> list[StageMetrics]:
    """Metrics of every stage, each followed by those of its laps. Rows without a reference are left out."""
    results = []
    for stage in flight.stages:
        rows = find_rows(flight, stage)
        if not len(rows):
            continue
        whole = calc_over(flight, rows, f"{stage.index} {stage.name}")
        if flight.time_s[stage.first] > stage.start_s:
            whole = replace(whole, step=None)  # the position at the start of the step is not known
        results.append(whole)
        results += [calc_over(flight, lap.rows, lap.label) for lap in split_laps(flight, stage)]
    return results


def find_rows(flight: Trajectory, stage: Stage) -> np.ndarray:
    """The indices of a stage's rows that have a reference."""
    rows = np.arange(stage.first, stage.end)
    return rows[np.isfinite(flight.p_WL_ref[rows, 0])]


@dataclass(frozen=True)
class Lap:
    number: int
    """From 1."""
    rows: np.ndarray
    is_whole: bool
    """True if the rows of the stage contain the start and the end of the lap."""

    @property
    def label(self) -> str:
        return f"lap {self.number}" + ("" if self.is_whole else " (part)")


def split_laps(flight: Trajectory, stage: Stage) -> list[Lap]:
    """The laps that have rows. The last row of a mission, at the end of its last stage, belongs to the
    lap that ends there, as in flight.txt (recorder/flight_log.cpp)."""
    rows = find_rows(flight, stage)
    if stage.lap_s is None or not len(rows):
        return []
    lap_ns, period_ns = max(round(stage.lap_s * 1e9), 1), flight.period_s * 1e9
    flown_ns = np.rint((flight.time_s[rows] - stage.start_s) * 1e9)
    last_ns = math.inf if math.isinf(stage.duration_s) else round(stage.duration_s * 1e9) - 1
    lap = np.maximum(np.minimum(flown_ns, last_ns), 0) // lap_ns
    begins = [0, *np.flatnonzero(np.diff(lap)) + 1]
    return [Lap(int(lap[begin]) + 1, rows[begin:end],
                bool(flown_ns[0] < lap[begin] * lap_ns + period_ns
                     and flown_ns[-1] + period_ns >= (lap[begin] + 1) * lap_ns))
            for begin, end in zip(begins, [*begins[1:], len(rows)]) if lap[begin] < MOST_LAPS]


def calc_over(flight: Trajectory, rows: np.ndarray, label: str) -> StageMetrics:
    time_s, p_WL, reference = flight.time_s[rows], flight.p_WL[rows], flight.p_WL_ref[rows]
    error = p_WL - reference
    step = None
    if np.all(reference == reference[0]):
        settling_time_s, _, overshoot, _ = load_core().calc_steps(time_s, error)
        step = StepMetrics(settling_time_s=np.array(settling_time_s[:3]),
                           overshoot=np.array(overshoot[:3]),
                           steady_state_error_m=load_core().calc_steady_state_error(time_s, error))
    rms_m, max_m = calc_errors(error)
    return StageMetrics(label=label, from_s=float(time_s[0]), to_s=float(time_s[-1]),
                        rms_m=rms_m, max_m=max_m, step=step)

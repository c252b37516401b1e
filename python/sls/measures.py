"""Stand-in, replaced by the real module."""
from dataclasses import dataclass, field
import numpy as np
from sls.input_error import InputError


@dataclass(frozen=True)
class MeasureKind:
    unit: str
    options: tuple = ("stage", "window_s", "axis")
    description: str = ""


@dataclass(frozen=True)
class Measured:
    value: float
    unit: str
    step: int | None
    time_s: float | None


MEASURES = {"load_error_rms_m": MeasureKind("m"), "load_error_max_m": MeasureKind("m"),
            "load_error_end_m": MeasureKind("m"), "force_max_n": MeasureKind("N", ("stage", "window_s")),
            "settling_s": MeasureKind("s", ("stage", "axis", "within_m", "for_s"))}


def measure(recording, name, *, vehicle_id, stage=None, window_s=None, axis=None, **options):
    flight = recording.load_flight(vehicle_id, "x")
    rows = np.arange(len(flight.time_s))
    if stage is not None:
        found = [one for one in flight.stages if one.index == stage]
        if not found:
            raise InputError(f"expected stage {stage}, got none")
        rows = rows[found[0].rows]
    if window_s:
        rows = rows[(flight.time_s[rows] >= window_s[0]) & (flight.time_s[rows] <= window_s[1])]
    values = flight.f_Q_W if name.startswith("force") else flight.p_WL - flight.p_WL_ref
    size = np.linalg.norm(values, axis=1) if axis is None else np.abs(values[:, "xyz".index(axis)])
    rows = rows[np.isfinite(size[rows])]
    if not len(rows):
        raise InputError("expected rows, got none")
    at = rows[np.argmax(size[rows])]
    value = {"rms": np.sqrt(np.mean(size[rows] ** 2)), "max": size[at], "end": size[rows[-1]]}.get(
        name.split("_")[-2], np.nan)
    return Measured(float(value), MEASURES[name].unit, int(at), float(flight.time_s[at]))

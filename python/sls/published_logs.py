"""The log files of the published study, as flights. Their columns: docs/figures.md."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sls.csv_tables import Text, is_number, parse_rows, read_text
from sls.trajectory import Trajectory, calc_rod
from sls.input_error import InputError

QUADROTOR = ("quad_x", "quad_y", "quad_z")
LOAD = ("load_x", "load_y", "load_z")
REFERENCE = ("ref_x", "ref_y", "ref_z")
VELOCITY = ("quad_vx", "quad_vy", "quad_vz")
ANGLES = ("alpha", "beta")
RATES = ("gamma_alpha", "gamma_beta")
FORCE = ("force_x", "force_y", "force_z")


@dataclass(frozen=True)
class LogFormat:
    name: str
    has_header: bool
    columns: tuple[str, ...]
    """Names by content; headings in the files may differ."""
    alpha_sign: float = 1.0
    rod_length_m: float = 1.0
    """Rod length for a format without the load's position, m."""


FORMATS = {layout.name: layout for layout in (
    LogFormat("matlab-setpoint", True, ("time", *QUADROTOR, *LOAD, *ANGLES)),
    LogFormat("matlab-trajectory", True, ("time", *REFERENCE, *QUADROTOR, *LOAD, *ANGLES)),
    LogFormat("gazebo", False,
              ("time", *REFERENCE, *QUADROTOR, "roll", "pitch", "yaw", *VELOCITY, *ANGLES, *RATES,
               *FORCE), alpha_sign=-1.0, rod_length_m=1.1),
    LogFormat("px4", False,
              ("time", *REFERENCE, *QUADROTOR, *VELOCITY, *ANGLES, *RATES, *FORCE)),
)}


def detect_format(text: Text, fields: list[str]) -> LogFormat:
    """Finds the format by the number of columns and the presence of a header. Raises InputError."""
    has_header = not is_number(fields[0])
    for layout in FORMATS.values():
        if layout.has_header == has_header and len(layout.columns) == len(fields):
            return layout
    kind = "with" if has_header else "without"
    known = ", ".join(f"{len(layout.columns)} ({layout.name})" for layout in FORMATS.values()
                      if layout.has_header == has_header)
    raise InputError(f"{text.path}:1: expected, {kind} a header, {known} columns, "
                     f"got {len(fields)}")


def load_log(path: Path, name: str, format_name: str | None = None,
             rod_length_m: float | None = None) -> Trajectory:
    """Reads `path` in the format `format_name`; None: in the format that `detect_format` finds.
    `rod_length_m` replaces the rod length of a format without load position. Raises InputError."""
    text = read_text(path)
    if text.rest:  # the last line of these files may have no newline
        text.lines.append(text.rest)
    if not text.lines:
        raise InputError(f"{path}:1: expected a log, got an empty file")
    delimiter = "," if "," in text.lines[0] else None
    fields = [field.strip() for field in text.lines[0].split(delimiter)] or [""]
    layout = FORMATS[format_name] if format_name else detect_format(text, fields)
    if len(fields) != len(layout.columns):
        raise InputError(f"{path}:1: expected {len(layout.columns)} columns ({layout.name}), "
                         f"got {len(fields)}")
    table = parse_rows(text, layout.columns, 2 if layout.has_header else 1, delimiter)
    if not len(table):
        raise InputError(f"{path}:2: expected rows, got none")
    return make_flight(table, layout, name, rod_length_m or layout.rod_length_m)


def make_flight(table: np.ndarray, layout: LogFormat, name: str, rod_length_m: float) -> Trajectory:
    def vectors(columns: tuple[str, ...]) -> np.ndarray:
        if columns[0] in layout.columns:
            return np.column_stack([table[name] for name in columns])
        return np.full((len(table), len(columns)), np.nan)

    alpha, beta = layout.alpha_sign * table["alpha"], table["beta"]
    p_WQ = vectors(QUADROTOR)
    p_WL = vectors(LOAD) if LOAD[0] in layout.columns else p_WQ + rod_length_m * calc_rod(alpha,
                                                                                          beta)
    return Trajectory(name=name, time_s=table["time"] - table["time"][0], p_WQ=p_WQ, p_WL=p_WL,
                  p_WL_ref=vectors(REFERENCE), alpha=alpha, beta=beta, f_Q_W=vectors(FORCE))

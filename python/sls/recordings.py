"""Recordings, as the recorder leaves them: whole, cut short, or in several segments."""

import json
import math
import os
from dataclasses import dataclass, fields, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from sls.csv_tables import read_records, read_table, read_text, stack
from sls.flight import Body, Flight, Stage
from sls.input_error import InputError

COLUMNS = {
    "state.csv": ("vehicle_id", "step", "sim_time_s", "quad_x_m", "quad_y_m", "quad_z_m",
                  "load_x_m", "load_y_m", "load_z_m", "alpha_rad", "beta_rad"),
    "command.csv": ("vehicle_id", "step", "force_x_n", "force_y_n", "force_z_n", "fault"),
    "reference.csv": ("vehicle_id", "step", "stage", "stage_name", "ref_x_m", "ref_y_m", "ref_z_m"),
}


@dataclass(frozen=True)
class Event:
    time_s: float
    step: int
    text: str


def read_manifest(folder: Path) -> dict[str, Any]:
    path = folder / "manifest.json"
    try:
        manifest = json.loads(path.read_text())
    except OSError as error:
        raise InputError(f"{folder}: expected a recording, got no manifest.json that can be read "
                         f"({os.strerror(error.errno)})") from None
    except ValueError as error:
        raise InputError(f"{path}: expected a manifest, got: {error}") from None
    for key, kind in (("complete", bool), ("outcome", str), ("reason", str), ("run_id", str),
                      ("scenario", str), ("vehicle_ids", list), ("period_s", float),
                      ("mode", str), ("missing", list)):
        value = manifest.get(key) if isinstance(manifest, dict) else None
        if not isinstance(value, kind):
            raise InputError(f"{path}: {key}: expected {kind.__name__}, got {json.dumps(value)}")
    return manifest


class Recording:
    """A recording's folder. Every member raises InputError for what it cannot read."""

    def __init__(self, folder: Path):
        self.folder = folder
        self.segments = [(folder, read_manifest(folder))]
        while (segment := folder / f"segment-{len(self.segments) + 1}").is_dir():
            if not (segment / "manifest.json").exists():
                break  # of a recorder that was killed before it had written anything
            self.segments.append((segment, read_manifest(segment)))

    @property
    def manifest(self) -> dict[str, Any]:
        """The last segment's, which speaks for the whole flight."""
        return self.segments[-1][1]

    @property
    def vehicle_ids(self) -> list[int]:
        return self.segments[0][1]["vehicle_ids"]

    @cached_property
    def scenario_text(self) -> str:
        text = read_text(self.folder / "scenario.yaml")
        return "\n".join([*text.lines, text.rest])

    @cached_property
    def scenario(self) -> dict[str, Any]:
        path = self.folder / "scenario.yaml"
        try:
            scenario = yaml.safe_load(self.scenario_text)
        except yaml.YAMLError as error:
            cause = " ".join(str(error).split())
            raise InputError(f"{path}: expected YAML, got: {cause}") from None
        if not isinstance(scenario, dict) or not isinstance(scenario.get("mission"), list):
            raise InputError(f"{path}: expected a scenario with a mission, got another document")
        return scenario

    @cached_property
    def _tables(self) -> dict[str, tuple[np.ndarray, bool]]:
        return {name: self._join_segments(name) for name in COLUMNS}

    def _join_segments(self, name: str) -> tuple[np.ndarray, bool]:
        """The rows of a file in all segments, each up to the step where the next one takes over;
        and whether a row was cut off."""
        parts, is_cut = [], False
        for number, (folder, _) in enumerate(self.segments):
            columns = COLUMNS["state.csv" if name == "measured.csv" else name]
            rows, is_part_cut = read_table(folder / name, columns)
            is_cut |= is_part_cut
            if number + 1 < len(self.segments):
                rows = rows[rows["step"] < self.segments[number + 1][1]["segment"]["first_step"]]
            parts.append(rows)
        return np.concatenate(parts), is_cut

    def _rows_of(self, name: str, vehicle_id: int) -> np.ndarray:
        table, _ = self._tables[name]
        rows = table[table["vehicle_id"] == vehicle_id]
        falling = np.flatnonzero(np.diff(rows["step"]) <= 0)
        if len(falling):
            at, after = rows["step"][falling[0]:falling[0] + 2]
            raise InputError(f"{self.folder / name}: vehicle {vehicle_id}: expected a step after "
                             f"{at:.0f}, got {after:.0f}")
        return rows

    def load_flight(self, vehicle_id: int, name: str) -> Flight:
        """The steps of one vehicle of which there is a state."""
        if vehicle_id not in self.vehicle_ids:
            raise InputError(f"{self.folder}: expected a vehicle of this recording "
                             f"({describe_ids(self.vehicle_ids)}), got {vehicle_id}")
        state = self._rows_of("state.csv", vehicle_id)
        if not len(state):
            raise InputError(f"{self.folder / 'state.csv'}: expected rows of vehicle {vehicle_id}, "
                             f"got none")
        command = self._rows_of("command.csv", vehicle_id)
        reference = self._rows_of("reference.csv", vehicle_id)
        stage = align(state["step"], reference, ("stage",))[:, 0]
        return Flight(
            name=name,
            time_s=state["sim_time_s"],
            p_WQ=stack(state, ("quad_x_m", "quad_y_m", "quad_z_m")),
            p_WL=stack(state, ("load_x_m", "load_y_m", "load_z_m")),
            p_WL_ref=align(state["step"], reference, ("ref_x_m", "ref_y_m", "ref_z_m")),
            alpha=state["alpha_rad"],
            beta=state["beta_rad"],
            f_Q_W=align(state["step"], command, ("force_x_n", "force_y_n", "force_z_n")),
            stages=self._find_stages(stage, reference, state["sim_time_s"], vehicle_id),
            period_s=self.manifest["period_s"],
            notes=self.list_notes(),
            body=read_body(state))

    def load_seen(self, vehicle_id: int, name: str) -> Flight:
        """The same with the positions that the controller saw: what was measured."""
        flight = self.load_flight(vehicle_id, name)
        if not (self.folder / "measured.csv").exists():
            return flight  # the recorder writes that file only where it can differ
        table, _ = self._join_segments("measured.csv")
        rows = table[table["vehicle_id"] == vehicle_id]
        steps = self._rows_of("state.csv", vehicle_id)["step"]
        return replace(flight, p_WQ=align(steps, rows, ("quad_x_m", "quad_y_m", "quad_z_m")),
                       p_WL=align(steps, rows, ("load_x_m", "load_y_m", "load_z_m")),
                       alpha=align(steps, rows, ("alpha_rad",))[:, 0],
                       beta=align(steps, rows, ("beta_rad",))[:, 0])

    def load_fleet(self) -> list[Flight]:
        """Every vehicle's, named by its id."""
        return [self.load_flight(vehicle_id, str(vehicle_id)) for vehicle_id in self.vehicle_ids]

    def _find_stages(self, stage: np.ndarray, reference: np.ndarray, time_s: np.ndarray,
                     vehicle_id: int) -> tuple[Stage, ...]:
        """Consecutive rows with one stage index; rows without one belong to the stage before."""
        known = np.flatnonzero(np.isfinite(stage))
        if not len(known):
            return ()
        begins = known[np.flatnonzero(np.diff(stage[known], prepend=-1.0))]
        ends = [*begins[1:], len(stage)]
        names = dict(zip(reference["stage"], reference["stage_name"]))
        # Of stages of which the first recorded step is another one; earlier versions tell none.
        starts = {start["stage"]: start["step"] * self.manifest["period_s"]
                  for start in self.manifest.get("stage_starts", ())
                  if start["vehicle_id"] == vehicle_id}
        stages = []
        for first, end in zip(begins, ends):
            index = int(stage[first])
            planned = self._find_plan(index)
            eight = planned.get("figure_eight")
            stages.append(Stage(
                index=index, name=str(names[index]), first=int(first), end=int(end),
                start_s=starts.get(index, float(time_s[first])),
                duration_s=float(planned.get("for_s", math.inf)),
                lap_s=float(eight["period_s"]) if eight else None))
        return tuple(stages)

    def _find_plan(self, stage: int) -> dict[str, Any]:
        """What the scenario says about a stage."""
        mission = self.scenario["mission"]
        planned = mission[stage] if stage < len(mission) else {}
        return planned if isinstance(planned, dict) else {}

    def list_notes(self) -> tuple[str, ...]:
        """What is missing, and what else the folder holds."""
        manifest, notes = self.manifest, []
        if not manifest["complete"]:
            outcome = manifest["outcome"]
            if outcome == "recording":
                outcome = "its recorder was killed, or is still recording"
            elif manifest["reason"]:
                outcome += f", {manifest['reason']}"
            notes.append(f"incomplete: {outcome}")
        if manifest["missing"]:
            count = sum(gap["to"] - gap["from"] + 1 for gap in manifest["missing"])
            first = manifest["missing"][0]
            unit = "sample" if first["topic"] == "sls/status" else "step"
            notes.append(f"{count} samples missing, first {first['topic']} {unit} {first['from']} "
                         f"of vehicle {first['vehicle_id']}")
        notes += [f"{name}: the last row is cut off and left out"
                  for name, (_, is_cut) in self._tables.items() if is_cut]
        runs = sorted(folder.name for folder in self.folder.glob("run-*") if folder.is_dir())
        if runs:
            notes.append(f"further runs are recordings of their own: {', '.join(runs)}")
        return tuple(notes)

    def list_events(self) -> list[Event]:
        """Changes of phase and reason, as the server told them."""
        events, last = [], None
        for folder, manifest in self.segments:
            for row in read_records(folder / "status.csv"):
                if (row["phase"], row["reason"]) == last:
                    continue
                last = row["phase"], row["reason"]
                text = f"{row['phase']}: {row['reason']}" if row["reason"] else row["phase"]
                step = int(row["step"])
                events.append(Event(step * manifest["period_s"], step, text))
        return events

    def read_last_status(self) -> dict[str, str]:
        """The last row of status.csv; empty where there is none."""
        rows = read_records(self.segments[-1][0] / "status.csv")
        return rows[-1] if rows else {}


def read_body(state: np.ndarray) -> Body | None:
    """From the columns of a plant that has attitude or rotors: those that are there. At step 0 the
    autopilot has not been asked yet."""
    def columns(*names: str) -> np.ndarray:
        if names and set(names) <= set(state.dtype.names):
            return stack(state, names)
        return np.full((len(state), len(names)), np.nan)

    def asked(*names: str) -> np.ndarray:
        return np.where(state["step"][:, np.newaxis] > 0, columns(*names), np.nan)

    rotors = 0
    while f"rotor_{rotors + 1}_rad_s" in state.dtype.names:
        rotors += 1
    numbers = range(1, rotors + 1)
    body = Body(
        q_WB=columns("att_w", "att_x", "att_y", "att_z"),
        q_WB_set=asked("att_set_w", "att_set_x", "att_set_y", "att_set_z"),
        w_WB_B=columns("rate_x_rad_s", "rate_y_rad_s", "rate_z_rad_s"),
        rotor_speed=columns(*(f"rotor_{n}_rad_s" for n in numbers)),
        rotor_speed_set=columns(*(f"rotor_{n}_set_rad_s" for n in numbers)),
        thrust=columns("thrust_n")[:, 0],
        thrust_set=asked("thrust_set_n")[:, 0],
        rod_tension=columns("rod_tension_n")[:, 0])
    is_known = any(np.any(np.isfinite(getattr(body, field.name))) for field in fields(body))
    return body if is_known else None


def align(steps: np.ndarray, table: np.ndarray, names: tuple[str, ...]) -> np.ndarray:
    """The columns `names` of the rows of `table` with these steps; NaN where there is none."""
    values = np.full((len(steps), len(names)), np.nan)
    if len(table):
        place = np.minimum(np.searchsorted(table["step"], steps), len(table) - 1)
        found = table["step"][place] == steps
        values[found] = stack(table, names)[place[found]]
    return values


def describe_ids(ids: list[int]) -> str:
    """ "0" or "0 to 49"."""
    return f"{ids[0]} to {ids[-1]}" if len(ids) > 1 else ", ".join(map(str, ids))

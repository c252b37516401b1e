"""Reads recordings: complete, cut short, or in several segments."""

import operator
import os
from collections import deque
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import numpy as np

from sls.campaign.yaml_nodes import parse_yaml
from sls.columns import Columns
from sls.core import load_core, to_core
from sls.csv_tables import read_header, read_records, read_table, read_text
from sls.strict_files import COUNT, check_shape, read_json
from sls.trajectory import Stage, Trajectory, find_stages, read_body, read_cable
from sls.vehicle_columns import VehicleColumns
from sls.input_error import InputError
from sls.launcher.place import escape_controls

COLUMNS = {
    "state.csv": ("vehicle_id", "step", "sim_time_s", "quad_x_m", "quad_y_m", "quad_z_m",
                  "load_x_m", "load_y_m", "load_z_m", "alpha_rad", "beta_rad"),
    "command.csv": ("vehicle_id", "step", "force_x_n", "force_y_n", "force_z_n", "fault"),
    "reference.csv": ("vehicle_id", "step", "stage", "stage_name", "ref_x_m", "ref_y_m", "ref_z_m"),
}
MOST_VEHICLES = 256
MOST_SCENARIO_BYTES = 32768
MANIFEST = {  # the keys that this package reads
    "complete": bool, "outcome": str, "reason": str, "run_id": str, "scenario": str, "vehicle_ids": [range(2**32)],
    "period_s": float, "mode": str, "missing": [{"vehicle_id": COUNT, "topic": str, "from": COUNT, "to": COUNT}],
    "further_missing?": {"samples": COUNT}, "segment?": {"first_step": COUNT}, "last_step?": COUNT, "step_s?": float,
    "stage_starts?": [{"vehicle_id": COUNT, "stage": COUNT, "step": COUNT}], "certificate?": str, "timing?": str,
    "versions?": dict, "machine?": dict}
SCENARIO = {
    "mission": [{"for_s?": float, "figure_eight?": {"period_s": float}}], "vehicle?": {"load_mass_kg?": float},
    "plant?": {"cables?": [{"attachment_m?": (float,) * 3}], "rotor?": dict, "rotors?": [dict]},
    "controller?": {"model?": dict, "gains?": {"lqr?": dict}}}
# Columns that figures and metrics need. Only they are read for these: a flight may have millions of steps.
DRAWN = {"state.csv": r"sim_time_s|(quad|load)_[xyz]_m|(alpha|beta)_rad|(load_)?att_.*|rate_.*|rotor_.*|thrust_.*|rod_.*|"
                      r"cable_.*", "command.csv": r"force_._n", "reference.csv": r"stage|ref_._m"}
DRAWN["measured.csv"] = DRAWN["state.csv"]


@dataclass(frozen=True)
class Event:
    time_s: float
    step: int
    text: str


def read_manifest(folder: Path) -> dict[str, Any]:
    """Raises InputError."""
    path = folder / "manifest.json"
    try:
        manifest = read_json(path, MANIFEST)
    except OSError as error:
        raise InputError(f"{folder}: expected a recording, got no manifest.json that can be read "
                         f"({error.strerror})") from None
    for key, is_held, expected in (
            ("vehicle_ids", 0 < len(manifest["vehicle_ids"]) <= MOST_VEHICLES, f"1 to {MOST_VEHICLES} ids"),
            ("period_s", 0 < manifest["period_s"] <= 1e6, "> 0 and <= 1000000")):
        if not is_held:
            raise InputError(f"{path}: {key}: expected {expected}, got {str(manifest[key]):.40}")
    return manifest


@dataclass(frozen=True)
class Verification:
    """The result of reading every file of a recording again."""

    steps: int
    """Number of steps, of the vehicle that has most."""
    certificate: str
    """Certificate of the rows; empty if they cannot be read."""
    problems: tuple[str, ...]
    """Differences between files and their manifest, one line each."""

    @property
    def is_ok(self) -> bool:
        return not self.problems


@dataclass(frozen=True)
class Comparison:
    """The result of a comparison of two recordings."""

    difference: str | None
    """The first row or field that differs: file, vehicle, step, column and both values."""
    notes: tuple[str, ...]
    """Differences and gaps according to the manifests. The data may be equal nevertheless."""

    @property
    def is_equal(self) -> bool:
        return self.difference is None


class RecordedVehicle(VehicleColumns):
    """The columns of one vehicle, read on first use."""

    def __init__(self, recording: "Recording", vehicle_id: int):
        self.recording = recording
        self.vehicle_id = vehicle_id

    @cached_property
    def state(self) -> Columns:
        """The columns of state.csv: the true state of quadrotor and load."""
        return self._read("state.csv")

    @cached_property
    def measured(self) -> Columns:
        """The columns of measured.csv: the measured state, which the controller received. The columns of
        state.csv if measured.csv has no rows."""
        if not (self.recording.folder / "measured.csv").exists():
            return self.state
        measured = self._read("measured.csv")
        return measured if len(measured["step"]) else self.state

    @cached_property
    def command(self) -> Columns:
        """The columns of command.csv: the answers of the controller."""
        return self._read("command.csv")

    @cached_property
    def reference(self) -> Columns:
        """The columns of reference.csv: the desired motion of the load."""
        return self._read("reference.csv")

    @cached_property
    def trajectory(self) -> Trajectory:
        """The vehicle's flight, for figures and metrics."""
        return self.recording.load_flight(self.vehicle_id, self.recording.folder.resolve().name)

    def _read(self, name: str) -> Columns:
        return self.recording.rows_of(name, self.vehicle_id)


class Recording(RecordedVehicle):
    """A recording's folder. `state`, `measured`, `command` and `reference` are the columns of the
    files with these names, for the first vehicle; `vehicle(ID)` has those of another vehicle. Arrays
    have a row for each row of the file, SI units, radians. Every member raises InputError, which is a
    ConfigError, if it cannot read a file. The columns need the extension module."""

    def __init__(self, folder: str | os.PathLike[str]):
        self.folder = folder = Path(folder)
        self._tables: dict[tuple[str, str], dict[str, np.ndarray]] = {}
        self._vehicles: dict[int, RecordedVehicle] = {}
        self.segments = [(folder, read_manifest(folder))]
        while (segment := folder / f"segment-{len(self.segments) + 1}").is_dir():
            if not (segment / "manifest.json").exists():
                break  # its recorder was killed before it wrote a file
            self.segments.append((segment, read_manifest(segment)))
        self.vehicle_id = self.vehicle_ids[0]

    @property
    def recording(self) -> "Recording":  # a kept cycle of references would keep the memory
        return self

    @property
    def manifest(self) -> dict[str, Any]:
        """The manifest of the last segment, which covers the whole flight."""
        return self.segments[-1][1]

    @property
    def vehicle_ids(self) -> list[int]:
        return self.segments[0][1]["vehicle_ids"]

    @property
    def certificate(self) -> str:
        """Hash of the flight, from the manifest; empty if an earlier version wrote the recording."""
        return str(self.manifest.get("certificate", ""))

    def vehicle(self, vehicle_id: int) -> RecordedVehicle:
        """The columns of one vehicle; always the same object, of the first vehicle the recording itself."""
        self._check_vehicle(vehicle_id)
        return self if vehicle_id == self.vehicle_id else self._vehicles.setdefault(vehicle_id, RecordedVehicle(self, vehicle_id))

    def __repr__(self) -> str:
        manifest = self.manifest
        end = manifest["reason"] or manifest["outcome"] if manifest["complete"] else "incomplete"
        return escape_controls(f"<sls.Recording {self.folder}: {manifest['scenario']}, {end}>")

    def verify(self) -> Verification:
        """Reads every file again, as `./sls verify DIR` does. Needs the extension module.

        Raises RunError if a file is too damaged to be read."""
        steps, certificate, problems = load_core().inspect_recording(to_core(self.folder))
        return Verification(steps, certificate, tuple(problems))

    def compare(self, other: "Recording") -> Comparison:
        """Compares the data of two recordings, as `./sls verify A B` does. Needs the extension
        module. Raises RunError if a file is too damaged to be read."""
        difference, notes = load_core().compare_recordings(to_core(self.folder), to_core(other.folder))
        return Comparison(difference, tuple(notes))

    @cached_property
    def scenario_text(self) -> str:
        text = read_text(self.folder / "scenario.yaml", MOST_SCENARIO_BYTES)
        return "\n".join([*text.lines, text.rest])

    @cached_property
    def scenario(self) -> dict[str, Any]:
        path = self.folder / "scenario.yaml"
        scenario = parse_yaml(self.scenario_text.encode(), path).to_plain()
        check_shape(path, scenario, SCENARIO)
        return scenario

    def _load_table(self, name: str, drawn: str) -> dict[str, np.ndarray]:
        """The columns of a file from all segments; with `drawn` those whose names match it. A segment ends at the
        first step of the next segment. The file of a fleet, and one that is read whole, is read once."""
        if (name, drawn) in self._tables:
            return self._tables[name, drawn]
        parts, wanted = [], f"vehicle_id|step|{drawn}" if drawn else ".*"
        for number, (folder, _) in enumerate(self.segments):
            columns = COLUMNS["state.csv" if name == "measured.csv" else name]
            table = read_table(folder / name, columns, wanted)
            if number + 1 < len(self.segments):
                is_used = table["step"] < self.segments[number + 1][1].get("segment", {}).get("first_step", 0)
                table = {column: values[is_used] for column, values in table.items()}
            if parts and (missing := parts[0].keys() - table.keys()):
                raise InputError(f"{folder / name}:1: expected a column '{min(missing)}', as in segment 1")
            parts.append(table)
        joined = parts[0] if len(parts) == 1 else {
            column: np.concatenate([part[column] for part in parts]) for column in parts[0]}
        if not drawn or len(self.vehicle_ids) > 1:
            self._tables[name, drawn] = joined
        return joined

    def rows_of(self, name: str, vehicle_id: int, drawn: str = "") -> Columns:
        """The rows of one vehicle in a file, from all segments; with `drawn` only columns whose names match it."""
        table = self._load_table(name, drawn)
        is_its = table["vehicle_id"] == vehicle_id
        if np.all(is_its):
            rows = Columns(table)
        else:
            rows = Columns({column: partial(operator.getitem, values, is_its)
                            for column, values in table.items()})
        steps = rows["step"]
        falling = np.flatnonzero(np.diff(steps) <= 0)
        if len(falling):
            at, after = steps[falling[0]:falling[0] + 2]
            raise InputError(f"{self.folder / name}: vehicle {vehicle_id}: expected a step after "
                             f"{at}, got {after}")
        return rows

    def load_flight(self, vehicle_id: int, name: str) -> Trajectory:
        """The flight of one vehicle: the steps with a row in state.csv."""
        self._check_vehicle(vehicle_id)

        def read(file: str) -> Columns:
            return self.rows_of(file, vehicle_id, DRAWN[file])

        names = self._find_stage_names(vehicle_id)
        state = read("state.csv")
        steps, time_s = state["step"], state["sim_time_s"]
        if not len(steps):
            raise InputError(f"{self.folder / 'state.csv'}: expected rows of vehicle {vehicle_id}, "
                             f"got none")
        cable = read_cable(state, lambda: self.scenario, vehicle_id)
        body = read_body(state)
        p_WQ, p_WL = (state.take([f"{of}_{axis}_m" for axis in "xyz"]) for of in ("quad", "load"))
        f_Q_W = align(steps, read("command.csv"), ("force_x_n", "force_y_n", "force_z_n"))
        reference = read("reference.csv")
        return Trajectory(
            name=name, time_s=time_s, p_WQ=p_WQ, p_WL=p_WL, f_Q_W=f_Q_W,
            p_WL_ref=align(steps, reference, ("ref_x_m", "ref_y_m", "ref_z_m")),
            alpha=state["alpha_rad"],
            beta=state["beta_rad"],
            stages=self._find_stages(align(steps, reference, ("stage",))[:, 0], names, time_s, vehicle_id),
            period_s=self.manifest["period_s"],
            notes=self.list_notes(),
            body=body,
            cable=cable)

    def _check_vehicle(self, vehicle_id: int) -> None:
        if vehicle_id not in self.vehicle_ids:
            raise InputError(f"{self.folder}: expected a vehicle of this recording "
                             f"({describe_ids(self.vehicle_ids)}), got {vehicle_id}")

    def load_seen(self, vehicle_id: int, name: str) -> Trajectory:
        """As `load_flight`, with the measured positions and angles, which the controller received."""
        flight = self.load_flight(vehicle_id, name)
        if not (self.folder / "measured.csv").exists():
            return flight  # the recorder writes measured.csv only if the measured state can differ
        rows = self.rows_of("measured.csv", vehicle_id, DRAWN["measured.csv"])
        steps = self.rows_of("state.csv", vehicle_id, DRAWN["state.csv"])["step"]
        return replace(flight, p_WQ=align(steps, rows, ("quad_x_m", "quad_y_m", "quad_z_m")),
                       p_WL=align(steps, rows, ("load_x_m", "load_y_m", "load_z_m")),
                       alpha=align(steps, rows, ("alpha_rad",))[:, 0],
                       beta=align(steps, rows, ("beta_rad",))[:, 0])

    def load_fleet(self) -> list[Trajectory]:
        """The flight of every vehicle, named by its id."""
        return [self.load_flight(vehicle_id, str(vehicle_id)) for vehicle_id in self.vehicle_ids]

    def _find_stage_names(self, vehicle_id: int) -> dict[int, str]:
        """The names of the stages in reference.csv, by their indices."""
        reference = self.rows_of("reference.csv", vehicle_id, "stage|stage_name")
        indices, first = np.unique(reference["stage"], return_index=True)
        return {int(index): str(reference["stage_name"][row]) for index, row in zip(indices, first)}

    def _find_stages(self, stage: np.ndarray, names: dict[int, str], time_s: np.ndarray,
                     vehicle_id: int) -> tuple[Stage, ...]:
        # Starts of the stages that began before their first recorded step. Manifests of earlier versions have none.
        starts = {start["stage"]: start["step"] * self.manifest["period_s"]
                  for start in self.manifest.get("stage_starts", ())
                  if start["vehicle_id"] == vehicle_id}
        plans = {}
        for index in names:
            planned = self._find_plan(index)
            eight = planned.get("figure_eight")
            plans[index] = planned.get("for_s"), eight["period_s"] if eight else None
        return find_stages(stage, time_s, names, plans, starts)

    def _find_plan(self, stage: int) -> dict[str, Any]:
        """The keys of a stage in the scenario."""
        mission = self.scenario["mission"]
        return mission[stage] if 0 <= stage < len(mission) else {}

    def list_notes(self) -> tuple[str, ...]:
        """Notes on the recording: incomplete, samples missing, rows cut off, further runs in the folder."""
        manifest, notes = self.manifest, []
        if not manifest["complete"]:
            outcome = manifest["outcome"]
            if outcome == "recording":
                outcome = "its recorder was killed, or is still recording"
            elif manifest["reason"]:
                outcome += f", {manifest['reason']}"
            notes.append(f"incomplete: {outcome}")
        if manifest["missing"]:
            count = (sum(gap["to"] - gap["from"] + 1 for gap in manifest["missing"])
                     + manifest.get("further_missing", {}).get("samples", 0))
            first = manifest["missing"][0]
            unit = {"sls/status": "sample", "sls/record": "batch"}.get(first["topic"], "step")
            notes.append(f"{count} samples missing, first {first['topic']} {unit} {first['from']} "
                         f"of vehicle {first['vehicle_id']}")
        notes += [f"{name}: the last row is cut off and left out"
                  for name in COLUMNS if any(read_header(folder / name)[1] for folder, _ in self.segments)]
        runs = sorted(folder.name for folder in self.folder.glob("run-*") if folder.is_dir())
        if runs:
            notes.append(f"further runs are recordings of their own: {', '.join(runs)}")
        return tuple(notes)

    def list_events(self) -> list[Event]:
        """Changes of phase and reason in the server's status."""
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
        """The last row of status.csv; empty if there is none. The last segments may have no rows."""
        for folder, _ in reversed(self.segments):
            if last := deque(read_records(folder / "status.csv"), 1):
                return last[0]
        return {}


def align(steps: np.ndarray, table: Columns, names: tuple[str, ...]) -> np.ndarray:
    """The columns `names` of `table` at `steps`; NaN for a step without a row."""
    known = table["step"]
    if np.array_equal(known, steps):
        return table.stack(names)
    values = np.full((len(steps), len(names)), np.nan)
    if len(known):
        place = np.minimum(np.searchsorted(known, steps), len(known) - 1)
        found = known[place] == steps
        values[found] = table.stack(names)[place[found]]
    return values


def describe_ids(ids: list[int]) -> str:
    """The range of ids as text, such as "0" or "0 to 49"."""
    return f"{ids[0]} to {ids[-1]}" if len(ids) > 1 else ", ".join(map(str, ids))

"""One self-contained page about a recording: report.html."""

import base64
import html
import math
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sls.trajectory import Trajectory, find_spans
from sls.metrics import StageMetrics, calc_errors, calc_stage_metrics
from sls.recordings import Recording, describe_ids
from sls.scene import MOST_BYTES, make_scene
from sls.tables import format_error, list_error_cells, list_step_cells

if TYPE_CHECKING:
    from matplotlib.figure import Figure

CAPTIONS = {
    "fleet": "All vehicles: the paths of their loads from above, and how far each load is from its "
             "reference.",
    "team": "The paths of all vehicles and, orange, of the centre of the load they carry, from above; and how far the "
            "ends of their cables are from their references.",
    "positions": "Load and quadrotor over time, and where the load should be. The axis of z points "
                 "down, as z does; dotted lines: a stage begins.",
    "errors": "Load position minus reference: as it is, and its size, on a logarithmic axis unless it is always 0.",
    "path": "The same flight in space, one metre as long on each axis; y and z are turned (left, up), so that up is "
            "up. The dot is where the load starts.",
    "angles": "Angles of the rod or cable; both are 0 where the load hangs straight down.",
    "forces": "The force that the controller answers.",
    "attitude": "The attitude that realises this force, with yaw 0.",
    "body_attitude": "Attitude of the vehicle, over the set-point of its autopilot (wide, light).",
    "body_rates": "How fast the vehicle turns about its own axes.",
    "rotors": "Speeds of the rotors, over their set-points in force (wide, light).",
    "thrust": "Thrust of all rotors, over the thrust that the autopilot asks for (wide, light); "
              "and the force of the rod on the quadrotor, along the rod.",
    "cables": "Tension and length of each cable, the distance of its ends (wide, light), and when it is slack or cut.",
    "load_attitude": "Attitude of the load.",
}
MOST_EVENTS = 200
TEXT = " class=\"text\""  # of a table whose cells are texts
# Columns of status.csv that are not counters.
NO_COUNTERS = ("sample_index", "phase", "reason", "step", "controller", "real_time_factor",
               "round_trip_p50_us", "round_trip_p99_us", "timing", "problem")
STYLE_SHEET = """
:root { color-scheme: light; --ground: #f4f5f7; --panel: #fff; --text: #1c2127; --strong: #3c4650; --muted: #5b6570;
  --line: #dfe3e8; --rule: #eceff2; --axis: #b6bec7; --missing: #e4e7eb; --raised: #f7f8fa; --accent: #0b5394;
  --accent-ground: #e3eefa; --good: #14663a; --good-ground: #dff3e6; --bad: #a33b0b; --bad-ground: #fde7df; }
@media screen and (prefers-color-scheme: dark) {
  :root { color-scheme: dark; --ground: #0e1216; --panel: #151b21; --text: #e6ebf0; --strong: #c3ced8; --muted: #97a4b1;
    --line: #2a343e; --rule: #222b33; --axis: #55626f; --missing: #2a343e; --raised: #1e262e; --accent: #7cbcf2;
    --accent-ground: #12304a; --good: #6fd6a4; --good-ground: #123524; --bad: #ff9d8f; --bad-ground: #45201a; }
}
* { box-sizing: border-box; }
body { margin: 0; background: var(--ground); color: var(--text); font: 15px/1.5 "DejaVu Sans", "Segoe UI",
  Helvetica, Arial, sans-serif; }
main { max-width: 1120px; margin: 0 auto; padding: 28px 24px 48px; }
h1 { font-size: 26px; margin: 0 0 4px; }
h2 { font-size: 17px; margin: 0 0 12px; }
h1, h2, .sub, .notes { overflow-wrap: anywhere; }
section { background: var(--panel); border: 1px solid var(--line); border-radius: 8px; padding: 18px 20px;
  margin-top: 18px; }
.sub { color: var(--muted); margin: 0; }
.badge { display: inline-block; white-space: nowrap; border-radius: 4px; padding: 1px 9px; font-size: 13px;
  font-weight: 600; margin-right: 6px; background: var(--accent-ground); color: var(--accent); }
.good { background: var(--good-ground); color: var(--good); }
.bad { background: var(--bad-ground); color: var(--bad); }
.notes { margin: 10px 0 0; padding-left: 20px; color: var(--bad); }
.facts { display: grid; grid-template-columns: repeat(4, 1fr); gap: 12px 20px; margin: 0; }
.facts dt { color: var(--muted); font-size: 12.5px; overflow-wrap: anywhere; }
.facts dd { margin: 0; overflow-wrap: anywhere; font-variant-ligatures: none; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; font-size: 13px; width: 100%;
  font-variant-numeric: tabular-nums; }
th, td { padding: 4px 7px; text-align: right; white-space: nowrap;
  min-width: 58px; border-bottom: 1px solid var(--rule); }
th { font-weight: 600; color: var(--strong); white-space: normal; }
thead tr:first-child th:first-child, td:first-child, .text th, .text td { text-align: left; }
td:first-child { white-space: normal; overflow-wrap: anywhere; min-width: 11em; }
.text td:first-child { min-width: 58px; }
.text th { white-space: nowrap; }
.text td:last-child { white-space: normal; width: 100%; overflow-wrap: anywhere; }
thead tr:first-child th[colspan] { text-align: center; border-left: 1px solid var(--line); }
.lap td:first-child { padding-left: 26px; color: var(--muted); }
.small { color: var(--muted); font-size: 13px; margin: 10px 0 0; }
figure { margin: 0 0 26px; break-inside: avoid; }
figure:last-child { margin-bottom: 0; }
figure img { display: block; width: 100%; max-width: 920px; height: auto; margin: 0 auto; }
.scene { display: block; width: 100%; height: 680px; border: 1px solid var(--line); }
figcaption { color: var(--muted); font-size: 13.5px; text-align: center; margin-top: 4px; }
pre { overflow-x: auto; background: var(--raised); padding: 12px; border-radius: 6px; font-size: 12.5px;
  line-height: 1.45; }
summary { cursor: pointer; font-weight: 600; font-size: 17px; }
@media (max-width: 950px) { .scene { height: 1060px; } }  /* the scene's panels are below each other */
@media (max-width: 800px) {
  .facts { grid-template-columns: repeat(2, 1fr); }
  table { font-size: 12px; }
  th, td { padding: 4px; min-width: 0; }
}
@media print {
  body { background: none; font-size: 12px; }
  main { max-width: none; padding: 0; }
  section { border: 0; padding: 0; }
  .screen { display: none; }
  h2, h3 { break-after: avoid; }
  tr, .facts div, .pair > * { break-inside: avoid; }
  .scroll { overflow: visible; }
  table { font-size: 9px; }
  th, td, td:first-child { padding: 2px 4px; min-width: 0; white-space: normal; }
  pre { white-space: pre-wrap; overflow-wrap: anywhere; }
  figure img { max-height: 112mm; object-fit: contain; }
}
"""
# Colours of a figure's background, text and lines, and those on a dark page; the bodies keep their colours.
DARK = {"#ffffff": "#151b21", "#f7f7f7": "#1e262e", "#000000": "#e6ebf0", "#444444": "#c3ced8", "#666666": "#97a4b1",
        "#999999": "#97a4b1", "#dddddd": "#2a343e", "#b0b0b0": "#2a343e"}


def make_report(recording: Recording, vehicle_id: int, first: Sequence[str] = (),
                marks: Sequence[tuple[float, str]] = (), verdict: str = "") -> str:
    """The page as HTML. The scene may use the rest of MOST_BYTES. `first`: sections below the head. `marks`: times in s
    that the figures mark, with what happens then. `verdict`: the badge of a check. Raises InputError."""
    name = recording.manifest["scenario"]
    fleet = recording.load_fleet()
    if vehicle_id not in recording.vehicle_ids:
        recording.load_flight(vehicle_id, name)
    flight = replace(fleet[recording.vehicle_ids.index(vehicle_id)], name=name)
    title = f"{name}, vehicle {vehicle_id}" if len(fleet) > 1 else name
    sections = [
        make_head(recording, flight, title, verdict) + "".join(first),
        make_section("Flight", make_facts(recording, flight, vehicle_id)),
        make_section("Load position error per stage (m)", make_error_table(flight)),
        make_step_section(flight),
        make_cable_section(fleet),
        make_fleet_section(fleet),
        make_section("Figures", make_figure_list(flight, fleet, marks)),
        make_section("Events", make_events(recording)),
        f"<section><details><summary>Scenario</summary><pre>{escape(recording.scenario_text)}</pre>"
        "</details></section>",
    ]
    page = join_page(title, sections)
    scene = make_scene(recording, MOST_BYTES - len(page.encode()))
    return join_page(title, [*sections[:2], scene, *sections[2:]])


def join_page(title: str, sections: Sequence[str], kind: str = "flight report", style: str = "") -> str:
    """The page of these sections. `style`: more rules of CSS."""
    return ("<!DOCTYPE html>\n<html lang=\"en\">\n<head><meta charset=\"utf-8\">\n"
            "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
            "<link rel=\"icon\" href=\"data:,\">\n"
            f"<title>{escape(title)}: {kind}</title>\n<style>{STYLE_SHEET}{style}</style></head>\n"
            f"<body><main>\n{''.join(sections)}</main></body>\n</html>\n")


def escape(value: Any) -> str:
    return html.escape(str(value))


def make_section(title: str, content: str) -> str:
    return f"<section><h2>{title}</h2>{content}</section>\n"


def make_plain_table(header: Sequence[str], rows: Sequence[Sequence[str]], style: str = "") -> str:
    """An HTML table. `header` and `rows` hold HTML; `style`: attributes of the table."""
    head = "".join(f"<th>{cell}</th>" for cell in header)
    body = "".join("<tr>" + "".join(f"<td>{cell}</td>" for cell in row) + "</tr>" for row in rows)
    return (f"<div class=\"scroll\"><table{style}><thead><tr>{head}</tr></thead><tbody>{body}"
            "</tbody></table></div>")


def make_head(recording: Recording, flight: Trajectory, title: str, verdict: str = "") -> str:
    manifest = recording.manifest
    whole = manifest["complete"]
    notes = "".join(f"<li>{escape(note)}</li>" for note in flight.notes)
    return (f"<header><h1>{escape(title)}</h1><p class=\"sub\">"
            f"{verdict}<span class=\"badge {'bad' if not whole else '' if verdict else 'good'}\">"
            f"{'recording ' if verdict else ''}{'complete' if whole else 'incomplete'}</span>"
            f"<span class=\"badge\">timing: {escape(manifest.get('timing') or 'unknown')}</span>"
            f"run {escape(manifest['run_id'])}</p>"
            + (f"<ul class=\"notes\">{notes}</ul>" if notes else "") + "</header>\n")


def make_fact_list(facts: Sequence[tuple[str, Any]]) -> str:
    entries = "".join(f"<div><dt>{escape(key)}</dt><dd>{escape(value)}</dd></div>" for key, value in facts)
    return f"<dl class=\"facts\">{entries}</dl>"


def make_facts(recording: Recording, flight: Trajectory, vehicle_id: int) -> str:
    manifest, scenario = recording.manifest, recording.scenario
    vehicle = find_vehicle(scenario, vehicle_id)
    model = scenario.get("controller", {}).get("model") or {}
    return make_fact_list([
        ("quadrotor mass", f"{vehicle.get('quad_mass_kg', '–')} kg"),
        ("load mass", describe_load_mass(scenario, vehicle, recording.vehicle_ids if flight.cable else [])),
        ("cable length" if flight.cable else "rod length", f"{vehicle.get('rod_length_m', '–')} m"),
        ("gravity", f"{vehicle.get('gravity_m_s2', '–')} m/s²"),
        ("control period", f"{manifest['period_s']:g} s"),
        ("integration step", f"{manifest.get('step_s', '–')} s"),
        ("mode", manifest["mode"]),
        ("speed", describe_speed(recording.read_last_status())),
        ("outcome", ": ".join(filter(None, (manifest["outcome"], manifest["reason"])))),
        ("flown", f"{flight.time_s[0]:g} s to {flight.time_s[-1]:g} s, "
                  f"{len(flight.time_s)} states"),
        ("vehicles", f"{len(recording.vehicle_ids)} ({describe_ids(recording.vehicle_ids)})"),
        ("controller assumes", ", ".join(f"{key}\u00a0{value}" for key, value in model.items())
         or "the vehicle as it is"),
        ("gains", describe_gains(scenario)),
        ("programs", describe_programs(manifest)),
        ("machine", describe_machine(manifest.get("machine", {}))),
        ("certificate", manifest.get("certificate") or "–"),
    ])


def find_vehicle(scenario: dict[str, Any], vehicle_id: int) -> dict[str, Any]:
    """The parameters of one vehicle: those of `vehicle`, replaced by its own in the list `vehicles`."""
    vehicle = dict(scenario.get("vehicle") or {})
    own = scenario.get("vehicles")
    if isinstance(own, list) and vehicle_id < len(own) and isinstance(own[vehicle_id], dict):
        vehicle.update(own[vehicle_id])
    return vehicle


def describe_load_mass(scenario: dict[str, Any], vehicle: dict[str, Any], carriers: Sequence[int]) -> str:
    """The mass of the load, which the vehicles `carriers` carry together; each has its share."""
    share = vehicle.get("load_mass_kg", "–")
    if len(carriers) < 2:
        return f"{share} kg"
    whole = sum(find_vehicle(scenario, carrier).get("load_mass_kg", math.nan) for carrier in carriers)
    return f"{whole:g} kg, of it {share} kg the share of this vehicle"


def describe_speed(status: dict[str, str]) -> str:
    factor = float(status.get("real_time_factor") or 0)
    return f"{factor:.1f} × real time" if factor else "–"


def describe_gains(scenario: dict[str, Any]) -> str:
    gains = scenario.get("controller", {}).get("gains") or {}
    if "lqr" in gains:
        return f"LQR {gains['lqr'].get('horizontal', 10)} / {gains['lqr'].get('vertical', 5)}"
    return "named, with integral" if "integral" in str(gains) else "named" if gains else "–"


def describe_programs(manifest: dict[str, Any]) -> str:
    versions = manifest.get("versions", {})
    return f"{versions.get('sim_server', '–')}, Fast DDS {versions.get('fast_dds', '–')}, Eigen {versions.get('eigen', '–')}"


def describe_machine(machine: dict[str, Any]) -> str:
    return ", ".join(str(machine[key]) for key in ("system", "processor", "architecture", "libc")
                     if machine.get(key)) or "–"


def make_table(groups: Sequence[str], rows: Sequence[list[str]],
               first: Sequence[str] = ("stage", "from s", "to s")) -> str:
    """A table with the columns `first` and, for each group, three columns, x y z."""
    head = "".join(f"<th rowspan=\"2\">{name}</th>" for name in first)
    top = "".join(f"<th colspan=\"3\">{group}</th>" for group in groups)
    axes = "<th>x</th><th>y</th><th>z</th>" * len(groups)
    body = "".join(
        f"<tr{' class=lap' if cells[0].startswith('lap') else ''}>"
        + "".join(f"<td>{escape(cell)}</td>" for cell in cells) + "</tr>" for cells in rows)
    return (f"<div class=\"scroll\"><table><thead><tr>{head}{top}</tr><tr>{axes}</tr>"
            f"</thead><tbody>{body}</tbody></table></div>")


def name_row(metrics: StageMetrics) -> list[str]:
    return [metrics.label, f"{metrics.from_s:g}", f"{metrics.to_s:g}"]


def make_error_table(flight: Trajectory) -> str:
    rows = [[*name_row(metrics), *list_error_cells(metrics)]
            for metrics in calc_stage_metrics(flight)]
    if not rows:
        return "<p>There is no reference in this recording.</p>"
    return (make_table(("rms", "max"), rows) +
            "<p class=\"small\">Error: load position minus reference, in frame W (x forward, "
            "y right, z down). max: the largest size.</p>")


def make_step_section(flight: Trajectory) -> str:
    rows = [[*name_row(metrics), *list_step_cells(metrics)]
            for metrics in calc_stage_metrics(flight) if metrics.step is not None]
    if not rows:
        return ""
    return make_section(
        "Steps to set-points",
        make_table(("settling time to 2 % (s)", "overshoot (%)", "steady-state error (m)"), rows)
        + "<p class=\"small\">Of the load. Settling time: from the start of the stage until the "
        "position stays within 2 % of the step. Overshoot: how far beyond the set-point, as a "
        "share of the step. Steady-state error: mean of the last tenth of the stage. –: the stage "
        "begins less than 1 cm from its set-point.</p>")


def make_cable_section(fleet: Sequence[Trajectory]) -> str:
    rows = []
    for flight in fleet:
        if flight.cable is None:
            return ""
        cable = flight.cable
        pulls = cable.tension[np.isfinite(cable.tension) & ~cable.is_cut]
        slack = find_spans(flight.time_s, cable.is_slack)
        cut = find_spans(flight.time_s, cable.is_cut)
        numbers = [*([np.mean(pulls), np.max(pulls)] if len(pulls) else [np.nan, np.nan]),
                   sum(end - begin for begin, end in slack), len(slack), np.min(cable.length), np.max(cable.length),
                   cut[0][0] if cut else np.nan]
        rows.append([flight.name, *(f"{number:.4g}" if np.isfinite(number) else "–" for number in numbers)])
    names = ("vehicle", "mean tension (N)", "max tension (N)", "slack (s)", "times slack", "least length (m)",
             "greatest length (m)", "first cut at (s)")
    return make_section("Cables", make_plain_table(names, rows))


def make_fleet_section(fleet: Sequence[Trajectory]) -> str:
    if len(fleet) < 2:
        return ""
    rows = []
    for flight in fleet:
        error = flight.calc_error()
        error = error[np.isfinite(error[:, 0])]
        if len(error):
            rows.append([flight.name, *map(format_error, np.concatenate(calc_errors(error)))])
    title = "Ends of all cables" if fleet[0].cable else "All vehicles"
    return (f"<section><details><summary>{title}, whole flight (m)</summary>"
            f"{make_table(('rms', 'max'), rows, ['vehicle'])}</details></section>\n")


def make_figure_list(flight: Trajectory, fleet: Sequence[Trajectory], marks: Sequence[tuple[float, str]] = ()) -> str:
    from sls import figures  # half a second, and most pages have no figures
    parts = []
    with tempfile.TemporaryDirectory() as folder:
        for name, figure in figures.make_figures([flight], fleet).items():
            mark_times(figure, marks)
            file = Path(folder) / f"{name}.svg"
            figures.save(figure, file)
            data = base64.b64encode(add_dark_colours(file.read_text()).encode()).decode()
            caption = escape(CAPTIONS[name])
            parts.append(f"<figure id=\"{name}\"><img alt=\"{caption}\" "
                         f"src=\"data:image/svg+xml;base64,{data}\">"
                         f"<figcaption>{caption}</figcaption></figure>\n")
    return "".join(parts) or f"<p>No data: the flight ended at step {flight.time_s[-1] / flight.period_s:.0f}.</p>"


def mark_times(figure: "Figure", marks: Sequence[tuple[float, str]]) -> None:
    """Draws a line at each of these times into the panels whose horizontal axis is time."""
    for axes in figure.axes:
        if marks and any(below.get_xlabel().startswith("time") for below in figure.axes
                         if below.get_shared_x_axes().joined(axes, below)):
            for time_s, text in marks:
                axes.axvline(time_s, color="#a33b0b", linewidth=1.0, linestyle="-.")
                axes.annotate(text[:40], (time_s, 1), xycoords=("data", "axes fraction"), color="#a33b0b", fontsize=6,
                              rotation=90, ha="right", va="top")


def add_dark_colours(svg: str) -> str:
    """The picture with a style sheet that replaces its neutral colours where the reader prefers dark pages."""
    rules = "".join(f"[style*='fill: {light}'] {{ fill: {dark}; }} [style*='stroke: {light}'] {{ stroke: {dark}; }}"
                    for light, dark in DARK.items())
    rules = rules.replace("; }", " !important; }")
    return svg.replace("<defs>", "<style>@media screen and (prefers-color-scheme: dark) { "
                       f"svg {{ fill: {DARK['#000000']}; }} {rules} }}</style><defs>", 1)


def make_events(recording: Recording) -> str:
    events = recording.list_events()
    rows = [[f"{event.time_s:g}", str(event.step), escape(event.text)] for event in events[:MOST_EVENTS]]
    more = (f"<p class=\"small\">{len(events) - MOST_EVENTS} more are in status.csv.</p>"
            if len(events) > MOST_EVENTS else "")
    status = recording.read_last_status()
    counted = ", ".join(f"{name.replace('_', ' ')} {count}" for name, count in status.items()
                        if name not in NO_COUNTERS and count != "0")
    return (f"{make_plain_table(('time s', 'step', 'what'), rows, TEXT)}{more}"
            f"<p class=\"small\">Counted by the server: {counted or 'nothing unusual'}.</p>")

"""Findings of the campaigns with several vehicles on one load: the picture and the numbers of each for the page."""

from dataclasses import replace

import numpy as np
import yaml
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from sls.campaign.maps import CLASS_COLOURS, draw_classes, list_values, make_figure, to_map
from sls.campaign.predictions import (calc_rest_error, calc_team_limit, change_first, describe_range,
                                      read_base_team)
from sls.campaign.run_table import OUTCOMES, RunTable
from sls.figures import colour_of
from sls.tables import make_markdown_table


def study_team(table: RunTable) -> tuple[Figure, dict[str, str]]:
    keys = ("vehicle.load_mass_kg", "vehicles.0.quad_mass_kg", "vehicles.0.rod_length_m", "faults.0.delay.by_s")
    loads, masses, lengths, delays = list_values(table, *keys)
    shape = (len(loads), len(masses), len(lengths), len(delays))
    outcome = to_map(table, "outcome", shape)
    errors = np.where(outcome == 0, to_map(table, "load_error_end_m", shape), np.nan)
    team = read_base_team("team")
    load, mass, length = (int(np.argmin(np.abs(values - true))) for values, true in
                          ((loads, team.load_mass_kg / team.count), (masses, team.mass_kg[0]),
                           (lengths, team.length_m[0])))
    held = np.array([(row != 0).argmax() if np.any(row) else len(delays)
                     for row in outcome.reshape(-1, len(delays))]).reshape(shape[:-1])
    mass_limits = np.array([calc_team_limit(change_first(team, mass_kg=value)) for value in masses])
    length_limits = [calc_team_limit(change_first(team, length_m=value)) for value in lengths]

    figure, (left, right) = make_figure(2, "A team of three, law cooperative", 9.6, 3.9)
    draw_classes(left, masses, delays, np.where(outcome == 0, 0, outcome + 1)[load, :, length].T)
    left.plot(masses, mass_limits, color="#0b5394", linewidth=2, drawstyle="steps-mid")
    left.set(xlabel="mass of vehicle 0 (kg); the law assumes 0.25", ylabel="delay of its forces (s)")
    left.legend(handles=[Patch(color=CLASS_COLOURS[place], label=label) for place, label in
                         ((0, "finishes"), (2, "lost"), (3, "failed"))]
                + [Line2D([], [], color="#0b5394", linewidth=2, label="linear: end of stability")],
                loc="upper left", frameon=True, framealpha=0.9)
    fine = np.linspace(masses[0], masses[-1], 61)
    for place, share in enumerate(loads):
        whole = team.count * share
        right.plot(masses, errors[place, :, length, 0], color=colour_of(place), marker="o", markersize=3,
                   linestyle="none", label=f"load of {whole:.3g} kg")
        right.plot(fine, [calc_rest_error(change_first(team, mass_kg=value), whole) for value in fine],
                   color=colour_of(place), linewidth=1)
    right.set(xlabel="mass of vehicle 0 (kg); the law assumes 0.25", ylabel="largest error of an end at rest (m)")
    right.legend(loc="upper center")

    flown = delays[held[load, mass] - 1]
    known = outcome[load, :, length, 0] == 0
    predicted = np.array([calc_rest_error(change_first(team, mass_kg=value), team.load_mass_kg) for value in masses])
    gap = np.abs(delays[held[load, :, length] - 1] - mass_limits)[known].max()
    values = {"te_runs": str(len(table)), "te_lost": str(table.count("lost")), "te_failed": str(table.count("failed")),
              "te_held": f"{delays[held[load, mass, length] - 1]:.3f}",
              "te_lost_at": f"{delays[held[load, mass, length]]:.3f}",
              "te_limit": f"{mass_limits[mass]:.3f}",
              "te_lightest": f"{masses[known][0]:.3f}", "te_heaviest": f"{masses[known][-1]:.3f}",
              "te_limit_light": f"{mass_limits[known][0]:.3f}", "te_limit_heavy": f"{mass_limits[known][-1]:.3f}",
              "te_gap": f"{gap:.3f}",
              "te_error": f"{errors[load, mass + 2, length, 0]:.3f}",
              "te_extra": f"{masses[mass + 2] - masses[mass]:.3f}",
              "te_predicted": f"{predicted[mass + 2]:.3f}",
              "te_light_load": f"{errors[0, mass, length, 0]:.3f}",
              "te_heavy_load": f"{errors[-1, mass, length, 0]:.3f}",
              "te_load_predicted": f"{calc_rest_error(team, team.count * loads[-1]):.3f}",
              "te_length_limits": describe_range(length_limits), "te_length_flown": describe_range(flown),
              "te_shortest": f"{lengths[0]:g}", "te_longest": f"{lengths[-1]:g}"}
    return figure, values


def study_team_failure(table: RunTable) -> tuple[Figure, dict[str, str]]:
    gains, cuts = list_values(table, "controller.gains.attitude", "plant.cables.0.release_s")
    words = table.words["faults.0"][0]
    shape = (len(gains), len(cuts), len(words))
    outcome = to_map(table, "outcome", shape)
    errors = np.where(outcome == 0, to_map(table, "load_error_max_m", shape), np.nan)
    lost_n = [yaml.safe_load(word).get("bias", {}).get("force_n", [0, 0, 0])[2] for word in words]
    frozen = next(place for place, word in enumerate(words) if "freeze" in word)
    lifts = [place for place in range(len(words)) if place != frozen]
    by_lift = np.array(lost_n)[lifts]

    figure, (left, right) = make_figure(2, "One of six vehicles fails while the box moves", 9.6, 3.9)
    team = read_base_team("six_vehicles")
    fine = np.linspace(0.0, by_lift[-1], 2)
    for place, gain in enumerate(gains):
        rates = 2.0 * float(np.sqrt(gain))
        firm = replace(team, gains={**team.gains, "attitude": float(gain), "rates": rates})
        left.plot(by_lift, errors[place, 1, lifts], color=colour_of(place), marker="o", markersize=3, linestyle="none",
                  label=f"k_R = {gain:g}")
        push = np.zeros((team.count, 3))
        push[0, 2] = 1.0
        slope = np.linalg.norm(firm.calc_sag(push), axis=1).max()
        left.plot(fine, slope * fine, color=colour_of(place), linewidth=1)
    left.set(xlabel="lift that vehicle 0 loses (N)", ylabel="largest error of an end (m)")
    left.legend(loc="upper left")
    right.plot(gains, errors[:, 0, 0], color=colour_of(0), marker="o", markersize=4, label="its cable is cut")
    for place, chosen in ((1, 0.5), (2, 1.0)):
        right.plot(gains, errors[:, 1, lost_n.index(chosen)], color=colour_of(place), marker="o", markersize=4,
                   label=f"it loses {chosen:g} N of lift")
    right.axhline(0.5, color="#444444", linewidth=0.8, linestyle=":", label="lost: a cable's length")
    right.set(xlabel="k_R of the attitude (1/s²)", ylabel="largest error of an end (m)")
    right.legend(loc="upper right")

    def describe(run: tuple[int, int, int]) -> str:
        return f"{errors[run]:.3f}" if outcome[run] == 0 else OUTCOMES[outcome[run]]

    rows = make_markdown_table(
        ("k_R, 1/s²", "its cable is cut", "its client dies, the force stays",
         *(f"{value:g} N less lift" for value in by_lift[1:])),
        [[f"{gain:g}", describe((row, 0, 0)), describe((row, 1, frozen)),
          *(describe((row, 1, place)) for place in lifts[1:])] for row, gain in enumerate(gains)])
    is_cut_off = np.array_equal(errors[:, 0], np.repeat(errors[:, 0, :1], len(words), axis=1), equal_nan=True)
    return figure, {"tf_runs": str(len(table)), "tf_table": rows,
                    "tf_cut_off": "nothing" if is_cut_off else "something"}

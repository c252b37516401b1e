"""Findings of the campaigns with one vehicle: the picture and the numbers of each for the page."""

import numpy as np
from matplotlib.figure import Figure

from sls.campaign.maps import (calc_share, draw_classes, draw_share, list_class_handles, list_values, make_figure,
                               to_map)
from sls.campaign.pairs import Pairs, describe_changes, find_pairs
from sls.campaign.predictions import (GRAVITY_M_S2, LOAD_MASS_KG, QUAD_MASS_KG, ROD_LENGTH_M, calc_delay_limit,
                                      calc_lqr_gains, calc_pulse_peak, calc_vertical_limit)
from sls.campaign.run_table import RunTable
from sls.figures import colour_of
from sls.input_error import InputError
from sls.tables import make_markdown_table


def study_mass_and_delay(table: RunTable) -> tuple[Figure, dict[str, str]]:
    masses, delays = list_values(table, "vehicle.load_mass_kg", "faults.0.delay.by_s")
    shape = (len(masses), len(delays))
    outcome = to_map(table, "outcome", shape)
    with np.errstate(invalid="ignore", divide="ignore"):
        growth = (to_map(table, "stage_2_load_error_rms_x_m", shape)
                  / to_map(table, "stage_1_load_error_rms_x_m", shape))
    decays = growth < 0.98
    classes = np.where(outcome == 0, np.where(decays, 0, 1), outcome + 1)
    gains = calc_lqr_gains(10.0, 4)
    vertical = calc_lqr_gains(5.0, 2)
    limits = np.array([calc_delay_limit(gains, mass, 0.0, vertical) for mass in masses])
    sag_gain = vertical[0]
    sag_mass = LOAD_MASS_KG + ROD_LENGTH_M * sag_gain * (QUAD_MASS_KG + LOAD_MASS_KG) / GRAVITY_M_S2

    figure, (axes,) = make_figure(1, "Load mass and delay: what the QSF law survives", 7.6, 4.6)
    draw_classes(axes, masses, delays, classes.T)
    axes.plot(masses, limits, color="#0b5394", linewidth=2, label="linear: end of stability")
    axes.axvline(sag_mass, color="#0b5394", linewidth=2, linestyle="--",
                 label="linear: sags by a rod length")
    axes.axvline(LOAD_MASS_KG, color="#444444", linewidth=0.8, linestyle=":")
    axes.set(xlabel="mass of the load (kg); the controller assumes 0.2", ylabel="delay of the command (s)")
    axes.legend(handles=[*list_class_handles(range(4)), *axes.lines[:2]], loc="upper left",
                bbox_to_anchor=(1.0, 1.0))

    held = ~np.all(outcome != 0, axis=1)
    stable = np.array([row.argmin() for row in decays])  # first delay that does not decay
    usable = held & (masses < sag_mass - 0.06)
    gap = (delays[np.minimum(stable, len(delays) - 1)] - limits)[usable]
    nominal = int(np.argmin(np.abs(masses - LOAD_MASS_KG)))
    lost = int((outcome[nominal] != 0).argmax())
    without_delay = outcome[:, 0]
    return figure, {
        "md_runs": str(len(table)), "md_lost": str(table.count("lost")),
        "md_failed": str(table.count("failed")),
        "md_limit": f"{limits[nominal]:.3f}", "md_grows": f"{delays[stable[nominal]]:.3f}",
        "md_decays": f"{delays[stable[nominal] - 1]:.3f}",
        "md_lost_at": f"{delays[lost]:.3f}", "md_held_at": f"{delays[lost - 1]:.3f}",
        "md_step": f"{delays[1] - delays[0]:.3f}",
        "md_gap_low": f"{gap.min():.3f}".replace("-", "−"),
        "md_gap_high": f"{gap.max():.3f}".replace("-", "−"),
        "md_light": f"{masses[usable][0]:.2f}", "md_heavy": f"{masses[usable][-1]:.2f}",
        "md_limit_light": f"{limits[usable][0]:.3f}", "md_limit_heavy": f"{limits[usable][-1]:.3f}",
        "md_sag_mass": f"{sag_mass:.3f}",
        "md_mass_held": f"{masses[without_delay == 0][-1]:.3f}",
        "md_mass_lost": f"{masses[without_delay != 0][0]:.3f}",
    }


def study_gains(table: RunTable) -> tuple[Figure, dict[str, str]]:
    weights, verticals, delays = list_values(
        table, "controller.gains.lqr.horizontal", "controller.gains.lqr.vertical",
        "faults.0.delay.by_s")
    shape = (len(weights), len(verticals), len(delays))
    outcome = to_map(table, "outcome", shape)
    limits = np.array([calc_delay_limit(calc_lqr_gains(weight, 4)) for weight in weights])
    peaks = np.array([0.7 * calc_pulse_peak(calc_lqr_gains(weight, 4)) for weight in weights])
    errors = to_map(table, "stage_1_load_error_max_x_m", shape)
    forces = to_map(table, "force_max_n", shape)
    figure, axes = make_figure(3, "LQR weights: error, force and delay", 11.0, 3.7)
    for place, vertical in enumerate(verticals):
        held = np.array([(outcome[row, place] != 0).argmax() if np.any(outcome[row, place])
                         else len(delays) for row in range(len(weights))])
        label, colour = f"vertical {vertical:g}", colour_of(place)
        fine = outcome[:, place, 0] == 0
        axes[0].plot(weights, np.where(fine, errors[:, place, 0], np.nan), color=colour,
                     marker="o", markersize=3, label=label)
        axes[1].plot(weights, np.where(fine, forces[:, place, 0], np.nan), color=colour,
                     marker="o", markersize=3)
        axes[2].plot(weights, np.where(held > 0, delays[np.maximum(held, 1) - 1], np.nan),
                     color=colour, marker="o", markersize=3)
    axes[0].plot(weights, peaks, color="#000000", linestyle="--", label="linear")
    axes[2].plot(weights, limits, color="#000000", linestyle="--")
    for place, vertical in enumerate(verticals[-2:], start=len(verticals) - 2):
        axes[2].axhline(calc_vertical_limit(calc_lqr_gains(vertical, 2)), color=colour_of(place),
                        linestyle=":", linewidth=1)
    for one, title in zip(axes, ("largest error in x under the gust (m)", "largest force (N)",
                                 "largest delay that finishes (s)")):
        one.set(xscale="log", xlabel="horizontal weight", title=title)
    axes[0].set_yscale("log")
    axes[1].set_yscale("log")
    axes[0].legend()
    standard = int(np.argmin(np.abs(verticals - 5.0)))

    def describe(weight: float) -> list[str]:
        row = int(np.argmin(np.abs(np.log(weights / weight))))
        lost = outcome[row, standard] != 0
        return [f"{weight:g}", f"{errors[row, standard, 0]:.3f}", f"{peaks[row]:.3f}", f"{forces[row, standard, 0]:.1f}",
                f"{delays[max(lost.argmax(), 1) - 1]:.2f}", f"{limits[row]:.3f}"]

    rows = make_markdown_table(("horizontal weight (vertical 5)", "largest error under the gust, m", "linear",
                                "largest force, N", "largest delay flown, s", "linear limit, s"),
                               [describe(weight) for weight in (10.0, 100.0, 1000.0)])
    free_fall = sum(count for reason, count in table.reasons.items() if "free_fall" in reason)
    fine = (outcome[:, standard, 0] == 0) & (errors[:, standard, 0] > 0.1)
    ratio = (errors[:, standard, 0] / peaks)[fine]
    lightest = weights[outcome[:, standard, 0] == 0]
    return figure, {"ga_runs": str(len(table)), "ga_table": rows, "ga_ratio_low": f"{ratio.min():.3f}",
                    "ga_ratio_high": f"{ratio.max():.3f}", "ga_least": f"{lightest[0]:.2g}",
                    "ga_vertical_50": f"{calc_vertical_limit(calc_lqr_gains(50.0, 2)):.3f}",
                    "ga_vertical_500": f"{calc_vertical_limit(calc_lqr_gains(500.0, 2)):.3f}",
                    "ga_free_fall": str(free_fall)}


def study_wind(table: RunTable) -> tuple[Figure, dict[str, str]]:
    gust, direction = table.numbers["_gust_n"], table.numbers["_direction_rad"]
    threshold = ROD_LENGTH_M / calc_pulse_peak(calc_lqr_gains(10.0, 4))
    figure, (left, right) = make_figure(2, "A gust of one second on the figure eight", 9.6, 4.2)
    everything = np.ones(len(table), dtype=bool)
    draw_share(left, table, "_gust_n", np.arange(0, 4.01, 0.2), everything, colour_of(1), "flown")
    left.axvline(threshold, color="#0b5394", linestyle="--", label="linear: 1 m without wind")
    left.set(xlabel="gust (N)", ylabel="share lost")
    left.legend(loc="lower right")
    lost = table.outcome != 0
    for chosen, colour, label in ((~lost, "#0072b2", "finished"), (lost, "#d55e00", "lost")):
        right.scatter((gust * np.cos(direction))[chosen], (gust * np.sin(direction))[chosen], s=3,
                      color=colour, alpha=0.5, linewidths=0, label=label, rasterized=True)
    turn = np.linspace(0, 2 * np.pi, 181)
    right.plot(threshold * np.cos(turn), threshold * np.sin(turn), color="#0b5394",
               linestyle="--")
    right.set(aspect="equal", xlabel="gust in x (N)", ylabel="gust in y (N)")
    right.legend(loc="upper right", markerscale=3)
    share, low, high = calc_share(table, everything)
    near = calc_share(table, (gust > 0.9 * threshold) & (gust < 1.1 * threshold))
    speed = np.hypot(table.numbers["_wind_x_m_s"], table.numbers["_wind_y_m_s"])
    calm = calc_share(table, (speed < 1.0) & (gust < 0.8 * threshold))
    windy = calc_share(table, (speed > 2.0) & (gust < 0.8 * threshold))
    strong = calc_share(table, gust > 1.6 * threshold)
    return figure, {
        "wi_runs": str(len(table)), "wi_share": f"{100 * share:.1f}",
        "wi_low": f"{100 * low:.1f}", "wi_high": f"{100 * high:.1f}",
        "wi_threshold": f"{threshold:.2f}", "wi_near": f"{100 * near[0]:.0f}",
        "wi_weakest": f"{gust[lost].min():.2f}", "wi_strongest": f"{gust[~lost].max():.2f}",
        "wi_calm": f"{100 * calm[0]:.1f}", "wi_windy": f"{100 * windy[0]:.1f}",
        "wi_strong": f"{100 * strong[0]:.1f}"}


def study_integral(table: RunTable) -> tuple[Figure, dict[str, str]]:
    vertical = table.numbers["controller.gains.vertical.integral"] > 0
    horizontal = table.numbers["controller.gains.horizontal.integral"] > 0
    believed = table.numbers["controller.model.load_mass_kg"]
    rod = table.numbers["controller.model.rod_length_m"]
    push = table.numbers["_push_n"]
    error_z = table.numbers["stage_2_load_error_rms_z_m"]
    error_x = table.numbers["stage_2_load_error_rms_x_m"]
    offset = ROD_LENGTH_M - rod
    sag = (GRAVITY_M_S2 * (LOAD_MASS_KG - believed) / ((QUAD_MASS_KG + believed) * 2.2667))
    drift = (push * GRAVITY_M_S2 * (QUAD_MASS_KG + LOAD_MASS_KG)
             / ((QUAD_MASS_KG + believed) * QUAD_MASS_KG * rod * 3.2469))
    # Largest error, m, that each integral can remove: its largest output, 20 m·s times its gain, divided by the
    # position gain.
    clamp_x, clamp_z = 20.0 * 0.0316 / 3.2469, 20.0 * 0.0224 / 2.2667
    small, below = np.abs(sag) < 0.9 * clamp_z, horizontal & (drift < 0.9 * clamp_x)
    beyond = horizontal & (drift > 1.3 * clamp_x)
    figure, (left, right) = make_figure(2, "Integrals: what is left after 270 s", 9.6, 4.0)
    for axes, switch, x, y, label in (
            (left, vertical, np.abs(sag + offset), error_z, "vertical integral"),
            (right, horizontal, drift, error_x, "horizontal integral")):
        for on, colour in ((False, colour_of(1)), (True, colour_of(0))):
            chosen = switch == on
            axes.scatter(x[chosen], y[chosen], s=9, color=colour, linewidths=0,
                         label=f"{'with' if on else 'without'} {label}")
        top = float(np.max(x))
        axes.plot([0, top], [0, top], color="#000000", linewidth=0.9, linestyle="--",
                  label="linear, without integral")
        axes.legend(loc="upper left")
    left.scatter(np.abs(sag + offset)[vertical], np.abs(offset)[vertical], s=14, facecolors="none",
                 edgecolors="#009e73", linewidths=0.7, label="|error of the rod's length|")
    left.legend(loc="upper left")
    left.set(xlabel="predicted without integral (m)", ylabel="error in z at rest (m)")
    right.set(xlabel="predicted without integral (m)", ylabel="error in x at rest (m)")
    return figure, {
        "in_runs": str(len(table)),
        "in_z_gap": f"{1000 * np.max(np.abs(error_z - np.abs(sag + offset))[~vertical]):.0e}",
        "in_z_rod": f"{1000 * np.max(np.abs(error_z - np.abs(offset))[vertical & small]):.0f}",
        "in_clamp_z": f"{clamp_z:.3f}", "in_clamp_x": f"{clamp_x:.3f}",
        "in_beyond_x": f"{1000 * np.max(np.abs(error_x - (drift - clamp_x))[beyond]):.0e}",
        "in_beyond_count": str(int(np.sum(beyond))),
        "in_z_left": f"{1000 * np.median(error_z[vertical]):.0f}",
        "in_z_before": f"{1000 * np.median(error_z[~vertical]):.0f}",
        "in_x_gap": f"{1000 * np.max(np.abs(error_x - drift)[~horizontal]):.0e}",
        "in_x_share": f"{100 * np.median(error_x[below] / drift[below]):.1f}",
        "in_push": f"{np.max(push):.1f}"}


def study_px4_ingredients(table: RunTable) -> tuple[Figure, dict[str, str]]:
    ages, lags = list_values(table, "sensing.age_s", "autopilot.lag_s")
    shape = (len(ages), len(lags))
    outcome = to_map(table, "outcome", shape)
    errors = np.where(outcome == 0, to_map(table, "stage_1_load_error_rms_y_m", shape), np.nan)
    gains = (5.4399, 9.7962, 8.4827, 3.1623)
    fine_lags = np.linspace(0.0, float(lags[-1]), 61)
    limits = np.array([calc_delay_limit(gains, LOAD_MASS_KG, lag) for lag in fine_lags])
    figure, (axes,) = make_figure(1, "Old states and a slow attitude loop, published gains", 6.6,
                                  4.6)
    mesh = axes.pcolormesh(lags, ages, errors, shading="nearest", cmap="viridis", rasterized=True)
    axes.set_facecolor("#d55e00")
    axes.grid(False)
    figure.colorbar(mesh, ax=axes, label="rms error in y, second lap (m)")
    axes.plot(fine_lags, limits, color="#ffffff", linewidth=2, linestyle="--",
              label="linear: end of stability")
    axes.set_ylim(ages[0] - 0.015, ages[-1] + 0.015)
    axes.set(xlabel="lag of the attitude (s)", ylabel="age of the states (s)")
    axes.legend(loc="upper right", labelcolor="#ffffff")
    held = (outcome == 0)
    beyond = ages[:, None] > np.interp(lags, fine_lags, limits)[None, :]
    return figure, {
        "px_runs": str(len(table)), "px_lost": str(int(np.sum(~held))),
        "px_limit": f"{limits[0]:.3f}", "px_limit_lag": f"{np.interp(0.15, fine_lags, limits):.3f}",
        "px_error_age": f"{errors[int(np.argmin(abs(ages - 0.12))), 0]:.3f}",
        "px_error_lag": f"{errors[0, int(np.argmin(abs(lags - 0.12)))]:.3f}",
        "px_beyond_held": str(int(np.sum(held & beyond)))}


def study_law_comparison(table: RunTable) -> tuple[Figure, dict[str, str]]:
    words, places = table.words["controller"]
    delay = table.numbers["faults.0.delay.by_s"]
    laws = [place for word in ("qsf", "pid") for place in range(2) if f'"{word}"' in words[place]]
    figure, (left, right) = make_figure(2, "QSF and PID at rest, the same disturbances", 9.6, 3.9)
    everything = np.ones(len(table), dtype=bool)
    for law, name, colour in zip(laws, ("qsf", "pid"), (colour_of(0), colour_of(1))):
        draw_share(left, table, "faults.0.delay.by_s", np.arange(-0.006, 0.31, 0.016),
                   (places == law) & (table.numbers["_gust_n"] < 0.8), colour, name)
        draw_share(right, table, "_gust_n", np.geomspace(0.1, 4, 17),
                   (places == law) & (delay < 0.09), colour, name)
    right.set_xscale("log")
    left.set_xlabel("delay (s), gusts below 0.8 N")
    right.set_xlabel("gust (N), delays below 0.09 s")
    for axes in (left, right):
        axes.set_ylabel("share lost or failed")
        axes.legend(loc="upper left")
    found = find_pairs(table, "controller")
    if found is None:
        raise InputError(f"{table.file}: expected pairs of both laws, got none")
    in_qsf, in_pid = (found.in_a, found.in_b) if laws[0] == 0 else (found.in_b, found.in_a)
    pairs = Pairs(table, table, in_qsf, in_pid, "qsf", "pid")
    shares = [calc_share(table, (places == law) & everything)[0] for law in laws]
    late_pid = delay[(places == laws[1]) & (table.outcome == 0)]
    calm = (places == laws[0]) & (table.numbers["_gust_n"] < 0.8)
    not_borne = delay[calm & (table.outcome != 0)].min()
    borne = delay[calm & (delay < not_borne)].max()
    both = (table.outcome[in_qsf] == 0) & (table.outcome[in_pid] == 0)
    errors = table.numbers["load_error_max_m"]
    return figure, {
        "lc_pairs": str(len(in_qsf)), "lc_qsf": f"{100 * shares[0]:.1f}",
        "lc_pid": f"{100 * shares[1]:.1f}", "lc_changes": describe_changes(pairs),
        "lc_pid_delay": f"{late_pid.max():.3f}", "lc_qsf_delay": f"{borne:.3f}",
        "lc_qsf_lost": f"{not_borne:.3f}",
        "lc_both": str(int(both.sum())),
        "lc_error_qsf": f"{np.median(errors[in_qsf][both]):.3f}",
        "lc_error_pid": f"{np.median(errors[in_pid][both]):.3f}",
        "lc_worse": str(int(np.sum(errors[in_qsf][both] > errors[in_pid][both])))}

"""The campaigns of config/campaigns: files, bases, first and last runs, and the linear predictions for
them."""

import pathlib
import unittest
import unittest.mock

import numpy as np
from places import ROOT

import _sls_core
from sls.campaign import findings, predictions
from sls.campaign.campaign_file import load_campaign
from sls.campaign.check import check_campaign
from sls.campaign.sampling import make_values
from sls.scenario import to_yaml_value
from sls.tables import fill_page

FOLDER = ROOT / "config/campaigns"
FILES = sorted(FOLDER.glob("*.yaml"))


def make_runs(campaign):
    return _sls_core.Runs(str(campaign.base), campaign.scenario_paths, list(campaign.measures),
                          campaign.period_s)


def list_values(campaign, run):
    values = make_values(campaign, run, run)[0]
    return [to_yaml_value(value) for value in campaign.pick_scenario_values(values)]


class ShippedCampaignsTest(unittest.TestCase):
    def test_they_are_those_that_the_page_studies(self):
        self.assertEqual({file.stem for file in FILES}, set(findings.STUDIES))

    def test_every_base_is_used_and_bears_its_files_name(self):
        used = {load_campaign(file).base.resolve() for file in FILES}
        self.assertEqual(used, {file.resolve() for file in (FOLDER / "bases").glob("*.yaml")})
        for base in used:
            self.assertIn(f"\nname: {base.stem}\n", base.read_text())

    def test_their_first_last_and_extreme_runs_are_accepted(self):
        for file in FILES:
            with self.subTest(file.stem):
                campaign = load_campaign(file)
                runs = make_runs(campaign)
                runs.check(list_values(campaign, 0))
                runs.check(list_values(campaign, campaign.runs - 1))
                check_campaign(campaign, runs)

    def test_both_laws_of_a_pair_get_the_same_disturbances(self):
        campaign = load_campaign(FOLDER / "law_comparison.yaml")
        qsf, pid = make_values(campaign, 6, 7)
        self.assertNotEqual(qsf[0], pid[0])
        self.assertEqual(qsf[1:], pid[1:])

    def test_the_page_holds_pictures_of_all(self):
        page = (ROOT / "docs/campaigns.md").read_text()
        for name in findings.STUDIES:
            self.assertIn(f"](campaigns/{name}.png)", page)
            self.assertGreater((ROOT / f"docs/campaigns/{name}.png").stat().st_size, 5000)
            self.assertIn(f"`./sls campaign {name}`", page)

    def test_values_and_tables_are_replaced_between_their_markers(self):
        text = "Of <!--a-->1<!--/--> and <!--b-->2<!--/--> <!-- a note -->\n\n<!--a_table-->\n| x |\n| y |\n\n"
        with unittest.mock.patch.object(pathlib.Path, "read_text", lambda _: text):
            filled = fill_page(pathlib.Path(), {"a": "3", "b": "–", "a_table": "| z |\n", "unused": "4"})
        self.assertEqual(filled, "Of <!--a-->3<!--/--> and <!--b-->–<!--/--> <!-- a note -->\n\n"
                                 "<!--a_table-->\n| z |\n\n")


class PredictionTest(unittest.TestCase):
    """Compares the linear predictions with flights, not with the page."""

    def fly(self, name, **values):
        """Flies a campaign's base with `values`. Returns the outcome and the measures by column."""
        campaign = load_campaign(FOLDER / f"{name}.yaml")
        paths = [path.replace("__", ".") for path in values]
        runs = _sls_core.Runs(str(campaign.base), paths, list(campaign.measures), None)
        outcome, _, measured, _, _ = runs.fly([str(value) for value in values.values()], False)
        return outcome, dict(zip(runs.columns, measured))

    def do_motions_grow(self, mass, delay):
        _, found = self.fly("mass_and_delay", vehicle__load_mass_kg=mass,
                            faults__0__delay__by_s=delay)
        return not found["stage_2_load_error_rms_x_m"] < 0.98 * found["stage_1_load_error_rms_x_m"]

    def test_small_motions_of_a_load_of_the_wrong_mass_grow_where_it_is_predicted(self):
        gains, vertical = predictions.calc_lqr_gains(10, 4), predictions.calc_lqr_gains(5, 2)
        for mass in (0.1, 0.2, 0.4):
            limit = predictions.calc_delay_limit(gains, mass, 0.0, vertical)
            periods = round(limit / 0.004)
            self.assertFalse(self.do_motions_grow(mass, round(0.004 * (periods - 2), 3)), mass)
            self.assertTrue(self.do_motions_grow(mass, round(0.004 * (periods + 3), 3)), mass)

    def test_the_right_mass_is_the_formula_of_the_readme(self):
        gains = predictions.calc_lqr_gains(10, 4)
        # Linear theory (docs/campaigns.md): 0.234 s, minus half a period for the hold.
        self.assertAlmostEqual(predictions.calc_delay_limit(gains), 0.232, delta=5e-4)
        np.testing.assert_allclose(gains, [3.1623, 8.4827, 9.7962, 5.4399], atol=5e-5)

    def test_the_load_sags_as_predicted(self):
        # After 12 s the transient is below a millimetre.
        _, found = self.fly("mass_and_delay", vehicle__load_mass_kg=0.3)
        sag = 9.8 * (0.3 - 0.2) / ((1.5 + 0.2) * predictions.calc_lqr_gains(5, 2)[0])
        self.assertAlmostEqual(found["stage_2_load_error_rms_z_m"], sag, delta=1e-3)

    def test_a_gust_moves_the_load_as_predicted(self):
        force = 0.2  # small: nonlinear effects stay below 1 %
        outcome, found = self.fly("wind", faults__0__bias__force_n=f"[{force}, 0, 0]",
                                  plant__rotor_drag_n_s_m=0)
        self.assertEqual(outcome, "finished")
        peak = force * predictions.calc_pulse_peak(predictions.calc_lqr_gains(10, 4))
        # The tolerance includes the transient of the start, a few millimetres.
        self.assertAlmostEqual(found["load_error_max_x_m"], peak, delta=0.01 * peak + 0.005)

    def test_a_team_of_other_masses_than_believed_hangs_as_predicted(self):
        team = predictions.read_base_team("team")
        for load_share, mass in ((0.093, 0.255), (0.0935, 0.25), (0.0935, 0.245)):
            outcome, found = self.fly("team", vehicle__load_mass_kg=load_share, vehicles__0__quad_mass_kg=mass)
            self.assertEqual(outcome, "finished")
            predicted = predictions.calc_rest_error(predictions.change_first(team, mass_kg=mass), 3 * load_share)
            # Second order: 2 % of the mass tilts the load by 0.04 rad.
            self.assertAlmostEqual(found["load_error_end_m"], predicted, delta=0.06 * predicted)

    def test_the_vertical_loop_ends_where_its_root_is_imaginary(self):
        for weight in (5.0, 50.0, 500.0):
            position, velocity = predictions.calc_lqr_gains(weight, 2)
            delay = predictions.calc_vertical_limit((position, velocity)) + predictions.PERIOD_S / 2
            w = np.sqrt((velocity**2 + np.sqrt(velocity**4 + 4 * position**2)) / 2)
            s = 1j * w
            self.assertAlmostEqual(abs(s**2 + np.exp(-s * delay) * (velocity * s + position)), 0.0,
                                   delta=1e-9 * w**2)

"""Findings of the shipped campaigns: the numbers and pictures of docs/campaigns.md, from their folders.

    ./sls python -m sls.campaign.findings DIR [--out docs]

DIR holds a folder for each campaign of config/campaigns/, by its name. The page derives
the linear predictions."""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import matplotlib

from sls.campaign import studies, team_studies
from sls.campaign.run_table import read_runs
from sls.figures import STYLE, save
from sls.input_error import InputError
from sls.launcher.place import say
from sls.scenario import ROOT
from sls.tables import fill_page

STUDIES = {"mass_and_delay": studies.study_mass_and_delay, "gains": studies.study_gains, "wind": studies.study_wind,
           "integral": studies.study_integral, "px4_ingredients": studies.study_px4_ingredients,
           "law_comparison": studies.study_law_comparison, "team": team_studies.study_team,
           "team_failure": team_studies.study_team_failure}


def write_findings(campaigns: Path, out: Path) -> Path:
    """Writes `out`/campaigns.md and `out`/campaigns/*.png. Raises InputError."""
    (out / "campaigns").mkdir(parents=True, exist_ok=True)
    values: dict[str, str] = {}
    with matplotlib.rc_context(STYLE):
        for name, study in STUDIES.items():
            figure, found = study(read_runs(campaigns / name / "runs.csv"))
            values |= found
            save(figure, out / "campaigns" / f"{name}.png", 100)
    page = out / "campaigns.md"
    page.write_text(fill_page(ROOT / "docs/campaigns.md", values))
    return page


def main(arguments: Sequence[str]) -> int:
    """Runs the command and returns the exit code."""
    parser = argparse.ArgumentParser(prog="python -m sls.campaign.findings", description=__doc__)
    parser.add_argument("campaigns", type=Path, metavar="DIR")
    parser.add_argument("--out", type=Path, default=ROOT / "docs", metavar="DIR")
    options = parser.parse_args(arguments)
    try:
        say(f"campaigns: {write_findings(options.campaigns, options.out)}")
    except InputError as error:
        say(f"error: {error}")
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

"""Shared by the tests of campaign files."""

import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parents[2] / "python"))


def write_campaign(folder, text, name="campaign.yaml"):
    """Writes a campaign file that uses the base scenario of these tests."""
    file = Path(folder) / name
    file.write_text(f"base: {HERE / 'base.yaml'}\n" + text)
    return file


def make_campaign(folder, text, name="campaign.yaml"):
    from sls.campaign.campaign_file import load_campaign
    return load_campaign(write_campaign(folder, text, name))

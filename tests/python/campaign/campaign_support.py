"""Shared by the tests of campaign files."""

from pathlib import Path

from sls.campaign.campaign_file import load_campaign

HERE = Path(__file__).resolve().parent


def write_campaign(folder, text, name="campaign.yaml"):
    """Writes a campaign file that uses the base scenario of these tests."""
    file = Path(folder) / name
    file.write_text(f"base: {HERE / 'base.yaml'}\n" + text)
    return file


def make_campaign(folder, text, name="campaign.yaml"):
    return load_campaign(write_campaign(folder, text, name))

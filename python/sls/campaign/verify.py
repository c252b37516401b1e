"""Flies runs of a campaign again with the three programs over DDS and compares certificates."""

import os
import re
import subprocess
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sls.campaign.campaign import Campaign
from sls.campaign.engines import EngineError
from sls.campaign.folder import CampaignFolder
from sls.campaign.runs import list_yaml_values, make_runs
from sls.campaign.sampling import choose_runs, make_values
from sls.campaign.whole_files import explained, name_temporary
from sls.core import load_core
from sls.launcher.place import BUILD, START
from sls.dds_domain import own_domain
from sls.strict_files import read_json

if TYPE_CHECKING:
    from _sls_core import Runs

SEED = 1
LONGEST_FLIGHT_S = 1800.0
# Every flight waits for its controller and recorder, also if the scenario does not. Certificates do not
# depend on this.
ALL_TAKE_PART = {"sync.wait_for": "{ controllers: 1, recorders: 1, timeout_s: 60 }"}


@contextmanager
def written_scenario(text: str, base: Path, folder: Path) -> Iterator[Path]:
    """Context with a file that holds this scenario. If the scenario names a library, the file is beside the
    base scenario, because the library's path is relative to the file."""
    if re.search(r"\.so\b", text):
        folder = base.parent
    file = name_temporary(folder / "verify").with_suffix(".yaml")
    with explained(file):
        file.write_text(text)
    try:
        yield file
    finally:
        file.unlink(missing_ok=True)


def fly_over_dds(scenario: Path, recording: Path, domain: int) -> str:
    """Flies with sim_server, control_client and recorder in lockstep, and returns the certificate. A flight
    that fails has a certificate, too. Raises EngineError if there is no recording."""
    command = [*START, "run", str(scenario), "--out", str(recording), "--mode",
               "lockstep", "--domain", str(domain)]
    try:
        done = subprocess.run(command, env={**os.environ, "SLS_BUILD": str(BUILD)}, check=False,
                              capture_output=True, text=True, errors="replace",
                              timeout=LONGEST_FLIGHT_S)
    except subprocess.TimeoutExpired:
        raise EngineError(f"{scenario}: expected a flight of less than {LONGEST_FLIGHT_S:.0f} s, "
                          "got a longer one") from None
    try:
        return read_json(recording / "manifest.json", {"certificate": str})["certificate"]
    except (OSError, ValueError):
        said = done.stderr.strip().splitlines()
        raise EngineError(f"{scenario}: expected a recording with a certificate, got exit code "
                          f"{done.returncode}: {said[-1] if said else 'nothing said'}") from None


def find_certificate(campaign: Campaign, runs: "Runs", row: dict[str, str]) -> str:
    """The certificate in the table. If the run has none there, that of a flight in this process."""
    if row["certificate"]:
        return row["certificate"]
    index = int(row["run"])
    return runs.fly(list_yaml_values(campaign, make_values(campaign, index, index)[0]), True)[3]


def verify(folder: CampaignFolder, count: int, say: Callable[[str], None],
           domain: int | None = None, seed: int = SEED) -> bool:
    """Flies `count` runs of the folder, chosen by `seed`, one after the other. Prints each run that differs
    and a summary, and writes them into the manifest. True if all are equal. Raises EngineError."""
    campaign, plan = folder.campaign, folder.plan
    runs = make_runs(campaign)
    size = plan.last - plan.first + 1
    chosen = [plan.first + index for index in
              choose_runs(size, min(count, size), seed, purpose="verify")]
    differing = list[dict[str, Any]]()
    for index in chosen:
        expected = find_certificate(campaign, runs, folder.read_row(index))
        got = fly_run_over_dds(campaign, runs, index, domain)
        if got != expected:
            differing.append({"run": index, "expected": expected, "got": got})
            say(f"verify: run {index}: expected certificate {expected}, got {got}")
    say(f"verify: {len(chosen) - len(differing)} of {len(chosen)} runs have the same certificate "
        "when flown over DDS")
    manifest = folder.manifest
    manifest["verified"] = {"runs": chosen, "seed": seed, "differing": differing}
    folder.write_manifest(manifest)
    return not differing


def fly_run_over_dds(campaign: Campaign, runs: "Runs", index: int, domain: int | None) -> str:
    text = runs.scenario_text(list_yaml_values(campaign, make_values(campaign, index, index)[0]))
    text = load_core().Scenario(None, text, str(campaign.base.parent), ALL_TAKE_PART).text
    with tempfile.TemporaryDirectory(prefix="sls-verify-") as scratch, \
            written_scenario(text, campaign.base, Path(scratch)) as scenario:
        if domain is not None:
            return fly_over_dds(scenario, Path(scratch) / "recording", domain)
        with own_domain() as number:
            return fly_over_dds(scenario, Path(scratch) / "recording", number)

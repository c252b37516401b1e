"""Recordings that a campaign keeps: DIR/kept/run-NNNNNN.

Recordings of failed or of all runs are written while their chunk is flown. The worst runs are known
only when the table is complete. For its recording a run is flown again; the recording must have the
certificate of the run's row."""

import heapq
import os
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sls.campaign.campaign import Campaign
from sls.campaign.engines import EngineError
from sls.campaign.folder import CampaignFolder
from sls.campaign.runs import fly_whole, make_runs
from sls.campaign.sampling import make_values
from sls.campaign.whole_files import name_temporary, sync_folder
from sls.errors import RunError
from sls.strict_files import read_json

if TYPE_CHECKING:
    from _sls_core import Runs

    from sls import Flight


def kept_folder(folder: CampaignFolder, index: int) -> Path:
    return folder.folder / "kept" / f"run-{index:06d}"


def is_kept(campaign: Campaign, row: dict[str, str]) -> bool:
    """True if the recording of this row is kept because of its outcome (`keep: all` or `keep: failed`)."""
    kind = campaign.keep.kind
    return kind == "all" or kind == "failed" and row["outcome"] != "finished"


def keep_run(folder: CampaignFolder, campaign: Campaign, runs: "Runs",
             row: dict[str, str]) -> None:
    """Writes one recording whole, unless the folder has it already. Raises EngineError if it cannot be
    written, or if its certificate differs from the row's. It may differ in a campaign that flies on machines
    of several kinds, because the run was then flown elsewhere."""
    index = int(row["run"])
    target = kept_folder(folder, index)
    if is_whole(folder, row):
        return
    temporary = name_temporary(target)
    try:
        target.parent.mkdir(exist_ok=True)
        shutil.rmtree(temporary, ignore_errors=True)
        save(fly_whole(campaign, runs, make_values(campaign, index, index)[0]), temporary)
        certificate = find_certificate(temporary)
        if row["certificate"] not in ("", certificate) and not folder.plan.allow_other_machines:
            raise EngineError(f"{target}: expected certificate {row['certificate']} of runs.csv, "
                              f"got {certificate}")
        shutil.rmtree(target, ignore_errors=True)  # a damaged recording, if there is one
        os.rename(temporary, target)
        sync_folder(target.parent)
    except OSError as error:
        if not is_whole(folder, row):  # a whole one was written by another worker
            raise EngineError(f"{target}: expected to write a recording, got: "
                              f"{error.strerror or error}") from None
    finally:
        shutil.rmtree(temporary, ignore_errors=True)


def save(flight: "Flight", recording: Path) -> None:
    """Saves the recording. Raises RunError if the flight finished and its recording is not complete. The
    recording of a failed flight is never complete."""
    try:
        flight.save(recording)
    except RunError:
        if flight.is_finished:
            raise


def find_certificate(recording: Path) -> str | None:
    """The certificate of a recording; None if it has none or cannot be read."""
    try:
        return read_json(recording / "manifest.json", {"certificate?": str}).get("certificate")
    except (OSError, ValueError):
        return None


def is_whole(folder: CampaignFolder, row: dict[str, str]) -> bool:
    """True if the recording of this row is in the folder."""
    certificate = find_certificate(kept_folder(folder, int(row["run"])))
    return certificate is not None and (row["certificate"] in ("", certificate)
                                        or folder.plan.allow_other_machines)


def list_worst(folder: CampaignFolder, campaign: Campaign) -> list[dict[str, str]]:
    """The rows with the largest values in the column, the largest first. Of equal values the lower index
    comes first. Rows without a value are left out."""
    column = campaign.keep.find_column(folder.plan.columns)

    def rank(row: dict[str, str]) -> tuple[float, int]:
        return float(row[column]), -int(row["run"])
    return heapq.nlargest(campaign.keep.count, (row for row in folder.read_rows() if row[column]), rank)


def list_kept(folder: CampaignFolder, campaign: Campaign) -> Iterator[dict[str, str]]:
    if campaign.keep.kind == "worst":
        yield from list_worst(folder, campaign)
    else:
        yield from (row for row in folder.read_rows() if is_kept(campaign, row))


def keep_recordings(folder: CampaignFolder) -> dict[str, Any]:
    """Writes every recording that the campaign keeps and that is missing. Returns the manifest's entries
    for them: kind and number, for "worst" the runs, and the runs whose recording has another certificate than
    the table, if there are any."""
    campaign = folder.campaign
    kept: dict[str, Any] = {"kind": campaign.keep.kind, "count": 0}
    if campaign.keep.kind == "none":
        return kept
    runs = None
    for row in list_kept(folder, campaign):
        run = int(row["run"])
        if not is_whole(folder, row):
            runs = runs or make_runs(campaign)
            keep_run(folder, campaign, runs, row)
        kept["count"] += 1
        if campaign.keep.kind == "worst":
            kept.setdefault("runs", []).append(run)
        if row["certificate"] not in ("", find_certificate(kept_folder(folder, run))):
            kept.setdefault("other_certificates", []).append(run)
    return kept

"""Makes the results of a campaign from its chunks: runs.csv, kept recordings, manifest.json, report.html."""

import csv
import hashlib
import io
import time
from pathlib import Path

from sls.campaign.engines import EngineError
from sls.campaign.folder import CampaignFolder, DamagedChunk
from sls.campaign.kept import keep_recordings
from sls.campaign.machine import find_difference
from sls.campaign.whole_files import WholeFile, write_whole


def collect(folder: CampaignFolder, engine: str) -> Path:
    """Writes runs.csv and manifest.json from the chunks, the recordings that the campaign keeps, and
    report.html. Only one chunk is in memory at a time while it writes runs.csv. Raises EngineError if
    a chunk is missing or a file cannot be written."""
    folder.take_lock()
    counts, machines, flying_s = {}, {}, 0.0
    table, sha256 = folder.folder / "runs.csv", hashlib.sha256(folder.header)
    outcome = folder.plan.columns.index("outcome")
    with WholeFile(table) as writing:
        writing.write(folder.header)
        for number, first, last in folder.chunks:
            try:
                chunk = folder.read_whole_chunk(number)
            except DamagedChunk as defect:
                raise EngineError(f"{folder.chunk_file(number)}: expected runs {first}-{last}, "
                                  f"got: {defect}; --resume flies them again") from None
            sha256.update(chunk.rows)
            writing.write(chunk.rows)
            for cells in csv.reader(io.StringIO(chunk.rows.decode())):
                counts[cells[outcome]] = counts.get(cells[outcome], 0) + 1
            flying_s += chunk.flown["wall_s"]
            machine = machines.setdefault(chunk.flown["host"], {**chunk.flown["machine"],
                                                                "chunks": 0})
            machine["chunks"] += 1
        writing.finish()
    plan = folder.plan
    folder.write_manifest({
        "campaign": plan.campaign, "campaign_sha256": plan.sha256, "file": plan.file,
        "engine": engine, "runs": plan.last - plan.first + 1, "first": plan.first,
        "last": plan.last, "campaign_runs": plan.campaign_runs,
        "complete": plan.last - plan.first + 1 == plan.campaign_runs,
        "outcomes": dict(sorted(counts.items())), "runs_csv_sha256": sha256.hexdigest(),
        "machines": dict(sorted(machines.items())),
        "other_machines": any(find_difference(plan.machine, {
            name: value for name, value in machine.items() if name != "chunks"})
            for machine in machines.values()),
        "versions": plan.machine, "flying_s": round(flying_s, 3),
        "collected_utc": time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime()),
        "kept": keep_recordings(folder),
    })
    write_report(folder.folder)
    return table


def write_report(folder: Path) -> None:
    """Writes report.html of the campaign in `folder`. Raises InputError, EngineError."""
    from sls.campaign.report import make_campaign_report  # its imports take most of a second
    write_whole(folder / "report.html", make_campaign_report(folder).encode())

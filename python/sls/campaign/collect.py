"""Makes the results of a campaign from its chunks: runs.csv, kept recordings, manifest.json, report.html."""

import csv
import hashlib
import io
import re
import time
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

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
    counts, machines, flying_s = Counter(), Counter(), 0.0
    table, sha256 = folder.folder / "runs.csv", hashlib.sha256(folder.header)
    outcome, failures = folder.plan.columns.index("outcome"), MeasureFailures(folder)
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
                counts[cells[outcome]] += 1
                failures.add(cells)
            flying_s += chunk.flown["wall_s"]
            machines[chunk.flown["host"], tuple(sorted(chunk.flown["machine"].items()))] += 1
        writing.finish()
    plan = folder.plan
    folder.write_manifest({
        "campaign": plan.campaign, "campaign_sha256": plan.sha256, "file": plan.file,
        "engine": engine, "runs": plan.last - plan.first + 1, "first": plan.first,
        "last": plan.last, "campaign_runs": plan.campaign_runs,
        "complete": plan.last - plan.first + 1 == plan.campaign_runs,
        "outcomes": dict(sorted(counts.items())), "runs_csv_sha256": sha256.hexdigest(),
        "machines": name_machines(machines),
        "other_machines": any(find_difference(plan.machine, dict(machine)) for _, machine in machines),
        "versions": plan.machine, "flying_s": round(flying_s, 3),
        "collected_utc": time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime()),
        "kept": keep_recordings(folder), **failures.to_manifest(),
    })
    write_report(folder.folder)
    return table


class MeasureFailures:
    """Counts the runs in which each own measure raised, from `own_error` of the rows."""

    def __init__(self, folder: CampaignFolder):
        functions = [own.function for own in folder.campaign.own_measures]
        self.patterns = {name: re.compile(rf"(?:^|; ){name}: (.*?)(?:; |$)") for name in functions}
        self.column = folder.plan.columns.index("own_error") if functions else 0
        self.counts: Counter[str] = Counter()
        self.first: dict[str, str] = {}

    def add(self, cells: Sequence[str]) -> None:
        for name, pattern in self.patterns.items():
            if found := pattern.search(cells[self.column]):
                self.counts[name] += 1
                self.first.setdefault(name, found[1])

    def to_manifest(self) -> dict[str, Any]:
        return {"own_errors": {name: {"runs": count, "first": self.first[name]}
                               for name, count in sorted(self.counts.items())}} if self.counts else {}


def describe_broken_measures(manifest: dict[str, Any]) -> str:
    """The own measures that raised in every run, with their first errors, in one line; empty if there are
    none."""
    return "; ".join(f"measure {name}: expected a value of at least one run, got an error in each of "
                     f"{manifest['runs']}, first: {found['first']}"
                     for name, found in manifest.get("own_errors", {}).items()
                     if found["runs"] == manifest["runs"])


def name_machines(machines: Counter) -> dict[str, dict[str, Any]]:
    """Description and number of chunks of each machine. A host that was described in several ways, as after
    a new version of a library, has a name for each: `n1`, `n1 (2)`."""
    named: dict[str, dict[str, Any]] = {}
    for (host, machine), chunks in sorted(machines.items()):
        place = 1 + sum(other == host for other, description in machines
                        if (other, description) < (host, machine))
        named[host if place == 1 else f"{host} ({place})"] = {**dict(machine), "chunks": chunks}
    return named


def write_report(folder: Path) -> None:
    """Writes report.html of the campaign in `folder`. Raises InputError, EngineError."""
    from sls.campaign.report import make_campaign_report  # its imports take most of a second
    write_whole(folder / "report.html", make_campaign_report(folder).encode())

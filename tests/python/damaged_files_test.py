"""Damages recordings and campaign folders at random, by seed: every reader gives a result or an error of one line.
SLS_DAMAGES is how often (default: 100 of each)."""

import contextlib
import io
import os
import random
import re
import resource
import shutil
import time
import warnings

import campaign_engine_support
import sls
from places import BUILD
from sls import measures
from sls.campaign import cli
from sls.campaign.compare import compare
from sls.campaign.engines import EngineError
from sls.campaign.folder import CampaignFolder, DamagedChunk
from sls.campaign.kept import find_certificate
from sls.campaign.report import make_campaign_report
from sls.errors import ConfigError, RunError
from sls.report import make_cable_section, make_error_table, make_events, make_facts, make_head, make_step_section

DAMAGES = int(os.environ.get("SLS_DAMAGES", "100"))
ERRORS = (ConfigError, RunError, EngineError, DamagedChunk)
WORDS = [*"[]{}:,-'\"\n\t #&*!|>%@?0", "[]", "{}", "null", "true", '""', '"x"', "nan", "-inf", "-1", "0.5", "1e308", "1e999",
         "1e-320", str(10**15), "9" * 30, "9" * 5000, "010", "0x1F", "~", "[" * 3000, "&a [*a]", '"\\ud800"', '"\\UFFFFFFFF"',
         "\x00", "\x85", "\udc80", "é", "---\n", "\r\n", "1,2,3", "{x: 1}"]


def damage_text(draw, text):
    """A word or a piece less, another one in its place, or the same again."""
    places = [match.span() for match in re.finditer(r"[^\s,:\[\]{}]+|[,:\n]", text)] or [(0, 0)]
    begin, end = draw.choice(places)
    if draw.random() < 0.2:
        end = min(len(text), begin + draw.randrange(1, 400))
    return text[:begin] + draw.choice(["", text[begin:end] * 2, *draw.choices(WORDS, k=6)]) + text[end:]


def damage_file(draw, file):
    if draw.random() > 0.1:
        text = file.read_bytes().decode(errors="surrogateescape")
        for _ in range(draw.choice((1, 1, 3))):
            text = damage_text(draw, text)
        file.write_bytes(text.encode(errors="surrogateescape"))
        return
    size = 2**20 if file.suffix == ".csv" else 2**40
    file.unlink()
    draw.choice([lambda: None, file.mkdir, lambda: os.mkfifo(file), lambda: file.symlink_to("/dev/zero"),
                 lambda: file.symlink_to(file.name), file.touch, lambda: (file.touch(), os.truncate(file, size))])()


class DamagedFilesTest(campaign_engine_support.CampaignTest):
    core = BUILD / "python"

    def read_all(self, whole, files, readers):
        """Damages copies of the folder `whole` and calls each reader."""
        for reader in readers:
            with contextlib.suppress(*ERRORS):
                reader(whole)  # the modules are loaded
        before, refused = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, 0
        for seed in range(DAMAGES):
            draw, copy = random.Random(seed), self.folder / f"copy-{seed}"
            shutil.copytree(whole, copy)
            damage_file(draw, copy / draw.choice(files))
            for number, reader in enumerate(readers):
                begin = time.monotonic()
                with self.subTest(f"seed {seed}, reader {number}"), warnings.catch_warnings():
                    warnings.simplefilter("ignore")
                    try:
                        with contextlib.redirect_stdout(io.StringIO()):
                            reader(copy)
                    except ERRORS as error:
                        refused += 1
                        self.assertNotIn("\n", str(error))
                        str(error).encode()
                    self.assertLess(time.monotonic() - begin, 10)
            shutil.rmtree(copy)
        self.assertGreater(refused, DAMAGES / 4)
        self.assertLess(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before, 200_000)  # KiB

    def test_recordings(self):
        def read(folder):
            recording = sls.Recording(folder)
            flight, fleet = recording.load_flight(0, "r"), recording.load_fleet()
            recording.load_seen(1, "r")
            page = [make_head(recording, flight, "r"), make_facts(recording, flight, 0), make_error_table(flight),
                    make_step_section(flight), make_cable_section(fleet), make_events(recording)]
            "".join(page).encode()

        def measure(name):
            return lambda folder: measures.measure(sls.Recording(folder), name, vehicle_id=0)

        mission = [{"set_point": {"position_m": [0, 0, -1]}, "for_s": 0.2},
                   {"figure_eight": {"amplitude_m": [0.1, 0.1, 0], "period_s": 0.4}, "for_s": 0.8}]
        whole = self.folder / "whole"
        sls.fly(sls.load_scenario("two_carry_a_bar", mission=mission)).save(whole)
        self.read_all(whole, ["manifest.json", "scenario.yaml", "status.csv"] * 3 + ["state.csv", "reference.csv"],
                      [read, *map(measure, measures.MEASURES), lambda folder: sls.Recording(folder).verify(),
                       lambda folder: sls.Recording(folder).compare(sls.Recording(whole)), find_certificate])

    def test_campaign_folders(self):
        self.write_campaign(12)
        noise = {"noise": {"on": "command", "force_n": [0.05, 0.05, 0.05], "seed": 0}}
        self.write("base.yaml", sls.load_scenario("short", faults=[noise]).text)
        self.fly("campaign.yaml", "--out", "whole", "--chunk-runs", 5)
        whole = self.folder / "whole"

        def read(folder):
            opened = CampaignFolder(folder)
            opened.refuse_foreign(CampaignFolder(whole).campaign, True)
            return list(opened.read_rows()), opened.read_row(opened.plan.last), opened.missing(), opened.campaign

        self.read_all(whole, ["plan.json", "manifest.json", "campaign.yaml", "base.yaml", "runs.csv",
                              "chunks/chunk-000001.csv"],
                      [make_campaign_report, lambda folder: cli.describe_status(CampaignFolder(folder)), read,
                       lambda folder: compare(whole, folder), lambda folder: compare(folder, whole)])

"""Damages recordings and campaign folders at random, by seed: every reader gives a result or an error of one line.
SLS_DAMAGES is how often (default: 120 of each)."""

import contextlib
import io
import json
import os
import random
import re
import resource
import shutil
import sys
import time
import warnings

from places import BUILD

import campaign_engine_support
import sls
from sls import measures
from sls.campaign import cli
from sls.campaign.compare import compare
from sls.campaign.engines import EngineError
from sls.campaign.folder import CampaignFolder, DamagedChunk
from sls.campaign.kept import find_certificate
from sls.campaign.report import make_campaign_report
from sls.errors import ConfigError, RunError
from sls.report import make_cable_section, make_error_table, make_events, make_facts, make_head, make_step_section

DAMAGES = int(os.environ.get("SLS_DAMAGES", "120"))
ERRORS = (ConfigError, RunError, EngineError, DamagedChunk)
VALUES = [None, True, -1, 0, 1, 0.5, 10**15, 10**400, 1e308, -1e-300, "", "x", "\udc80", "010", "é\n", [], {}, [[]], [{}],
          {"": None}, [0] * 300, ["x"], "nan", "1e999"]
WORDS = [*"[]{}:,-'\"\n\t #&*!|>%@?", "nan", "-inf", "1e999", "9" * 30, "9" * 5000, "010", "0x1F", "null", "~", "[" * 3000,
         "&a [*a]", '"\\ud800"', '"\\UFFFFFFFF"', "\x00", "\x85", "é", "---\n", "1e-320", "-0", "true", "\r\n", '""']


def damage_json(draw, text):
    """Another value in place of one, or a key less."""
    root = json.loads(text)
    node, key = {"": root}, ""
    while isinstance(node[key], dict | list) and node[key] and draw.random() < 0.8:
        node = node[key]
        key = draw.choice(list(node)) if isinstance(node, dict) else draw.randrange(len(node))
    node[key] = draw.choice(VALUES)
    return json.dumps(root)


def damage_text(draw, text):
    """A word or a piece less, another one in its place, or a piece of it again."""
    places = [match.span() for match in re.finditer(r"[^\s,:\[\]{}]+|[,:\n]", text)] or [(0, 0)]
    begin, end = draw.choice(places)
    if draw.random() < 0.2:
        end = min(len(text), begin + draw.randrange(1, 400))
    return text[:begin] + draw.choice(["", text[begin:end] * 2, *draw.choices(WORDS, k=3)]) + text[end:]


def damage_file(draw, file):
    kind = draw.random()
    if kind < 0.08:
        file.unlink()
        draw.choice([lambda: None, file.mkdir, lambda: os.mkfifo(file), lambda: file.symlink_to("/dev/zero"),
                     lambda: file.symlink_to(file.name), lambda: file.write_bytes(b""),
                     lambda: (file.write_bytes(b"\n"), os.truncate(file, 2**40 if file.suffix != ".csv" else 2**20))])()
        return
    data = file.read_bytes()
    if kind < 0.2:
        place = draw.randrange(len(data) + 1)
        data = draw.choice([data[:place], data[:place] + bytes([draw.randrange(256)]) + data[place + 1:]])
    else:
        change = damage_json if file.suffix == ".json" and kind < 0.8 else damage_text
        for _ in range(draw.choice((1, 1, 3))):
            with contextlib.suppress(json.JSONDecodeError):
                data = change(draw, data.decode()).encode(errors="surrogatepass")
    file.write_bytes(data)


class DamagedFilesTest(campaign_engine_support.CampaignTest):
    core = BUILD / "python"

    def read_all(self, whole, files, readers):
        """Damages copies of the folder `whole` and calls each reader, while the others may fail."""
        for reader in readers:
            with contextlib.suppress(*ERRORS):
                reader(whole)  # the modules are loaded
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        copy, refused = self.folder / "copy", 0
        for seed in range(DAMAGES):
            draw = random.Random(seed)
            shutil.rmtree(copy, ignore_errors=True)
            shutil.copytree(whole, copy)
            damage_file(draw, copy / draw.choice(files))
            for number, reader in enumerate(readers):
                begin = time.monotonic()
                with self.subTest(f"seed {seed}, reader {number}"), io.StringIO() as said:
                    try:
                        with warnings.catch_warnings(), contextlib.redirect_stdout(said):
                            warnings.simplefilter("ignore")
                            reader(copy)
                    except ERRORS as error:
                        refused += 1
                        self.assertNotIn("\n", str(error))
                        str(error).encode()
                    self.assertLess(time.monotonic() - begin, 10)
        self.assertGreater(refused, DAMAGES / 4)
        self.assertLess(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before, 200_000)

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
        flight = sls.fly(sls.load_scenario("two_carry_a_bar", mission=mission))
        flight.save(self.folder / "whole")
        files = ["manifest.json", "scenario.yaml", "status.csv"] * 3 + ["state.csv", "command.csv", "reference.csv"]
        self.read_all(self.folder / "whole", files, [
            read, *map(measure, measures.MEASURES), lambda folder: sls.Recording(folder).verify(),
            lambda folder: sls.Recording(folder).compare(sls.Recording(self.folder / "whole")),
            find_certificate])

    def test_campaign_folders(self):
        self.write_campaign(12, extra="keep: failed\n")
        noise = {"noise": {"on": "command", "force_n": [0.05, 0.05, 0.05], "seed": 0}}
        self.write("base.yaml", sls.load_scenario("short", faults=[noise]).text)
        self.fly("campaign.yaml", "--out", "whole", "--chunk-runs", 5)
        whole = self.folder / "whole"

        def resume(folder):
            opened = CampaignFolder(folder)
            opened.refuse_foreign(CampaignFolder(whole).campaign, True)
            return list(opened.read_rows()), opened.read_row(opened.plan.last), opened.missing(), opened.campaign

        self.read_all(whole, ["plan.json", "manifest.json", "campaign.yaml", "base.yaml", "runs.csv",
                              "chunks/chunk-000001.csv"], [
            make_campaign_report, lambda folder: cli.describe_status(CampaignFolder(folder)), resume,
            lambda folder: compare(whole, folder), lambda folder: compare(folder, whole)])

"""Damages recordings, campaign folders and the files that users write at random, by seed: every reader gives a result
or an error of one line, within 10 s and 200 MB. SLS_DAMAGES is how often (default: 100; 25 for the programs)."""

import contextlib
import io
import itertools
import os
import random
import re
import resource
import shutil
import subprocess
import time
import warnings

import campaign_engine_support
import sls
from own_domain import own_domain
from places import BUILD, ROOT
from sls import measures
from sls.campaign import cli
from sls.campaign.campaign_file import load_campaign
from sls.campaign.check import check_campaign
from sls.campaign.compare import compare
from sls.campaign.engines import EngineError
from sls.campaign.folder import CampaignFolder, DamagedChunk
from sls.campaign.kept import find_certificate
from sls.campaign.report import make_campaign_report
from sls.campaign.runs import make_runs
from sls.check.check_file import load_check
from sls.check.judge import judge
from sls.errors import ConfigError, RunError
from sls.published_logs import load_log
from sls.report import make_cable_section, make_error_table, make_events, make_facts, make_head, make_step_section
from sls.scenario import read_keys

DAMAGES = int(os.environ.get("SLS_DAMAGES", "100"))
ERRORS = (ConfigError, RunError, EngineError, DamagedChunk)
WORDS = [*"[]{}:,-'\"\n\t #&*!|>%@?0", "[]", "{}", "null", "true", '""', '"x"', "nan", "-inf", "-1", "0.5", "1e308", "1e999",
         "1e-320", str(10**15), "9" * 30, "9" * 5000, "010", "0x1F", "~", "[" * 3000, "&a [*a]", '"\\ud800"', '"\\UFFFFFFFF"',
         "\x00", "\x85", "\udc80", "é", "---\n", "\r\n", "1,2,3", "{x: 1}", "\ufeff", "\x1b[31m", "\x9b", str(2**31),
         str(2**64), "1e15", "1e9", "1e-9", "<a>" * 3000, "<!--", "&#27;", "${x", "/dev/zero", "A" * 100_000, "1_000",
         "1:30", "!!python/object:os.system", "<<", "on"]
ENCODINGS = [lambda text: text.encode("utf-16", "replace"), lambda text: text.encode("utf-8-sig", "replace"),
             lambda text: text.replace("\n", "\r\n").encode("utf-8", "replace"),
             lambda text: text.replace("\n", "\r").encode("utf-8", "replace")]


def damage_text(draw, text):
    """A word or a piece less, another one in its place, or the same again."""
    places = [match.span() for match in re.finditer(r"[^\s,:\[\]{}]+|[,:\n]", text)] or [(0, 0)]
    begin, end = draw.choice(places)
    if draw.random() < 0.2:
        end = min(len(text), begin + draw.randrange(1, 400))
    return text[:begin] + draw.choice(["", text[begin:end] * 2, *draw.choices(WORDS, k=6)]) + text[end:]


def damage_lines(draw, text):
    """A line less, twice, often or elsewhere, or none after it."""
    lines = text.splitlines(keepends=True) or [""]
    first, second = draw.randrange(len(lines)), draw.randrange(len(lines))
    line = lines.pop(first)
    lines[second:second] = draw.choice(([], [line], [line] * 2, [line] * 1000))
    return "".join(lines[:first] if draw.random() < 0.1 else lines)


def damage_bits(draw, text):
    data = bytearray(text.encode(errors="surrogateescape") or b"0")
    data[draw.randrange(len(data))] ^= 1 << draw.randrange(8)
    return bytes(data).decode(errors="surrogateescape")


def damage_file(draw, file):
    if draw.random() > 0.1:
        text = file.read_bytes().decode(errors="surrogateescape")
        for _ in range(draw.choice((1, 1, 3))):
            text = draw.choice((damage_text, damage_text, damage_lines, damage_bits))(draw, text)[:2**22]  # memory
        encode = draw.choice(ENCODINGS) if draw.random() < 0.03 else lambda text: text.encode(errors="surrogateescape")
        file.write_bytes(encode(text))
        return
    size = 2**20 if file.suffix == ".csv" else 2**40
    file.unlink()
    draw.choice([lambda: None, file.mkdir, lambda: os.mkfifo(file), lambda: file.symlink_to("/dev/zero"),
                 lambda: file.symlink_to(file.name), file.touch, lambda: (file.touch(), os.truncate(file, size))])()


class DamagedFilesTest(campaign_engine_support.CampaignTest):
    core = BUILD / "python"

    def read_all(self, whole, files, readers, damages=DAMAGES):
        """Damages copies of the folder `whole` and calls each reader; those of the file if `readers` is a map."""
        of_file = readers if isinstance(readers, dict) else dict.fromkeys(files, readers)
        for reader in set(itertools.chain(*of_file.values())):
            with contextlib.suppress(*ERRORS):
                reader(whole)  # the modules are loaded
        before, refused = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, 0
        opened = os.listdir("/proc/self/fd")
        for seed in range(damages):
            draw, copy = random.Random(seed), self.folder / f"copy-{seed}"
            shutil.copytree(whole, copy)
            name = draw.choice(files)
            damage_file(draw, copy / name)
            for number, reader in enumerate(of_file[name]):
                begin = time.process_time()  # others may keep the machine busy; the test's limit ends one that waits
                with self.subTest(f"seed {seed}, {name}, reader {number}"), warnings.catch_warnings():
                    warnings.simplefilter("ignore")
                    try:
                        with contextlib.redirect_stdout(io.StringIO()):
                            reader(copy)
                    except ERRORS as error:
                        refused += 1
                        self.assertNotIn("\n", str(error))
                        str(error).encode()
                    self.assertLess(time.process_time() - begin, 10)
            shutil.rmtree(copy)
        self.assertEqual(os.listdir("/proc/self/fd"), opened)
        self.assertGreater(refused, damages / 4)
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

    def test_files(self):
        """Files that users write: scenarios, checks, campaigns, published logs."""
        whole = self.folder / "whole"
        sls.fly(sls.load_scenario("short")).save(self.folder / "flight")
        self.write_campaign(3)
        self.write("whole/scenario.yaml", sls.load_scenario("two_carry_a_bar").text)
        self.write("whole/log.csv", "".join(f"{row * 0.01}" + ",0.5" * 23 + "\n" for row in range(5)))
        for file in (ROOT / "config/checks/two_carry_a_bar.yaml", *self.folder.glob("*.yaml")):
            shutil.copy(file, whole)

        def judge_flight(folder):
            judge(load_check(folder / "two_carry_a_bar.yaml"), sls.Recording(self.folder / "flight"))

        def check_flights(folder):
            campaign = load_campaign(folder / "campaign.yaml")
            check_campaign(campaign, make_runs(campaign))

        readers = {"scenario.yaml": [lambda folder: read_keys(sls.load_scenario(folder / "scenario.yaml"))],
                   "two_carry_a_bar.yaml": [judge_flight], "base.yaml": [check_flights],
                   "campaign.yaml": [check_flights], "log.csv": [lambda folder: load_log(folder / "log.csv", "log")]}
        self.read_all(whole, list(readers), readers)

    def test_programs(self):
        """The programs in C++ end with 0, 1 or 2 and print no controls."""
        whole = self.folder / "whole"
        sls.fly(sls.load_scenario("short")).save(whole / "flight")
        for folder in ("qos", "faults"):
            shutil.copytree(ROOT / "config" / folder, whole / folder)
        subprocess.run([ROOT / "config/security/keys.sh", whole / "keys"], check=True, capture_output=True)
        domain, short = self.enterContext(own_domain()), ROOT / "config/scenarios/short.yaml"

        def start(program, *words):
            def read(folder):
                done = subprocess.run(
                    [BUILD / "bin" / program, *(str(word).replace("DIR", str(folder)) for word in words)],
                    env={**os.environ, "SLS_KEYS": str(folder / "keys"), "SLS_PEERS": "", "SLS_DOMAIN": str(domain)},
                    capture_output=True, stdin=subprocess.DEVNULL, timeout=100,
                    preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (10, 10)))
                said = (done.stdout + done.stderr).decode()
                self.assertIn(done.returncode, (0, 1, 2), said)
                self.assertNotRegex(said, "[\x00-\x09\x0b-\x1f\x7f-\x9f]")
                if done.returncode:
                    raise RunError(said.splitlines()[-1])
            return read

        def start_with(qos):
            return [start("sim_server", "--check", "--scenario", short, "--qos", qos),
                    start("sim_ctl", "status", "--timeout-s", 0.1, "--qos", qos)]

        flight = [start("sls_verify", "DIR/flight"), start("sls_verify", whole / "flight", "DIR/flight"),
                  start("sls_convert", "DIR/flight", "--force"),
                  start("sls_view", "DIR/flight", "--export", "DIR/page.html"),
                  start("recorder", "--check", "--resume", "--out", "DIR/flight")]
        names = ("manifest.json", "scenario.yaml", "status.csv", "state.csv", "command.csv", "reference.csv",
                 "flight.txt")
        readers = dict.fromkeys((f"flight/{name}" for name in names), flight)
        readers["flight/scenario.yaml"] = [*flight, start("sim_server", "--check", "--scenario",
                                                          "DIR/flight/scenario.yaml")]
        secured = start_with(ROOT / "config/qos/secure.xml")[1:]
        readers |= {f"keys/operator/{file.name}": secured for file in sorted((whole / "keys/operator").iterdir())}
        for name in ("default.xml", "udp.xml", "wifi.xml", "discovery_server.xml"):
            readers[f"qos/{name}"] = start_with(f"DIR/qos/{name}")
        for name in ("crash_and_cut.yaml", "network_table.yaml"):
            readers[f"faults/{name}"] = [
                start("sls_worlds", "--seeds=0-0", "--scenario", short, "--faults", f"DIR/faults/{name}")]
        self.read_all(whole, list(readers), readers, DAMAGES if "SLS_DAMAGES" in os.environ else 25)
        self.assertLess(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss, 250_000)  # KiB

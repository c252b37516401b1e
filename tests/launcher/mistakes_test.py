"""A mistake on the command line is one line with place, expected and got, before the build is looked at.

The launcher runs in a small checkout. Stand-ins for what sets up and builds record that they were called."""

import contextlib
import io
import itertools
import json
import os
import pathlib
import pty
import re
import signal
import socket
import subprocess
import sys
import time

import checkout
from folder_test import FolderTest
from own_domain import own_domain
from places import ROOT, launch
from sls import __version__
from sls.launcher import completion, flights, listing
from sls.launcher.commands import FOREIGN, check_words
from sls.launcher.place import Failure, list_names

MISTAKES = {
    "rrun short": "unknown command 'rrun'; did you mean 'run'? (see ./sls help)",
    "frobnicate": "unknown command 'frobnicate' (see ./sls help)",
    "run": "expected a scenario (see ./sls run --help)",
    "run short hover": "expected one scenario, got 'short' and 'hover'",
    "run figure_eigth": "ROOT/config/scenarios/figure_eigth.yaml: expected a scenario, got no such file; did you mean "
                        "'figure_eight'?",
    "demo shotr": "ROOT/config/scenarios/shotr.yaml: expected a scenario, got no such file; did you mean 'short'?",
    "run own/none.yaml": "own/none.yaml: expected a scenario, got no such file",
    "delay-margin zzz": "ROOT/config/scenarios/zzz.yaml: expected a scenario, got no such file",
    "campaign gain": "ROOT/config/campaigns/gain.yaml: expected a campaign, got no such file; did you mean 'gains'?",
    "run short --domian 3": "unknown option '--domian'; did you mean '--domain'? (see ./sls run --help)",
    "run short --resume": "unknown option '--resume' (see ./sls run --help)",
    "run short --domain 233": "--domain: expected 0 to 232, got '233' (see ./sls run --help)",
    "run short --domain one": "--domain: expected 0 to 232, got 'one' (see ./sls run --help)",
    "run short --period-s 4ms": "--period-s: expected a number > 0, got '4ms' (see ./sls run --help)",
    "delay-margin short --vehicle x": "--vehicle: expected 0 to 255, got 'x' (see ./sls delay-margin --help)",
    "delay-margin short --period-s 0": "--period-s: expected a number > 0, got '0' (see ./sls delay-margin --help)",
    "run short --mode real-time": "--mode: expected lockstep or realtime, got 'real-time' (see ./sls run --help)",
    "run short --rtf -1": "--rtf: expected a number > 0 and <= 1000, got '-1' (see ./sls run --help)",
    "run short --out": "--out: expected a value (see ./sls run --help)",
    "run short --out=": "--out: expected a folder, got '' (see ./sls run --help)",
    "run short --force=1": "--force: expected no value, got '1' (see ./sls run --help)",
    "run short --view-port 65536": "--view-port: expected 0 to 65535, got '65536' (see ./sls run --help)",
    "run short --in-process --domain 3": "--in-process: expected no --qos, --domain, --mode, --rtf or --view with it: "
                                         "one process has no network and no clock",
    "ctl paus": "ctl: expected pause, step, resume, start, reset, stop or status, got 'paus'; did you mean 'pause'?",
    "view --prot 1": "unknown option '--prot'; did you mean '--port'? (see ./sls view --help)",
    "verify a b --quiet": "unknown option '--quiet' (see ./sls verify --help)",
    "campaign gains --worker-count 2": "unknown option '--worker-count'; did you mean '--workers'? "
                                       "(see ./sls campaign --help)",
    "discovery-server --port 0": "--port: expected 1 to 65535, got '0' (see ./sls discovery-server --help)",
    "test --sanitize addr": "--sanitize: expected address or thread, got 'addr' (see ./sls test --help)",
    "build everything": "build: expected no argument, got 'everything' (see ./sls build --help)",
    "report many": "many: expected a recording, got a folder of 1; the newest: many/a",
    "verify a many": "many: expected a recording, got a folder of 1; the newest: many/a",
    "fuzz --target cvs": "--target: expected scenario, faults, qos_file, csv, recording, samples, foxglove or web, got 'cvs' (see ./sls fuzz "
                         "--help)",
}


class MistakesTest(checkout.CheckoutTest):
    maxDiff = None
    parts = ("config", "docs/reference", "python/sls/check", "python/sls/errors.py")

    def setUp(self):
        super().setUp()
        for name in ("cmake", "ninja", "dpkg-query", "apt-get", "node", "npm"):
            self.stand_in(name, "exit 1")
        self.write("many/a/manifest.json", "{}")

    def launch(self, *words, **variables):
        return subprocess.run([self.root / "sls", *words], cwd=self.folder, env={**self.environment, **variables},
                              capture_output=True, text=True, timeout=60, check=False)

    def expect_refused(self, line, *words, **variables):
        done = self.launch(*words, **variables)
        self.assertEqual((done.returncode, done.stdout, done.stderr.replace(str(self.root), "ROOT")),
                         (2, "", f"sls: error: {line}\n"))
        self.assertFalse(self.calls.exists(), "looked at the build")

    def test_each_mistake_is_one_line_before_the_build(self):
        for words, line in MISTAKES.items():
            with self.subTest(words):
                self.expect_refused(line, *words.split())

    def test_a_bad_variable_is_named(self):
        self.expect_refused("SLS_DOMAIN: expected 0 to 232, got 'abc'", "run", "short", SLS_DOMAIN="abc")

    def test_a_folder_without_a_place_for_recordings_is_refused_with_the_option(self):
        self.write("recordings", "a file")
        self.expect_refused("recordings: expected a folder to write in, got none here (--out DIR names another)", "run", "short")

    def test_a_build_without_programs_is_named(self):
        done = subprocess.run([self.root / "sls", "run", "short"], env={**os.environ, "SLS_BUILD": str(self.folder)},
                              capture_output=True, text=True, timeout=60, check=False)
        self.assertEqual((done.returncode, done.stderr),
                         (1, f"sls: error: {self.folder}/bin/sim_server: expected a program, got no such file\n"))

    def test_a_check_whose_programs_cannot_be_built_is_unusable(self):
        self.assertEqual(self.launch("check", "short", "--junit", "junit.xml").returncode, 2)
        self.assertIn('errors="1"', (self.folder / "junit.xml").read_text())

    def test_a_used_port_is_refused_before_the_flight(self):
        with socket.socket() as other:
            other.bind(("127.0.0.1", 0))
            other.listen()
            port = other.getsockname()[1]
            self.expect_refused(f"port of the page: expected a free one, got {port}: another program uses it "
                                "(--view-port 0 takes any free one)", "run", "short", "--view-port", str(port))

    def test_right_words_go_on_to_the_build(self):
        for words in ("run short --view-port 0", "demo", "ctl --domain 3 pause", "view recordings/a --port 0",
                      "campaign gains --runs 0-1", "campaign status campaigns/a", "verify a b"):
            with self.subTest(words):
                self.launch(*words.split())
                self.assertTrue(self.calls.exists())
                self.calls.unlink()

    def test_a_prefix_of_an_option_and_words_after_two_dashes_are_left_to_the_program(self):
        check_words("campaign", ["gains", "--work", "2"])
        check_words("systems", ["--commands", "package", "--", "--x"])
        with self.assertRaises(Failure):
            check_words("systems", ["--x"])

    def test_the_completion_has_a_table_of_every_command_that_is_judged_by_it(self):
        self.assertEqual([name for name in FOREIGN if not completion.read_options(name)], [])


class AnswersTest(FolderTest):
    """What the launcher says itself, with the programs of the build."""

    def test_the_version_is_that_of_cmake(self):
        version = re.search(r"^project\(sls VERSION (\S+)", (ROOT / "CMakeLists.txt").read_text(), re.MULTILINE)[1]
        self.assertEqual(launch("--version").stdout, f"sls {version}\n")
        self.assertEqual(__version__, version)

    def test_the_list_has_every_name_and_fits_the_terminal_but_is_whole_in_a_pipe(self):
        shown = subprocess.run(["script", "-qc", f"stty cols 80; {ROOT}/sls list", "/dev/null"], capture_output=True, text=True).stdout
        self.assertEqual([line for line in shown.splitlines() if len(line) > 80], [])
        said = launch("list").stdout
        self.assertNotIn("…", said)
        names = set(re.findall(r"^  (\S+) {2,}\S", said, re.MULTILINE))
        for file, kind in (("control_client/laws/laws.def", "LAW"), ("sim_server/plants/plants.def", "PLANT")):
            own = set(re.findall(rf"^SLS_{kind}\((\w+)\)", (ROOT / file).read_text(), re.MULTILINE))
            self.assertEqual(own - names, set())
        self.assertEqual({*list_names("scenarios"), *list_names("campaigns")} - names, set())
        self.assertEqual(len(names), sum(map(len, (list_names("scenarios"), list_names("campaigns"), listing.LAWS,
                                                   listing.PLANTS))) - 1)

    def test_every_encoding_and_a_reader_that_has_gone_are_no_error(self):
        ours, theirs = os.pipe()
        os.close(ours)
        for command, encoding, out in itertools.product(("help", "list"), ("ascii", "latin-1", "utf-8"),
                                                        (subprocess.PIPE, theirs)):
            with self.subTest(command, encoding=encoding):
                done = subprocess.run([sys.executable, "-B", ROOT / "python/sls/launcher/__main__.py", command], stdout=out,
                                      stderr=subprocess.PIPE, env={**os.environ, "PYTHONIOENCODING": encoding}, check=False)
                self.assertEqual((done.returncode, done.stderr), (0, b""))
        os.close(theirs)

    def test_two_flights_that_differ_because_of_their_scenarios_are_named_so(self):
        for name in ("short", "mission"):
            launch("run", name, "--in-process", "--out", name, cwd=self.folder)
        done = launch("verify", "short", "mission", cwd=self.folder, code=1)
        self.assertEqual(done.stderr, "sls_verify: error: A and B are flights of different scenarios\n")
        self.assertNotIn("largest difference", done.stdout)

    def test_the_summary_for_machines_is_one_line_of_json(self):
        said = launch("run", "short", "--in-process", "--json", "--out", "r", cwd=self.folder).stdout
        summary = json.loads(said)
        manifest = json.loads((self.folder / "r/manifest.json").read_text())
        self.assertEqual(said.count("\n"), 1)
        self.assertEqual((summary["exit_code"], summary["recording"], summary["complete"]), (0, "r", True))
        self.assertEqual(summary["certificate"], manifest["certificate"])

    def test_a_flight_in_real_time_shows_its_progress_on_a_terminal(self):
        with own_domain() as domain:
            ours, theirs = pty.openpty()
            process = subprocess.Popen(
                [ROOT / "sls", "run", "short", "--mode", "realtime", "--rtf", "0.3", "--domain", str(domain),
                 "--out", f"{self.folder}/r"], stderr=theirs)
            os.close(theirs)
            said = b""
            try:
                while more := os.read(ours, 65536):
                    said += more
            except OSError:  # nobody has the other end open
                pass
            os.close(ours)
            self.assertEqual(process.wait(60), 0, said)
            self.assertRegex(said.decode(), r"sim_server: step \d+: [12] s of simulated time, ")

    def test_the_comparison_with_published_figures_fits_80_columns(self):
        with contextlib.redirect_stdout(io.StringIO()) as said:
            flights.print_comparison(["4.10e-04"] * 5)
        self.assertEqual([line for line in said.getvalue().splitlines() if len(line) > 80], [])
        self.assertRegex(said.getvalue(), r"(?m)^  this flight +(4\.1e-04 *){5}$")

    def test_ctrl_c_in_a_report_is_one_line(self):
        launch("run", "short", "--in-process", "--out", "r", cwd=self.folder)
        for command in ("report", "plot"):
            process = subprocess.Popen([ROOT / "sls", command, "r"], cwd=self.folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
            maps = pathlib.Path(f"/proc/{process.pid}/maps")
            deadline = time.monotonic() + 60
            while "numpy" not in maps.read_text():  # it imports what it needs
                self.assertLess(time.monotonic(), deadline)
                time.sleep(0.001)
            process.send_signal(signal.SIGINT)
            self.assertEqual((*process.communicate(timeout=60), process.returncode), ("", "sls: interrupted\n", 130))

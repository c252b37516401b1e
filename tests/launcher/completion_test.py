"""tools/completion/sls.bash completes command lines in bash with the launcher's commands and the files in folders."""

import os
import pty
import select
import shutil
import subprocess
import time

import checkout
from folder_test import FolderTest
from places import ROOT
from sls.launcher import completion
from sls.launcher.commands import COMMANDS

FILE = ROOT / "tools/completion/sls.bash"

COMPLETE = """
source "$1"; shift
COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1))
_sls
((${#COMPREPLY[@]} == 0)) || printf '%s\\n' "${COMPREPLY[@]}"
"""


def complete(*words, folder=ROOT):
    """The completions of the last word."""
    done = subprocess.run(["bash", "--norc", "-c", COMPLETE, "bash", FILE, *map(str, words)], cwd=folder,
                          capture_output=True, text=True, timeout=60)
    assert done.returncode == 0 and not done.stderr, done.stderr
    return done.stdout.splitlines()


def list_names(folder):
    return {file.stem for file in (ROOT / "config" / folder).glob("*.yaml")}


class Completion(FolderTest):
    def test_knows_every_command_of_the_launcher(self):
        self.assertEqual(set(complete("./sls", "")), set(COMMANDS))
        self.assertEqual(complete("./sls", "ru"), ["run"])

    def test_names_only_commands_that_are_there(self):
        for commands in (completion.NAMES, completion.FOLDERS, completion.SUBCOMMANDS):
            self.assertEqual(set(commands) - set(COMMANDS), set())

    def test_offers_scenarios(self):
        self.assertLessEqual(list_names("scenarios"), set(complete("./sls", "run", "")))
        self.assertEqual(complete("./sls", "run", "figure_eight_"), ["figure_eight_pid"])
        self.assertEqual(complete("./sls", "run", "config/scenarios/figure_eight_"),
                         ["config/scenarios/figure_eight_pid.yaml"])

    def test_offers_campaigns(self):
        self.assertLessEqual(list_names("campaigns"), set(complete("./sls", "campaign", "")))
        self.assertIn("status", complete("./sls", "campaign", "st"))

    def test_offers_options_and_their_values(self):
        self.assertEqual(complete("./sls", "run", "--mo"), ["--mode"])
        self.assertEqual(complete("./sls", "run", "--mode", ""), ["lockstep", "realtime"])
        self.assertEqual(complete("./sls", "run", "--domain", ""), [])
        self.assertEqual(complete("./sls", "run", "--force", "figure_eight_"), ["figure_eight_pid"])
        self.assertEqual(complete("./sls", "plot", "--format", "g"), ["gazebo"])
        self.assertEqual(complete("./sls", "fuzz", "--target", "w"), ["web"])
        self.assertEqual(complete("./sls", "view", "--log-level", "d"), ["debug"])
        self.assertEqual(complete("./sls", "campaign", "--on", "l"), ["local"])
        self.assertIn("--watch", complete("./sls", "ctl", "status", "--"))
        self.assertEqual(complete("./sls", "ctl", "pau"), ["pause"])

    def test_offers_files_and_folders(self):
        self.assertEqual(complete("./sls", "run", "--qos", "config/qos/def"), ["config/qos/default.xml"])
        self.assertEqual(complete("./sls", "verify", "conf"), ["config"])

    def test_offers_what_an_installed_launcher_finds(self):
        root = self.folder / "share/sls"
        for name in ("sls", "python/sls/__init__.py", "python/sls/launcher"):
            checkout.copy(name, root)
        (root / "config/scenarios").mkdir(parents=True)
        (root / "config/scenarios/installed_one.yaml").touch()
        self.assertEqual(complete(root / "sls", "run", "installed", folder=self.folder), ["installed_one"])
        self.assertEqual(complete(root / "sls", "run", "--mo"), [])
        page = root.parent / "doc/sls/docs/reference/commands.md"
        page.parent.mkdir(parents=True)
        shutil.copy(ROOT / "docs/reference/commands.md", page)
        self.assertEqual(complete(root / "sls", "run", "--mo"), ["--mode"])

    def test_answers_at_once_and_builds_and_installs_nothing(self):
        def complete_run():
            began = os.times()
            self.assertEqual(complete("./sls", "run", "--mo"), ["--mode"])
            ended = os.times()
            return ended.children_user + ended.children_system - began.children_user - began.children_system

        self.assertLess(min(complete_run() for _ in range(3)), 0.3)  # s of the processor
        done = subprocess.run([ROOT / "sls", "--no-install", "@complete", "ctl", "--log-level", ""], cwd=ROOT, text=True,
                              capture_output=True, env={**os.environ, "PATH": "/nowhere:/usr/bin:/bin"}, check=True)
        self.assertEqual((done.stdout.split(), done.stderr), (["debug", "info", "warning", "error"], ""))

    def test_is_used_by_an_interactive_bash(self):
        typed = f"source {FILE}\n./sls discovery-s\tX\n"
        process, terminal = pty.fork()
        if process == 0:
            os.chdir(ROOT)
            os.execvpe("bash", ["bash", "--norc", "--noprofile", "-i"], dict(os.environ, TERM="dumb", HISTFILE=""))
        shown, deadline = b"", time.monotonic() + 30
        try:
            os.write(terminal, typed.encode())
            while b"./sls discovery-server X" not in shown and time.monotonic() < deadline:
                if select.select([terminal], [], [], 0.2)[0]:
                    shown += os.read(terminal, 65536)
        finally:
            os.close(terminal)  # ends the bash by SIGHUP
            os.waitpid(process, 0)
        self.assertIn(b"./sls discovery-server X", shown)

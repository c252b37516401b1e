"""The supervision of the programs of a flight, with stand-ins: a flight ends whatever its programs do."""

import os
import pathlib
import signal
import subprocess

from folder_test import FolderTest
from processes import wait_until
from sls.launcher.supervision import WRITERS_PATIENCE_S, Supervisor

# A launcher that starts stand-ins.
LAUNCHER = """
import sys
from sls.launcher.supervision import Supervisor
with Supervisor(overrun_s={overrun}) as supervisor:
    for name, script in {programs!r}.items():
        supervisor.start(name, ["/bin/sh", "-c", script], patience_s={patience})
    code = supervisor.wait_all()
sys.exit(code)
"""
LIMIT_S = 60


class SupervisionTest(FolderTest):
    def start(self, patience=30.0, overrun=60.0, **programs):
        """Each program writes its process id into NAME.pid when it is ready."""
        scripts = {name: script.replace("READY", f"echo $$ >{self.folder}/{name}.new; "
                                                 f"mv {self.folder}/{name}.new {self.folder}/{name}.pid")
                   for name, script in programs.items()}
        launcher = subprocess.Popen(
            ["/usr/bin/python3", "-B", "-c", LAUNCHER.format(programs=scripts, patience=patience, overrun=overrun)],
            stderr=subprocess.PIPE, text=True, start_new_session=True)
        self.addCleanup(self.kill, launcher)
        for name, script in programs.items():
            if "READY" in script:
                wait_until((self.folder / f"{name}.pid").exists, LIMIT_S, f"{name} starts")
        return launcher

    def kill(self, launcher):
        try:
            os.killpg(launcher.pid, signal.SIGKILL)
        except ProcessLookupError:
            pass
        launcher.stderr.close()

    def wait_for_state(self, process, state):
        stat = pathlib.Path(f"/proc/{process}/stat")
        wait_until(lambda: stat.read_text().rpartition(")")[2].split()[0] == state, LIMIT_S, f"state {state}")

    def find(self, name):
        return int((self.folder / f"{name}.pid").read_text())

    def expect_end(self, launcher, code, *lines):
        _, said = launcher.communicate(timeout=LIMIT_S)
        self.assertEqual((launcher.returncode, said.splitlines()), (code, list(lines)))
        for file in self.folder.glob("*.pid"):
            self.assertFalse(pathlib.Path("/proc", file.read_text().strip()).exists(), file.name)

    def test_all_programs_that_end_well_are_a_run_that_ended_well(self):
        self.expect_end(self.start(one="exit 0", two="sleep 0.1"), 0)

    def test_a_program_that_fails_ends_the_others(self):
        self.expect_end(self.start(one="READY; exec sleep 100", two="READY; exec sleep 100",
                                   three=f"cd {self.folder}; until [ -e one.pid -a -e two.pid ]; do sleep 0.02; done; exit 3"),
                        1, "sls: three ended with 3: ending the others")

    def test_bad_usage_of_a_program_is_bad_usage_of_the_run(self):
        self.expect_end(self.start(one="exit 2"), 2)

    def test_programs_that_are_killed_together_end_the_run(self):
        launcher = self.start(one="READY; exec sleep 100", two="READY; exec sleep 100", three="READY; exec sleep 100")
        os.kill(launcher.pid, signal.SIGSTOP)  # so that it sees all ends at once
        self.wait_for_state(launcher.pid, "T")
        for name in ("one", "two", "three"):
            os.kill(self.find(name), signal.SIGKILL)
            self.wait_for_state(self.find(name), "Z")
        os.kill(launcher.pid, signal.SIGCONT)
        self.expect_end(launcher, 1, "sls: one ended with 137 (SIGKILL: killed, perhaps because memory ran out)")

    def test_a_crash_and_a_full_shared_memory_are_named(self):
        self.expect_end(self.start(one="kill -SEGV $$", two="exec sleep 100"), 1,
                        "sls: one ended with 139 (SIGSEGV): ending the others")
        self.expect_end(self.start(one="kill -BUS $$"), 1,
                        "sls: one ended with 135 (SIGBUS: is /dev/shm full? (./sls doctor, docs/networks.md))")
        self.expect_end(self.start(one="kill -ABRT $$"), 1,
                        "sls: one ended with 134 (SIGABRT: an assertion of a library, mostly of Fast DDS: see the "
                        "lines above)")

    def test_a_program_that_ends_well_before_the_flight_is_over_ends_the_run(self):
        self.expect_end(self.start(overrun=0.3, one="exit 0", two="READY; exec sleep 100"), 1,
                        "sls: one ended, but two did not within 0.3 s: ending the others")
        with Supervisor(self.fail, overrun_s=0.1) as supervisor:  # unless it writes files
            supervisor.start("one", ["true"])
            supervisor.start("recorder", ["sleep", "0.5"], WRITERS_PATIENCE_S)
            self.assertEqual(supervisor.wait_all(), 0)

    def test_interrupts_are_passed_on_and_are_the_exit_code(self):
        for number, passed_on, code in ((signal.SIGINT, "INT", 130), (signal.SIGTERM, "TERM", 143),
                                        (signal.SIGHUP, "TERM", 143)):
            with self.subTest(number):
                for file in self.folder.glob("*.pid"):
                    file.unlink()
                loop = f"trap 'touch {self.folder}/got{int(number)}; exit 7' {passed_on}; READY; while :; do sleep 0.05; done"
                launcher = self.start(one=loop, two=loop)
                os.kill(launcher.pid, number)
                self.expect_end(launcher, code)
                self.assertTrue((self.folder / f"got{int(number)}").exists())

    def test_interrupts_of_the_whole_group_end_the_run(self):
        launcher = self.start(one="READY; exec sleep 100", two="READY; exec sleep 100")
        os.killpg(launcher.pid, signal.SIGINT)  # as a terminal does
        self.expect_end(launcher, 130)

    def test_a_program_that_ignores_the_signal_is_killed_and_named(self):
        loop = "trap '' TERM INT; READY; while :; do sleep 0.05; done"
        launcher = self.start(patience=0.3, one=loop, two="READY; exec sleep 100")
        os.kill(launcher.pid, signal.SIGTERM)
        self.expect_end(launcher, 143, "sls: one did not end 0.3 s after the stop signal: killed")

    def test_a_killed_launcher_leaves_no_program(self):
        launcher = self.start(one="READY; exec sleep 100")
        launcher.kill()
        launcher.wait(LIMIT_S)
        wait_until(lambda: not pathlib.Path("/proc", str(self.find("one"))).exists(), LIMIT_S, "the program ends")

    def test_an_error_of_the_launcher_leaves_no_program(self):
        with self.assertRaises(ValueError), Supervisor() as supervisor:
            supervisor.start("one", ["sleep", "100"])
            running = supervisor._running[0].process.pid
            raise ValueError
        self.assertFalse(pathlib.Path("/proc", str(running)).exists())

    def test_a_program_beside_the_run_changes_nothing_and_ends_with_it(self):
        said, lines = [], {"exit 3": ["page ended with 3: the flight goes on"], "exec sleep 100": []}
        for script, expected in lines.items():
            said.clear()
            with Supervisor(said.append) as supervisor:
                supervisor.start_beside("page", ["/bin/sh", "-c", script])
                supervisor.start("one", ["sleep", "0.1"])
                self.assertEqual(supervisor.wait_all(), 0)
            self.assertEqual(said, expected)

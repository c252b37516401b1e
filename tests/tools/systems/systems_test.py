"""`./sls systems` in small: a small checkout, and a stand-in for debootstrap that fills a tree with programs of this
machine. The commands in the tree, the limits, the cleaning up and the namespaces are real. Needs root and namespaces."""

import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest
import unittest.mock

from places import ROOT
from processes import wait_until

sys.path.insert(0, str(ROOT / "tools/systems"))
import tree  # noqa: E402

HAS_NAMESPACES = os.geteuid() == 0 and subprocess.run(
    ["unshare", "--mount", "--pid", "--fork", "--mount-proc", "true"], check=False).returncode == 0
LIMIT_S = 200  # for what takes seconds on an idle machine
PROGRAMS = ("bash", "cat", "chroot", "env", "ls", "mkdir", "mount", "sh", "sleep", "touch", "true", "sed", "unshare")
DEBOOTSTRAP = """#!/bin/sh
# debootstrap --variant=minbase CODENAME FOLDER MIRROR
echo "$2" >>CALLS
cp -a BASE "$3"
"""
DEMO = """#!/bin/bash
case $1 in
  demo)
    mkdir -p recordings/demo
    echo '{"certificate": "0123456789abcdef0123"}' >recordings/demo/manifest.json
    cat changed
    ls /proc >/sls/processes
    unshare --mount --propagation private true || echo no namespaces
    echo $$ >/dev/shm/sls_systems_test
    env ;;
  test) mkdir -p build; cat >build/test.xml <<'EOF'
<testsuite><testcase name="A.Good" status="run"/><testcase name="A.Bad" status="fail"><failure message=""/></testcase>
<testcase name="A.Docker" status="notrun"><skipped message=""/><system-out>x
skipped: no Docker engine
</system-out></testcase><testcase name="mute" status="notrun"/></testsuite>
EOF
    exit 8 ;;
  package) mkdir -p build/package; echo deb >build/package/sls_0.1.0+debian13_amd64.deb ;;
esac
"""
SLOW = "#!/bin/bash\ntouch started\nsleep 1000 &\nsleep 1000\n"


def make_base(folder):
    """Fills the folder with PROGRAMS and the libraries that they need."""
    for name in ("dev", "etc/apt/apt.conf.d", "etc/dpkg/dpkg.cfg.d", "proc", "root", "run", "sys", "tmp", "usr/bin"):
        (folder / name).mkdir(parents=True)
    (folder / "bin").symlink_to("usr/bin")
    programs = [os.path.realpath(shutil.which(name)) for name in PROGRAMS]
    needed = subprocess.run(["ldd", *programs], capture_output=True, text=True, check=True).stdout
    for name, program in zip(PROGRAMS, programs):
        shutil.copy(program, folder / "usr/bin" / name)
    for library in set(re.findall(r"(/\S+) \(0x", needed)):
        (folder / library[1:]).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(library, folder / library[1:])


@unittest.skipUnless(HAS_NAMESPACES, "needs root and namespaces")
class SystemsTest(unittest.TestCase):
    maxDiff = None

    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(dir="/dev/shm")
        cls.addClassCleanup(folder.cleanup)
        cls.base = pathlib.Path(folder.name).resolve() / "base"
        make_base(cls.base)

    def setUp(self):
        folder = tempfile.TemporaryDirectory(dir="/dev/shm")  # many small writes
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name).resolve()
        self.trees = self.folder / "trees"
        self.root = self.folder / "checkout"
        shutil.copytree(ROOT / "tools/systems", self.root / "tools/systems", ignore=shutil.ignore_patterns("__pycache__"))
        self.write_launcher(DEMO)
        (self.root / "changed").write_text("as committed\n")
        (self.root / ".gitignore").write_text("ignored\n")
        self.git("init", "-q", "-b", "one")
        self.git("add", ".")
        self.git("commit", "-q", "-m", "One")
        self.calls = self.folder / "calls"
        self.calls.write_text("")
        self.write_program("debootstrap", DEBOOTSTRAP.replace("CALLS", str(self.calls))
                           .replace("BASE", str(self.base)))
        self.environment = {**os.environ, "PATH": f"{self.folder}/bin:{os.environ['PATH']}"}

    def tearDown(self):
        self.assertNotIn(str(self.folder), pathlib.Path("/proc/self/mountinfo").read_text(encoding="utf-8"))

    def git(self, *words):
        subprocess.run(["git", "-c", "user.name=a", "-c", "user.email=a@example.org", *words], cwd=self.root, check=True,
                       capture_output=True)

    def write(self, file, text):
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
        file.chmod(0o755)

    def write_launcher(self, text):
        self.write(self.root / "sls", text)

    def write_program(self, name, text):
        self.write(self.folder / "bin" / name, text)

    def start(self, *words, before=()):
        return subprocess.Popen([*before, "/usr/bin/python3", "-B", self.root / "tools/systems", "--folder", self.trees,
                                 "--need-gib", "0.1", *words], env=self.environment, stdout=subprocess.PIPE,
                                stderr=subprocess.PIPE, text=True, cwd=self.folder)

    def run_systems(self, *words, before=()):
        process = self.start(*words, before=before)
        output, errors = process.communicate(timeout=LIMIT_S)
        return process.returncode, output, errors

    def expect_error(self, code, text, *words, before=()):
        """One line, this exit code, and no system left."""
        ended, output, errors = self.run_systems(*words, before=before)
        lines = [line for line in errors.splitlines() if "making a clean system" not in line]
        self.assertEqual((ended, output, len(lines)), (code, "", 1), errors)
        self.assertRegex(lines[0].replace(str(self.folder), ""), f"^sls: error: {text}$")
        self.expect_nothing_left()

    def expect_nothing_left(self):
        left = sorted(path.name for path in self.trees.glob("*")) if self.trees.exists() else []
        self.assertEqual([name for name in left if not re.fullmatch(r"lock|.*\.(tar|log)", name)], [])

    def test_both_systems_are_made_and_the_table_shows_what_happened(self):
        (self.root / "changed").write_text("as it is now\n")
        (self.root / "new").write_text("")
        (self.root / "ignored").write_text("")
        code, output, errors = self.run_systems()
        self.assertEqual(code, 1, errors)  # of the stand-in's test
        self.assertEqual(self.calls.read_text().split(), ["bookworm", "trixie"])
        commit = subprocess.run(["git", "rev-parse", "--short", "HEAD"], cwd=self.root, capture_output=True, text=True,
                                check=True).stdout.strip()
        rows = {cells[1].strip(): [cell.strip() for cell in cells[2:-1]] for cells in
                (line.split("|") for line in output.splitlines() if line.startswith("|"))}
        self.assertEqual(rows[""], ["debian12", "debian13"])
        self.assertEqual(rows["commit"], [f"{commit} and 2 changed files"] * 2)
        self.assertEqual(rows["certificate"], ["0123456789abcdef"] * 2)
        self.assertRegex(rows["./sls demo"][0], r"^exit 0, 0 min \d s$")
        self.assertRegex(rows["./sls test"][1], r"^exit 8, 0 min \d s$")
        self.assertEqual(rows["tests"], ["1 passed, 1 failed, 2 skipped"] * 2)
        self.assertLessEqual({"Fast DDS", "g++", "CMake", "Python"}, rows.keys())
        self.assertEqual(output.splitlines()[-3:], [f"debian13: {line}" for line in (
            "failed: A.Bad", "skipped: 1: no Docker engine: A.Docker", "skipped: 1: no reason: mute")])
        said = (self.trees / "debian12-demo.log").read_text()
        self.assertIn("as it is now\n", said)
        self.assertNotIn("SLS_OTHER", said)
        said = (self.trees / "debian13-demo.log").read_text()
        self.assertNotIn("SLS_OTHER", said)  # the stand-in's test failed
        self.assertNotIn("no namespaces", said)
        self.expect_nothing_left()

    def test_a_tree_has_its_own_processes_and_shared_memory_and_the_settings_of_the_network(self):
        self.environment.pop("npm_config_cafile", None)
        self.environment |= {"https_proxy": "http://proxy.example:1", "SECRET": "1", "NODE_EXTRA_CA_CERTS": "/etc/hosts"}
        code, _, errors = self.run_systems("debian13", "--commands", "demo", "--keep")
        self.assertEqual(code, 0, errors)
        tree = self.trees / "debian13"
        processes = [name for name in (tree / "sls/processes").read_text().split() if name.isdigit()]
        self.assertLess(len(processes), 10)
        self.assertFalse(os.path.exists("/dev/shm/sls_systems_test"))
        said = (self.trees / "debian13-demo.log").read_text()
        self.assertIn("\nhttps_proxy=http://proxy.example:1\n", said)
        self.assertIn("\nNODE_EXTRA_CA_CERTS=/root/authorities.crt\n", said)
        self.assertNotIn("SECRET", said)
        self.assertEqual((tree / "root/authorities.crt").read_bytes(), pathlib.Path("/etc/hosts").read_bytes())

    def test_a_second_run_starts_from_the_kept_base(self):
        for _ in range(2):
            code, _, errors = self.run_systems("debian13", "--commands", "demo")
            self.assertEqual(code, 0, errors)
        self.assertEqual(self.calls.read_text().split(), ["trixie"])

    def test_the_second_system_sees_the_first_and_only_while_it_is_there(self):
        self.write_launcher("#!/bin/bash\nmkdir -p build\ntouch here-$1\nls $SLS_OTHER_BUILD/..; env\n")
        code, _, errors = self.run_systems("debian13", "debian12")
        self.assertEqual(code, 0, errors)
        self.assertNotIn("SLS_OTHER", (self.trees / "debian13-test.log").read_text())
        said = (self.trees / "debian12-demo.log").read_text()
        self.assertIn("SLS_OTHER_TREE=/other\n", said)
        self.assertIn("here-test\n", said)
        self.expect_nothing_left()

    def test_a_package_is_copied_out(self):
        code, _, errors = self.run_systems("debian13", "--commands", "package")
        self.assertEqual(code, 0, errors)
        self.assertEqual((self.root / "build/package/sls_0.1.0+debian13_amd64.deb").read_text(), "deb\n")

    def test_different_certificates_fail(self):
        self.write_launcher(DEMO.replace("0123456789", "$RANDOM$RANDOM").replace("'{", '"{').replace("}'", '}"')
                            .replace('{"certificate": "', '{\\"certificate\\": \\"').replace('0123"}', '0123\\"}'))
        code, _, errors = self.run_systems("--commands", "demo")
        self.assertEqual(code, 1)
        self.assertTrue(errors.endswith("sls: error: the demos have different certificates\n"), errors)

    def test_an_interrupted_run_leaves_no_process_no_mount_and_no_tree(self):
        self.write_launcher(SLOW)
        for number in (signal.SIGINT, signal.SIGTERM):
            process = self.start("debian12", "--commands", "demo")
            self.wait_for_start()
            process.send_signal(number)
            process.communicate(timeout=LIMIT_S)
            self.assertEqual(process.returncode, 128 + number)
            self.expect_nothing_left()
            self.assertEqual(self.find_processes(), [])

    def test_a_killed_run_leaves_no_process_and_no_mount_and_the_next_run_takes_its_place(self):
        self.write_launcher(SLOW)
        process = self.start("debian12", "--commands", "demo")
        self.wait_for_start()
        process.kill()
        process.communicate(timeout=LIMIT_S)
        wait_until(lambda: not self.find_processes(), LIMIT_S, "no process is left")
        self.write_launcher(DEMO)
        self.assertEqual(self.run_systems("debian12", "--commands", "demo")[0], 0)
        self.expect_nothing_left()

    def wait_for_start(self):
        wait_until((self.trees / "debian12/sls/started").exists, LIMIT_S, "the demo starts")

    def find_processes(self):
        """Processes whose root is in a tree of this test."""
        found = []
        for process in pathlib.Path("/proc").glob("[0-9]*"):
            try:
                if os.readlink(process / "root").startswith(str(self.trees)):
                    found.append((process / "cmdline").read_text())
            except OSError:
                pass
        return found

    def test_the_limit_of_time_ends_the_commands(self):
        self.write_launcher(SLOW)
        # On a busy machine the time may be over before the system is made.
        code, _, errors = self.run_systems("debian12", "--limit-minutes", "0.1")
        self.assertEqual(code, 1)
        self.assertTrue(errors.endswith("sls: error: debian12: stopped at the limit of time\n"), errors)
        self.expect_nothing_left()
        self.assertEqual(self.find_processes(), [])

    def test_a_command_past_its_time_or_on_a_full_disk_is_killed_with_its_children(self):
        mark = str(self.folder)  # other processes of this machine may sleep, too
        script = f"exec -a {mark} sleep 4321 & exec -a {mark} sleep 4321"
        for reserve, seconds, reason in ((0, 0.2, "stopped at the limit of time"), (1e9, 1000, "stopped: less than")):
            with unittest.mock.patch.object(tree, "RESERVE_GIB", reserve):
                with self.assertRaisesRegex(tree.Failure, reason):
                    tree.run_bounded(tree.isolate("bash", "-c", script), self.folder / "log", time.monotonic() + seconds,
                                     self.folder)
            self.assertNotIn(mark, subprocess.run(["ps", "-e", "-o", "args"], capture_output=True, text=True,
                                                    check=True).stdout)

    def test_a_folder_with_a_mount_in_it_is_not_deleted(self):
        place = self.trees / "debian12" / "a place"
        place.mkdir(parents=True)
        script = f"mount -t tmpfs tmpfs '{place}' && touch '{place}/file' && \"$@\"; code=$?; ls '{place}'; exit $code"
        code, output, errors = self.run_systems("debian12", before=["unshare", "--mount", "--propagation", "private", "sh",
                                                                    "-c", script, "sh"])
        self.assertEqual((code, output), (1, "file\n"))
        self.assertIn(f"not deleted: something is mounted at {place}\n", errors)

    def test_bad_usage_is_one_line(self):
        self.expect_error(2, "systems: SYSTEM: expected one of debian12, debian13, testing, aarch64, got 'debian11'", "debian11")
        self.expect_error(2, "systems: --commands: expected one of demo, test, package, got 'fly'", "--commands", "fly")
        self.expect_error(2, "systems: --limit-minutes: expected > 0, got 0", "--limit-minutes", "0")
        self.expect_error(2, "systems: --limit-minutes: expected > 0, got nan", "--limit-minutes", "nan")
        self.expect_error(2, "systems: unrecognized arguments: --fast", "--fast")
        self.assertEqual(self.calls.read_text(), "")

    def test_each_missing_thing_is_one_line(self):
        self.expect_error(1, "systems: expected root, which debootstrap and namespaces need: try sudo", before=[
            "setpriv", "--reuid", "65534", "--clear-groups", "--inh-caps", "+dac_read_search", "--ambient-caps",
            "+dac_read_search"])  # may read a checkout that only root can
        self.expect_error(1, r"debian12: /trees: expected 1e\+06 GiB free on this disk, got [\d.]+ GiB", "debian12",
                          "--need-gib", "1e6")
        self.write_program("debootstrap", "#!/bin/sh\necho I: Retrieving InRelease\n"
                                          "echo 'E: Failed getting release file http://deb.example/Release'\nexit 1\n")
        self.expect_error(1, "debian13: debootstrap failed: E: Failed getting release file http://deb.example/Release "
                             r"\(log: /trees/debian13-debootstrap.log\)", "debian13")
        (self.folder / "bin/debootstrap").unlink()
        self.environment["PATH"] = f"{self.folder}/bin"
        for name in ("setpriv", "git", "unshare", "true"):
            (self.folder / "bin" / name).symlink_to(shutil.which(name))
        self.expect_error(1, "systems: debootstrap is missing: apt-get install debootstrap")

    def test_arm_is_refused_before_a_tree_is_made(self):
        self.expect_error(2, "systems: --commands: expected no package for aarch64, got 'package'", "aarch64",
                          "--commands", "package")
        self.expect_error(1, "systems: /checkout/build/bin/closed_loop: expected a program of this machine, got none; run "
                             "./sls build", "aarch64")
        for program in "closed_loop", "recorder", "sim_server":
            self.write(self.root / "build/bin" / program, "")
        self.expect_error(1, "systems: --only: expected to match a name in config/scenarios, got 'short'", "aarch64",
                          "--only", "short")
        self.write(self.root / "config/scenarios/short.yaml", "")
        self.expect_error(1, r"systems: --only: expected a regular expression, got '\(': missing .*", "aarch64", "--only",
                          "(")
        self.assertEqual(self.calls.read_text(), "")

    def test_arm_runs_the_commands_of_its_document_in_a_debian12_and_stops_at_the_first_that_fails(self):
        for program in "closed_loop", "recorder", "sim_server":
            self.write(self.root / "build/bin" / program, "")
        self.write(self.root / "config/scenarios/short.yaml", "")
        self.write(self.root / "docs/arm.md", "\n## Building\n\nText.\n\n    echo $DEBIAN_FRONTEND; touch packages\n"
                                              "    cmake --preset aarch64\n\n## Flying\n\n    no command\n")
        code, output, errors = self.run_systems("aarch64", "--keep")
        self.assertEqual(code, 1)
        self.assertRegex(errors, r"\nsls: error: aarch64: build failed: sh: .*cmake: not found \(log: .*/aarch64-build.log\)"
                                 r"\n")
        self.assertRegex(output, r"\n\| packages \| exit 0, 0 min \d s \|\n\| build \| exit 127, ")
        self.assertEqual((self.trees / "aarch64-packages.log").read_text(), "noninteractive\n")
        self.assertTrue((self.trees / "aarch64/sls/packages").exists())
        self.assertEqual(self.calls.read_text().split(), ["bookworm"])

    def test_a_folder_in_use_is_one_line(self):
        self.write_launcher(SLOW)
        process = self.start("debian12", "--commands", "demo")
        self.wait_for_start()
        code, output, errors = self.run_systems("debian13")
        self.assertEqual((code, output, errors), (1, "", f"sls: error: systems: {self.trees}: another ./sls systems uses "
                                                         "this folder\n"))
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=LIMIT_S)

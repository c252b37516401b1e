"""The Debian package in a clean system: it is installed, flies, and is removed without a trace.

package_test.py BUILD tests the package of the build tree in the system of this machine; package_test.py BUILD SYSTEM what
./sls package --system SYSTEM builds, in that system.

The system is a folder of the build tree. mmdebstrap fills it once, with the packages that the package depends on.
Everything in it runs in its own mount and process namespaces: its mounts are not visible outside, and none is left
behind. Skipped if the machine lacks root, mmdebstrap, namespaces or a mirror of Debian."""

import hashlib
import os
import re
import shutil
import subprocess
import sys
import time
import unittest
from pathlib import Path

import yaml

ROOT = Path(__file__).resolve().parents[2]
BUILD = Path(sys.argv[1]).resolve()
sys.path.insert(0, str(ROOT / "tools/systems"))
import tree  # noqa: E402
sys.path.insert(0, str(ROOT / "python"))
from sls.launcher.commands import SOURCE_COMMANDS  # noqa: E402

OWN = "".join(re.findall(r'^(?:ID|VERSION_ID)="?(\w+)"?$', "\n".join(sorted(
    Path("/etc/os-release").read_text(encoding="utf-8").splitlines())), re.MULTILINE))  # such as debian12
NAME = sys.argv[2] if len(sys.argv) > 2 else OWN
FOLDER = BUILD / ("package_test" if NAME == OWN else f"package_test_{NAME}")
SYSTEM = FOLDER / "debian"
WORK = "/tmp/work"  # the user's folder in the system
USER = 1000
# Of the 220 packages, these draw in most of what compiles and draws: three quarters of a gigabyte. The system gets empty
# ones: what sls would need of them is missing, which is more than a user lacks.
EMPTY = ("libgl1-mesa-dri", "python3-pythran", "python3-sympy", "unicode-data")
# For commands in the system that use the network, of this machine without its compilers.
ENVIRONMENT = {**{name: value for name, value in os.environ.items() if not name.startswith("CMAKE_")},
               "PATH": "/usr/sbin:/usr/bin:/sbin:/bin", "DEBIAN_FRONTEND": "noninteractive", "LC_ALL": "C"}
# Files in which apt and dpkg record their own work, and temporary files.
JOURNALS = re.compile(r"/(proc|sys|tmp|run|dev/shm|var/(cache|log|lib/(apt|dpkg)))(/|$)|/etc/ld\.so\.cache$|"
                      r"/var/lib/systemd/|/usr/share/man/.*index")


def skip(reason):
    print(f"skipped: {reason}")
    sys.exit(77)


def isolate(*command, system=None, user=None):
    """The command with its own mounts, processes, network and shared memory; in the folder of a system, if given."""
    place = str(system or "")
    inside = ["setpriv", f"--reuid={user}", f"--regid={user}", "--clear-groups", "--"] if user else []
    inside = ["chroot", place] + inside if system else inside
    script = f"""set -e
mount -t proc proc '{place}/proc'
mkdir -p '{place}/dev/shm'
mount -t tmpfs -o mode=1777 tmpfs '{place}/dev/shm'
ip link set lo up
exec "$@" """
    return ["unshare", "--mount", "--propagation", "private", "--pid", "--fork", "--kill-child", "--net", "sh", "-c",
            script, "sh", *inside, *map(str, command)]


def run(command, expected=0, limit_s=600.0, **options):
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace",
                          stdin=subprocess.DEVNULL, timeout=limit_s, check=False, **options)
    if done.returncode != expected:
        raise AssertionError(f"{' '.join(map(str, command[-6:]))}: expected exit code {expected}, got "
                             f"{done.returncode}:\n{done.stdout[-4000:]}")
    return done.stdout


def run_apt(*command):
    """Runs a command in the system with the network of this machine, because apt needs the mirror."""
    script = f"mount -t proc proc '{SYSTEM}/proc'; exec chroot '{SYSTEM}' \"$@\""
    return run(["unshare", "--mount", "--propagation", "private", "sh", "-c", script, "sh", *command],
               limit_s=1200, env=ENVIRONMENT)


def update_lists():
    """Asks the mirror what packages there are, if the system has not asked within an hour. Raises AssertionError."""
    partial = SYSTEM / "var/lib/apt/lists/partial"  # apt changes it when it asks
    if not partial.exists() or time.time() - partial.stat().st_mtime > 3600:
        run_apt("apt-get", "update", "--error-on=any")


def make_package():
    """Makes the package, from the build tree as ./sls package does."""
    if NAME != OWN:
        run([ROOT / "sls", "package", "--system", NAME], limit_s=6000)
        made = sorted((ROOT / "build/package").glob(f"sls_*+{NAME}_*.deb"), key=os.path.getmtime)
        return made[-1]
    folder = FOLDER / "package"
    tree.remove(folder)
    # The default, xz, takes ten seconds.
    said = run(["cpack", "--config", BUILD / "CPackConfig.cmake", "-B", folder, "-D", "CPACK_DEBIAN_COMPRESSION_TYPE=none"],
               cwd=FOLDER, limit_s=1200)
    return Path(re.search(r"^CPack: - package: (.*\.deb) generated\.$", said, re.MULTILINE)[1])


def make_empty_packages():
    """Makes them in /empty of the system."""
    folder = SYSTEM / "empty"
    tree.remove(folder)
    machine = run(["chroot", SYSTEM, "dpkg", "--print-architecture"]).strip()
    for name in EMPTY:
        (folder / name / "DEBIAN").mkdir(parents=True)
        (folder / name / "DEBIAN/control").write_text(f"Package: {name}\nVersion: 99\nArchitecture: {machine}\n"
                                                      "Maintainer: a <a@example.org>\nDescription: empty\n")
        run(["dpkg-deb", "--build", folder / name, folder])
    return [f"/empty/{path.name}" for path in folder.glob("*.deb")]


def make_system(package):
    """Makes a minimal system with only the packages that the package depends on."""
    depends = run(["dpkg-deb", "--field", package, "Depends"]).strip()
    stamp, wanted = FOLDER / "debian.stamp", hashlib.sha256(f"{depends} {EMPTY}".encode()).hexdigest()
    if stamp.is_file() and stamp.read_text() == wanted:
        return
    stamp.unlink(missing_ok=True)
    if not (SYSTEM / "made").is_file():
        tree.remove(SYSTEM)
        mirror = tree.find_mirror()
        # The system need not survive a power cut: dpkg writes it without waiting for the disk.
        made = subprocess.run(["unshare", "--mount", "--propagation", "private", "mmdebstrap", "--variant=minbase",
                               "--dpkgopt=force-unsafe-io", "--skip=cleanup/apt/lists", tree.CODENAMES[NAME], SYSTEM,
                               mirror], capture_output=True, text=True, timeout=1200, check=False)
        if made.returncode != 0:
            skip(f"mmdebstrap from {mirror} failed: {made.stderr.strip().splitlines()[-1:]}")
        (SYSTEM / "made").touch()
    tree.copy_settings(SYSTEM)
    try:
        update_lists()
    except AssertionError as error:
        skip(f"the mirror of Debian does not answer: {error}")
    run_apt("dpkg", "--configure", "-a")  # of an interrupted test
    run_apt("dpkg", "--install", *make_empty_packages())
    run_apt("apt-get", "satisfy", "-y", "--no-install-recommends", depends)
    stamp.write_text(wanted)


def list_files():
    """Every file of the system, with its kind and size."""
    found = {}
    for folder, folders, names in os.walk(SYSTEM):
        place = folder.removeprefix(str(SYSTEM))
        folders[:] = [name for name in folders if not JOURNALS.match(f"{place}/{name}")]
        for name in folders + names:
            path = f"{place}/{name}"
            if not JOURNALS.match(path):
                status = os.lstat(os.path.join(folder, name))
                found[path] = (status.st_mode, 0 if name in folders else status.st_size)
    return found


def fly(*command, expected=0):
    """Runs a command as the user in the system, in the user's folder."""
    script = f"cd {WORK} && HOME={WORK} PATH=/usr/bin:/bin exec \"$@\""
    return run(isolate("/bin/sh", "-c", script, "sh", *command, system=SYSTEM, user=USER), expected)


class PackageTest(unittest.TestCase):
    maxDiff = None

    @classmethod
    def setUpClass(cls):
        cls.package = make_package()
        make_system(cls.package)
        tree.remove(SYSTEM / WORK[1:])
        subprocess.run(["chroot", SYSTEM, "dpkg", "--purge", "sls"], capture_output=True, check=False)
        cls.before = list_files()
        (SYSTEM / WORK[1:]).mkdir()
        os.chown(SYSTEM / WORK[1:], USER, USER)
        shutil.copy(cls.package, SYSTEM / "tmp/sls.deb")
        # The dependencies are installed already: apt installs only the package, without a network.
        said = run(isolate("apt-get", "install", "-y", "--no-install-recommends", "/tmp/sls.deb",
                           system=SYSTEM))
        assert "1 newly installed" in said, said

    @classmethod
    def tearDownClass(cls):
        tree.remove(SYSTEM / WORK[1:])
        (SYSTEM / "tmp/sls.deb").unlink()
        subprocess.run(["chroot", SYSTEM, "dpkg", "--purge", "sls"], capture_output=True, check=False)

    def test_0_the_package_names_its_system(self):
        version = run(["dpkg-deb", "--field", self.package, "Version"]).strip()
        self.assertRegex(version, rf"^\d+\.\d+\.\d+\+{NAME}$")
        self.assertRegex(self.package.name, rf"^sls_{re.escape(version)}_\w+\.deb$")
        text = run(["sh", "-c", 'zcat "$1/usr/share/doc/sls/changelog.gz"', "sh", SYSTEM])
        self.assertTrue(text.startswith(f"sls ({version}) "), text)
        wheel, = (SYSTEM / "usr/share/sls").glob("sls-*.whl")
        self.assertIn("_sls_core.", run([sys.executable, "-m", "zipfile", "-l", wheel]))

    def test_1_a_flight_is_that_of_the_build_tree_bit_for_bit(self):
        said = fly("sls", "run", "short")
        recording = re.search(r"^sls: recording: (recordings/short-\d{8}T\d{6}Z)$", said, re.MULTILINE)[1]
        ours = FOLDER / "recording"
        run(isolate(ROOT / "sls", "run", "short", "--out", ours, "--force"),
            env={**os.environ, "SLS_BUILD": str(BUILD)})
        verdict = run([BUILD / "bin/sls_verify", f"{SYSTEM}{WORK}/{recording}", ours])
        self.assertIn("equal", verdict)
        fly("sls", "verify", recording)
        fly("sls", "plot", recording, "--panels", "path")
        fly("sls", "report", recording)
        self.assertTrue((Path(f"{SYSTEM}{WORK}") / recording / "report.html").is_file())

    def test_2_the_commands_work_in_any_folder(self):
        summary = fly("sls", "demo", "short", "--in-process", "--out", "demo")
        self.assertIn("Files in demo", summary)
        fly("sls", "convert", "demo")
        for name in ("view", "ctl", "doctor", "campaign"):
            fly("sls", name, "--help")
        fly("sls", "keys", "keys")
        flight = "import sls; print(sls.fly(sls.load_scenario('short')).certificate)"
        self.assertEqual(fly("sls", "python", "-c", flight), fly("python3", "-c", flight))
        fly("sls", "campaign", "gains", "--runs", "0-1", "--workers", "1", "--out", "campaign", "--verify", "1")
        self.assertNotIn("./sls", fly("sls", "help"))

    def test_3_commands_of_the_source_tree_say_that_they_need_it(self):
        self.assertGreater(len(SOURCE_COMMANDS), 10)
        for name in SOURCE_COMMANDS:
            self.assertEqual(fly("sls", name, expected=2),
                             f"sls: error: {name}: needs the source tree; this sls is installed without it\n")

    def test_4_the_job_of_the_ci_example_runs_from_nothing(self):
        # In a copy of the system that disappears, with the network of this machine, because apt needs the mirror.
        try:
            update_lists()
        except AssertionError as error:
            self.skipTest(f"skipped: the mirror of Debian does not answer: {error}")
        job, = yaml.safe_load((ROOT / "examples/ci/.github/workflows/flights.yml").read_text())["jobs"].values()
        lines = "\n".join(step["run"] for step in job["steps"] if "run" in step)
        place = FOLDER / "copy"
        place.mkdir(exist_ok=True)
        script = f"""set -e
mount -t tmpfs tmpfs '{place}'
cd '{place}' && mkdir upper work root
mount -t overlay overlay -o 'lowerdir={SYSTEM},upperdir=upper,workdir=work' root
mount -t proc proc root/proc && mount -t tmpfs -o mode=1777 tmpfs root/dev/shm
cp -r root/usr/share/doc/sls/examples/ci root/root/ci && mv root/tmp/sls.deb root/srv
chroot root dpkg --purge sls
exec chroot root sh -e -c "cd /root/ci
$1" """
        environment = {**ENVIRONMENT, "SLS_DEB": "file:///srv/sls.deb"}
        said = run(["unshare", "--mount", "--propagation", "private", "--pid", "--fork", "--kill-child", "sh", "-c",
                    script, "sh", lines], env=environment, limit_s=1200)
        self.assertIn("100% tests passed", said)

    def test_5_it_is_removed_without_a_trace(self):
        # Python run by root leaves compiled files, which the removal must delete, too.
        run(isolate("python3", "-c", "import sls; sls.lqr", system=SYSTEM))
        run(isolate("apt-get", "purge", "-y", "sls", system=SYSTEM))
        self.assertEqual({path: kind for path, kind in list_files().items() if self.before.get(path) != kind}, {})
        self.assertEqual(self.before.keys() - list_files().keys(), set())


if __name__ == "__main__":
    if os.geteuid() != 0:
        skip("only root can install a package")
    for program in ("mmdebstrap", "cpack", "dpkg-shlibdeps", "unshare", "ip"):
        if not shutil.which(program):
            skip(f"{program} is missing")
    if NAME not in tree.CODENAMES:
        skip(f"no clean {NAME} can be made: expected one of {', '.join(tree.CODENAMES)}")
    if subprocess.run(isolate("true"), check=False).returncode != 0:
        skip("this machine gives no namespaces, or no /proc in them")
    FOLDER.mkdir(exist_ok=True)
    unittest.main(argv=sys.argv[:1], verbosity=2, failfast=True)

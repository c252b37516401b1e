"""What the launcher installs on which system, and its one line where it cannot.

A copy of the launcher reads the test's own os-release. Stand-ins for dpkg-query, apt-get and npm record their calls."""

import re
import subprocess

from checkout import CheckoutTest

DEBIAN = 'PRETTY_NAME="Debian GNU/Linux {0} ({1})"\nNAME="Debian GNU/Linux"\nVERSION_ID="{0}"\nVERSION_CODENAME={1}\nID=debian\n'
UBUNTU = 'PRETTY_NAME="Ubuntu {0} LTS"\nVERSION_ID="{0}"\nVERSION_CODENAME={1}\nID=ubuntu\nID_LIKE=debian\nUBUNTU_CODENAME={1}\n'
MINT = 'PRETTY_NAME="Linux Mint {0}"\nVERSION_ID="{0}"\nVERSION_CODENAME=x\nID=linuxmint\nID_LIKE="ubuntu debian"\nUBUNTU_CODENAME={1}\n'
BOOKWORM, NOBLE = DEBIAN.format(12, "bookworm"), UBUNTU.format("24.04", "noble")
# The os-release of each system that is tried, and which Fast DDS it has.
TRIED = {
    BOOKWORM: 2, DEBIAN.format(13, "trixie"): 3, NOBLE: 2, UBUNTU.format("26.04", "resolute"): 3, MINT.format(22, "noble"): 2,
    'PRETTY_NAME="Debian GNU/Linux forky/sid"\nVERSION_CODENAME=forky\nID=debian\n': 3,
    'PRETTY_NAME="LMDE 6 (faye)"\nID=linuxmint\nID_LIKE=debian\nVERSION_CODENAME=faye\nDEBIAN_CODENAME=bookworm\n': 2,
}
NAMES = "Debian 12, 13 and testing, Ubuntu 24.04 and 26.04"
TOO_OLD = {"Debian GNU/Linux 11 (bullseye)": DEBIAN.format(11, "bullseye"), "Ubuntu 22.04 LTS": UBUNTU.format("22.04", "jammy"),
           "Linux Mint 21": MINT.format(21, "jammy")}
NO_DEBIAN = {"Fedora Linux 41": "ID=fedora\nVERSION_ID=41\nPRETTY_NAME='Fedora Linux 41'\n",
             "unknown (no /etc/os-release)": None}
# Newer than any that is known: with its name.
NEWER = {"Debian GNU/Linux 16 (woody)": DEBIAN.format(16, "woody"), "Ubuntu 28.04 LTS": UBUNTU.format("28.04", "x"),
         "Kali GNU/Linux Rolling": 'PRETTY_NAME="Kali GNU/Linux Rolling"\nID=kali\nVERSION_CODENAME=kali-rolling\nID_LIKE=debian\n'}
# The output of apt-get of Debian 12 without a network, shortened.
OFFLINE = """W: Failed to fetch http://deb.debian.org/debian/dists/bookworm/InRelease  Temporary failure resolving 'deb.debian.org'
W: Some index files failed to download. They have been ignored, or old ones used instead.
E: Unable to locate package g++
E: Unable to locate package ninja-build
"""


class SetupTest(CheckoutTest):
    parts = ("config/scenarios",)

    def setUp(self):
        super().setUp()
        text = (self.root / "sls").read_text(encoding="utf-8")
        self.release = self.folder / "os-release"
        self.assertIn("/etc/os-release", text)
        (self.root / "sls").write_text(text.replace(" /etc/os-release", f" {self.release}"), encoding="utf-8")
        self.said = self.folder / "said"
        for name, action in (("dpkg-query", "exit 1"), ("node", "echo v18.0.0"), ("sudo", 'exec "$@"'),
                             ("apt-get", f"test ! -f {self.said} || {{ cat {self.said}; exit 100; }}"),
                             ("npm", f"cat {self.said} >&2; exit 1")):
            self.stand_in(name, action)

    def launch(self, release, *words):
        """Starts the launcher on a system with this os-release; returns code, output and the calls of stand-ins."""
        self.release.unlink(missing_ok=True)
        if release is not None:
            self.release.write_text(release)
        self.calls.write_text("")
        done = subprocess.run([self.root / "sls", *words], env={**self.environment, "TMPDIR": str(self.folder)},
                              cwd=self.folder, capture_output=True, text=True, timeout=60, check=False)
        return done.returncode, done.stdout + done.stderr, self.calls.read_text()

    def install(self, release, *known):
        """What setup says and installs on a system whose apt knows the packages `known`."""
        self.stand_in("apt-cache", f'case " {" ".join(known)} " in *" $2 "*) echo "$2:" ;; esac')
        code, said, calls = self.launch(release, "setup")
        self.assertEqual(code, 0, said)
        [install] = [line for line in calls.splitlines() if line.startswith("apt-get install")]
        self.assertIn("libsimbody-dev", install.split())
        return said, install.split()

    def test_each_system_gets_its_own_names(self):
        for release, version in TRIED.items():
            with self.subTest(release):
                said, install = self.install(release)
                self.assertEqual([name for name in install if re.match("libfast(rtps|dds)-dev", name)],
                                 [{2: "libfastrtps-dev", 3: "libfastdds-dev"}[version]])
                self.assertNotIn("not known", said)

    def test_a_newer_system_gets_the_fast_dds_that_it_has_and_one_line_says_so(self):
        for name, release in NEWER.items():
            for known, expected in (((), "libfastdds-dev"), (("libfastrtps-dev",), "libfastrtps-dev"),
                                    (("libfastrtps-dev", "libfastdds-dev"), "libfastdds-dev")):
                with self.subTest(name, known=known):
                    said, install = self.install(release, *known)
                    self.assertIn(expected, install)
                    self.assertEqual(said.splitlines()[0], f"sls: this system is {name}, which is not known here: taking "
                                                           f"{expected} and the other packages of {NAMES}")

    def test_ubuntu_is_given_no_chromium_which_is_a_snap_there(self):
        self.release.write_text(NOBLE)
        for release, is_asked in ((NOBLE, False), (BOOKWORM, True)):
            code, said, calls = self.launch(release, "@install", "chromium", "mandoc")
            self.assertEqual(code, 0, said)
            self.assertEqual("chromium" in re.search("apt-get install.*", calls)[0].split(), is_asked)

    def test_another_system_is_refused_in_one_line_and_nothing_is_installed(self):
        refused = {name: (release, f"{name}, whose packages are too old; tried are {NAMES}: fly in containers with ./sls docker-demo")
                   for name, release in TOO_OLD.items()}
        refused |= {name: (release, f"{name}; tried are {NAMES}. Elsewhere fly in containers with ./sls docker-demo, or install by "
                                    f"hand what the lists at the top of {self.root}/sls name, then add --no-install")
                    for name, release in NO_DEBIAN.items()}
        for name, (release, expected) in refused.items():
            for command in ("setup", "demo", "report"):
                with self.subTest(name, command=command):
                    code, said, calls = self.launch(release, command)
                    said = said.replace(str(self.release), "/etc/os-release")
                    self.assertEqual((code, said), (1, f"sls: error: this system is {expected}\n"))
                    self.assertNotIn("apt-get", calls)

    def test_variables_of_the_caller_are_no_system(self):
        self.environment |= {"ID": "debian", "VERSION_CODENAME": "bookworm", "UBUNTU_CODENAME": "noble"}
        self.assertEqual(self.launch(None, "setup")[0], 1)

    def test_no_install_installs_nothing_on_any_system(self):
        for release in (BOOKWORM, NO_DEBIAN["Fedora Linux 41"], None):
            for words in (("setup", "--no-install"), ("--no-install", "setup")):
                code, said, calls = self.launch(release, *words)
                self.assertEqual((code, said), (0, ""))
                self.assertNotIn("apt-get", calls)

    def test_the_size_of_what_is_installed_is_said_before(self):
        self.stand_in("apt-get", "echo 'Need to get 9 kB of archives.'; echo 'After this operation, 5 MB of disk space will be used.'")
        code, said, _ = self.launch(BOOKWORM, "setup")
        self.assertEqual((code, said.splitlines()[1:]), (
            0, ["sls: apt-get: 9 kB of archives. 5 MB of disk space will be used."]))

    def test_a_machine_without_python_and_a_folder_that_cannot_be_written_are_one_line(self):
        text = (self.root / "sls").read_text()
        (self.root / "build/lock").mkdir(parents=True)
        code, said, _ = self.launch(BOOKWORM, "build", "--no-install")
        self.assertRegex(said, f"^sls: error: {self.root}/build: expected a folder of yours to build in, got one .*\n$")
        (self.root / "sls").write_text(text.replace("/usr/bin/python3", "/usr/bin/no-python"))
        for words in (("demo", "--no-install"), ("--no-install", "demo")):
            self.assertEqual(self.launch(BOOKWORM, *words), (
                1, "sls: error: /usr/bin/no-python: expected Debian's Python, got none: apt-get install python3\n", ""))

    def test_a_missing_network_is_one_line_with_the_reason(self):
        self.said.write_text(OFFLINE)
        code, said, _ = self.launch(BOOKWORM, "setup")
        first, error, *rest = said.splitlines()
        self.assertEqual((code, rest), (1, []), said)
        self.assertTrue(first.startswith("sls: installing with apt-get: "))
        self.assertRegex(error, r"^sls: error: apt-get: Unable to locate package g\+\+; http://deb\.debian\.org/\S+  "
                                r"Temporary failure resolving 'deb\.debian\.org' \(whole log: \S+\)$")

    def test_a_package_that_is_half_configured_is_one_line_with_the_way_out(self):
        self.said.write_text("E: dpkg was interrupted, you must manually run 'dpkg --configure -a' to correct the "
                             "problem. \n")
        code, said, _ = self.launch(BOOKWORM, "setup")
        self.assertEqual(code, 1)
        self.assertIn("error: apt-get: dpkg was interrupted, you must manually run 'dpkg --configure -a'", said)
        self.assertEqual(len(said.splitlines()), 2, said)

    def test_a_node_that_is_too_old_or_broken_is_one_line(self):
        (self.root / "tools/view/page").mkdir(parents=True)
        for action, got in (("echo v16.20.2", "node: expected version 18 or later, got v16.20.2"),
                            ("echo 'node: not for this machine'", "node: expected version 18 or later, got node: not for this "
                                                                  "machine"),
                            ("exit 127", "node --version failed")):
            self.stand_in("node", action)
            code, said, _ = self.launch(BOOKWORM, "setup", "--no-install")
            self.assertEqual((code, said), (1, f"sls: error: {got}\n"))

    def test_npm_without_a_network_is_one_line_with_the_reason(self):
        page = self.root / "tools/view/page"
        page.mkdir(parents=True)
        (page / "package-lock.json").write_text("{}")
        for mark in ("ERR!", "error"):
            self.said.write_text(f"npm {mark} code ENOTFOUND\nnpm {mark} syscall getaddrinfo\nnpm {mark} errno ENOTFOUND\n"
                                 f"npm {mark} network request to https://registry.npmjs.org/three failed\n")
            code, said, _ = self.launch(BOOKWORM, "setup", "--no-install")
            self.assertEqual(code, 1)
            self.assertRegex(said.splitlines()[-1], "^sls: error: npm ci: code ENOTFOUND .* failed .whole log: ")

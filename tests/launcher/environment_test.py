"""A furnished machine gives what a bare one gives: the same build files, and flights with the same certificate."""

import json
import os
import shlex
import shutil
import subprocess
import unittest
import unittest.mock

from folder_test import FolderTest
from own_domain import own_domain
from places import BUILD, ROOT

FAIL = "#!/bin/sh\necho wrong program >&2\nexit 1\n"
# Of a sourced ROS and of an active conda, with their files below the folder {0}; {PATH} is the PATH before.
ROS = {"ROS_DISTRO": "jazzy", "ROS_VERSION": "2", "ROS_DOMAIN_ID": "7", "RMW_IMPLEMENTATION": "rmw_fastrtps_cpp",
       "AMENT_PREFIX_PATH": "{0}/ros", "CMAKE_PREFIX_PATH": "{0}/ros", "PATH": "{0}/ros/bin:{PATH}",
       "LD_LIBRARY_PATH": "{0}/ros/lib:{0}/ros", "PYTHONPATH": "{0}/ros/python", "fastdds_DIR": "{0}/ros/share/fastdds/cmake",
       "Eigen3_ROOT": "{0}/ros"}
CONDA = {"CONDA_PREFIX": "{0}/conda", "PATH": "{0}/conda/bin:{PATH}", "CC": "{0}/conda/bin/gcc", "CXX": "{0}/conda/bin/g++",
         "CFLAGS": "-march=nocona -isystem {0}/conda/include", "CXXFLAGS": "-ffast-math -isystem {0}/conda/include",
         "LDFLAGS": "-Wl,-rpath,{0}/conda/lib", "CPATH": "{0}/conda/include", "CMAKE_GENERATOR": "Unix Makefiles",
         "PYTHONHOME": "{0}/conda", "PYTHONSTARTUP": "{0}/conda/python/sls.py", "VIRTUAL_ENV": "{0}/conda"}
BUILDS = {"ROS sourced": ROS, "conda active": CONDA}
FLIGHTS = {
    "ROS sourced": ROS, "conda active": CONDA,
    "a home that cannot be written": {"HOME": "/proc/home"},
    "no home": {"HOME": "", "XDG_CONFIG_HOME": "/nowhere", "MPLCONFIGDIR": "/nowhere"},
    "another language": {"LANG": "tr_TR.UTF-8", "LC_ALL": "tr_TR.UTF-8", "LANGUAGE": "tr"},
    "a narrow terminal": {"COLUMNS": "10", "LINES": "2", "TERM": "unknown"},
}


class EnvironmentTest(FolderTest):
    def setUp(self):
        super().setUp()
        for prefix, own in (("ros", ()), ("conda", ("python3", "cmake", "ninja"))):
            for name in ("python", "gcc", "g++", "fastddsgen", *own):
                self.write(f"{prefix}/bin/{name}", FAIL, 0o755)
            for name in ("sls", "yaml", "numpy", "pytest"):
                self.write(f"{prefix}/python/{name}.py", "raise SystemExit('wrong module')\n")
            for name in ("fastcdr.so.1", "fastcdr.so.2", "fastrtps.so.2.9", "fastdds.so.3.1"):
                self.write(f"{prefix}/lib/lib{name}", "no library")
            for package in ("fastdds", "fastrtps", "eigen3", "Eigen3"):
                self.write(f"{prefix}/share/{package}/cmake/{package}-config.cmake", 'message(FATAL_ERROR "wrong package")\n')
                self.write(f"{prefix}/share/{package}/cmake/{package}-config-version.cmake",
                           "set(PACKAGE_VERSION 9)\nset(PACKAGE_VERSION_COMPATIBLE TRUE)\n")

    def fill(self, variables):
        return {**os.environ, **{name: value.replace("{0}", str(self.folder)).replace("{PATH}", os.environ["PATH"])
                                 for name, value in variables.items()}}

    # --- flights --------------------------------------------------------------------------------------------------------

    def fly(self, variables, launcher=ROOT / "sls", build=BUILD, before=()):
        with own_domain() as domain:
            done = subprocess.run([*before, launcher, "run", "short", "--json", "--force", "--domain", str(domain), "--out",
                                   self.folder / "r"], env=self.fill({"SLS_BUILD": str(build), **variables}),
                                  capture_output=True, text=True, timeout=100, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        return json.loads(done.stdout)["certificate"], done.stderr

    def test_flights_have_one_certificate(self):
        bare, _ = self.fly({})
        for name, variables in FLIGHTS.items():
            with self.subTest(name):
                certificate, said = self.fly(variables)
                self.assertEqual(certificate, bare)
                lines = [line for line in said.splitlines() if "LD_LIBRARY_PATH" in line]
                self.assertEqual(lines, [f"sls: leaves out of LD_LIBRARY_PATH, because of another Fast DDS or Simbody there: "
                                         f"{self.folder}/ros/lib"] if variables is ROS else [])
        with self.subTest("umask 077"):
            self.assertEqual(self.fly({}, before=("sh", "-c", 'umask 077; exec "$0" "$@"'))[0], bare)
        with self.subTest("a path with a space and letters of other languages"):
            place = self.folder / "ein Ort mit ß, é und 路"
            for name in ("sls", "python", "config"):
                place.mkdir(exist_ok=True)
                (shutil.copytree if (ROOT / name).is_dir() else shutil.copy)(ROOT / name, place / name)
            (place / "built").symlink_to(BUILD)
            self.assertEqual(self.fly({}, place / "sls", place / "built")[0], bare)

    @unittest.skipUnless(os.geteuid() == 0, "skipped: mounting a folder needs root")
    def test_a_folder_for_temporary_files_without_programs_is_enough(self):
        mount = 'mount -t tmpfs -o noexec tmpfs "$1" && shift && exec "$@"'
        place = self.folder / "noexec"
        place.mkdir()
        before = ("unshare", "--mount", "--propagation", "private", "sh", "-c", mount, "sh", str(place))
        self.assertEqual(self.fly({"TMPDIR": str(place)}, before=before)[0], self.fly({})[0])

    # --- builds ---------------------------------------------------------------------------------------------------------

    def configure(self, checkout, variables):
        """The build files, and what the launcher said."""
        shutil.rmtree(checkout / "build", ignore_errors=True)
        done = subprocess.run([checkout / "sls", "--no-install", "@tree", "flight", checkout / "build", "flight"],
                              env=self.fill(variables),
                              capture_output=True, text=True, timeout=200, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        return (checkout / "build/build.ninja").read_text(), done.stderr

    def test_builds_have_the_same_files(self):
        checkout = self.folder / "a checkout, ß"
        unneeded = shutil.ignore_patterns("build*", ".git", "node_modules", "__pycache__", "recordings", "campaigns")
        shutil.copytree(ROOT, checkout, ignore=unneeded, symlinks=True)
        # Configures and does not compile.
        real = shlex.quote(shutil.which("cmake"))
        self.write("stand-in/cmake", f'#!/bin/sh\n[ "$1" = --build ] || exec {real} "$@"\n', 0o755)
        with unittest.mock.patch.dict(os.environ, PATH=f"{self.folder}/stand-in:{os.environ['PATH']}"):
            bare, _ = self.configure(checkout, {})
            for name, variables in BUILDS.items():
                with self.subTest(name):
                    files, said = self.configure(checkout, variables)
                    self.assertEqual(files, bare)
                    left = [line for line in said.splitlines() if line.startswith("sls: the build leaves out of your environment: ")]
                    self.assertEqual(len(left), 1, said)
                    expected = {*variables} & {"CC", "CXX", "CXXFLAGS", "CMAKE_PREFIX_PATH", "CMAKE_GENERATOR"}
                    expected |= {f"PATH={self.folder}/conda/bin"} if variables is CONDA else set()
                    self.assertLessEqual(expected, {*left[0].split()})
                    if variables is ROS:
                        self.assertIn(f", the system's; not that in {self.folder}/ros: SLS_FASTDDS_PREFIX={self.folder}/ros in the "
                                      "environment takes it\n", said)
        with self.subTest("a program of the user's with another Eigen than the libraries"):
            self.write("CMakeLists.txt", "cmake_minimum_required(VERSION 3.25)\nproject(small LANGUAGES CXX)\n"
                                         "find_package(sls REQUIRED)\n")
            self.write("ros/share/eigen3/cmake/Eigen3Config.cmake", "set(Eigen3_FOUND TRUE)\n")
            self.write("ros/share/eigen3/cmake/Eigen3ConfigVersion.cmake",
                       "set(PACKAGE_VERSION 9.1)\nset(PACKAGE_VERSION_COMPATIBLE TRUE)\n")
            done = subprocess.run(["cmake", "-S", self.folder, "-B", self.folder / "small", f"-Dsls_DIR={checkout}/build",
                                   f"-DEigen3_DIR={self.folder}/ros/share/eigen3/cmake"], capture_output=True, text=True,
                                  timeout=200, check=False)
            self.assertRegex(" ".join(done.stderr.split()), r"Eigen3: expected [\d.]+, with which sls was built, got 9\.1 in ")
        with self.subTest("flags that move bits, given to CMake"):
            done = subprocess.run(["cmake", "--preset", "flight", "-B", self.folder / "other"], cwd=checkout, capture_output=True,
                                  env={**os.environ, "CXXFLAGS": "-O2 -ffast-math"}, text=True, timeout=200, check=False)
            self.assertIn("flags of the compiler: expected none that moves the bits of recordings, got -ffast-math",
                          " ".join(done.stderr.split()))

"""common/bus/fastdds/find.cmake: which Fast DDS CMake takes, and its one line where the parts do not fit together.

Packages made of a few files stand in for versions 2.9 and 3.1; nothing of this machine's is found."""

import os
import shutil
import subprocess

from folder_test import FolderTest
from places import ROOT

PROJECT = """cmake_minimum_required(VERSION 3.25)
project(small LANGUAGES CXX)
include(%s/common/bus/fastdds/find.cmake)
message(STATUS "major ${sls_fastdds_version}, target ${sls_fastdds_target}")
""" % ROOT
PROGRAMS = [f"-DCMAKE_{name}={shutil.which(program)}" for name, program in
            (("MAKE_PROGRAM", "ninja"), ("CXX_COMPILER", "g++"), ("AR", "ar"), ("RANLIB", "ranlib"))]
CONFIG = """add_library({0} INTERFACE IMPORTED)
set_target_properties({0} PROPERTIES INTERFACE_INCLUDE_DIRECTORIES "${{CMAKE_CURRENT_LIST_DIR}}/../../../include")
"""
VERSION = """set(PACKAGE_VERSION {0})
if(NOT PACKAGE_FIND_VERSION VERSION_GREATER PACKAGE_VERSION)
  set(PACKAGE_VERSION_COMPATIBLE TRUE)
endif()
"""


def join(text):
    """CMake's text without its line breaks, from its first error on."""
    error = text[text.find("CMake Error"):].partition("\n")[2].partition("Call Stack")[0]
    return " ".join(error.split())


class FastDdsTest(FolderTest):
    def setUp(self):
        super().setUp()
        self.write("CMakeLists.txt", PROJECT)

    def add(self, prefix, name, version):
        self.write(f"{prefix}/lib/cmake/{name}/{name}-config.cmake", CONFIG.format(name))
        self.write(f"{prefix}/lib/cmake/{name}/{name}-config-version.cmake", VERSION.format(version))

    def add_headers(self, prefix, version):
        macro, header = ("FASTRTPS", "fastrtps/config.h") if version < "3" else ("FASTDDS", "fastdds/config.hpp")
        self.write(f"{prefix}/include/{header}", f"#define {macro}_VERSION_MAJOR {version[0]}\n")

    def add_cdr(self, prefix, major):
        self.add(prefix, "fastcdr", f"{major}.2.0")
        self.write(f"{prefix}/include/fastcdr/config.h", f"#define FASTCDR_VERSION_MAJOR {major}\n")

    def add_generator(self, version):
        self.write("fastddsgen", f"#!/bin/sh\necho fastddsgen version {version}\n", 0o755)

    def add_2(self, prefix="two"):
        self.add(prefix, "fastrtps", "2.9.1")
        self.add_headers(prefix, "2.9.1")
        self.add_cdr(prefix, 1)
        self.add_generator("2.3.0")

    def add_3(self, prefix="three"):
        self.add(prefix, "fastdds", "3.1.2")
        self.add_headers(prefix, "3.1.2")
        self.add_cdr(prefix, 2)
        self.add_generator("4.0.4")

    def configure(self, *options, prefixes=("two", "three")):
        """Returns the exit code and what CMake said."""
        paths = ";".join(str(self.folder / prefix) for prefix in prefixes)
        environment = {name: value for name, value in os.environ.items() if not name.startswith(("CMAKE", "fast"))}
        done = subprocess.run(
            ["cmake", "-G", "Ninja", "-S", self.folder, "-B", self.folder / "build", f"-DCMAKE_PREFIX_PATH={paths}",
             "-DCMAKE_FIND_USE_CMAKE_SYSTEM_PATH=OFF", "-DCMAKE_FIND_USE_SYSTEM_ENVIRONMENT_PATH=OFF",
             f"-DCMAKE_PROGRAM_PATH={self.folder}", "-DCMAKE_CXX_FLAGS=-nostdinc", *PROGRAMS, *options],
            capture_output=True, text=True, timeout=100, check=False, env=environment)
        return done.returncode, done.stdout + done.stderr

    def expect_taken(self, text, *options, **settings):
        code, said = self.configure(*options, **settings)
        self.assertEqual(code, 0, said)
        self.assertIn(f"-- {text}\n", said)
        return said

    def expect_error(self, text, *options, **settings):
        code, said = self.configure(*options, **settings)
        self.assertEqual(code, 1, said)
        self.assertEqual(join(said).replace(f"{self.folder}/", ""), text)

    def test_each_version_alone_is_taken(self):
        self.add_2()
        self.expect_taken("major 2, target fastrtps")
        self.add_3()
        self.expect_taken("major 3, target fastdds", prefixes=["three"])

    def test_none_is_one_line_that_names_the_packages(self):
        expected = ("Fast DDS: expected fastrtps 2.9 (Debian 12, Ubuntu 24.04: libfastrtps-dev) or fastdds 3 (later "
                    "ones: libfastdds-dev), got ")
        self.expect_error(expected + "nothing")
        self.add("two", "fastrtps", "2.6.4")
        self.expect_error(expected + "2.6.4")

    def test_of_both_the_newer_is_taken_and_named_with_the_way_to_the_other(self):
        self.add_2()
        self.add_3()
        said = self.expect_taken("major 3, target fastdds", prefixes=["three", "two"])
        self.assertIn(f"-- Fast DDS: found 3.1.2 in {self.folder}/three/lib/cmake/fastdds and an earlier one in "
                      f"{self.folder}/two/lib/cmake/fastrtps/fastrtps-config.cmake; takes 3.1.2 (-DSLS_FASTDDS=2 takes "
                      "the other)\n", said)
        self.add_generator("2.3.0")
        self.expect_taken("major 2, target fastrtps", "-DSLS_FASTDDS=2", "-Ufastcdr_DIR")
        self.expect_error("SLS_FASTDDS: expected 2, 3 or nothing, got '4'", "-DSLS_FASTDDS=4")

    def test_headers_that_are_missing_are_named(self):
        self.add_2()
        (self.folder / "two/include/fastrtps/config.h").unlink()
        self.expect_error("Fast DDS 2.9.1 in two/lib/cmake/fastrtps: its headers and libraries do not fit together: "
                          "error: fastrtps/config.h: No such file or directory")
        self.add_headers("two", "2.9.1")  # the check is made again
        self.expect_taken("major 2, target fastrtps")

    def test_headers_of_another_version_are_named(self):
        self.add_2()
        self.add_headers("two", "3.1.2")
        self.expect_error("Fast DDS 2.9.1 in two/lib/cmake/fastrtps: its headers and libraries do not fit together: "
                          "error: #error headers of version 3 come first")
        self.add_3()
        self.write("three/include/fastdds/config.hpp", "#define FASTDDS_VERSION_MAJOR 2\n")
        self.expect_error("Fast DDS 3.1.2 in three/lib/cmake/fastdds: its headers and libraries do not fit together: "
                          "error: static assertion failed: fastdds/config.hpp is of another version",
                          prefixes=["three"])

    def test_fastcdr_of_the_other_version_is_named(self):
        self.add_3()
        self.add_cdr("three", 1)
        self.expect_error("Fast DDS 3.1.2 in three/lib/cmake/fastdds: its headers and libraries do not fit together: "
                          "error: static assertion failed: fastcdr 2 is needed")

    def test_a_generator_of_the_other_version_is_named(self):
        self.add_3()
        self.add_generator("2.3.0")
        self.expect_error("Fast DDS 3.1.2 in three/lib/cmake/fastdds: expected fastddsgen of version 4, got fastddsgen "
                          "version 2.3.0")
        (self.folder / "fastddsgen").unlink()
        self.expect_error("Fast DDS 3.1.2 in three/lib/cmake/fastdds: expected fastddsgen of version 4, got "
                          "FASTDDSGEN-NOTFOUND", "-UFASTDDSGEN")

    def test_a_second_configuration_starts_no_compiler_and_no_generator(self):
        self.add_2()
        self.expect_taken("major 2, target fastrtps")
        self.write("fastddsgen", "#!/bin/sh\nexit 1\n", 0o755)
        (self.folder / "two/include/fastrtps/config.h").unlink()
        self.expect_taken("major 2, target fastrtps")

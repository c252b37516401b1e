"""`./sls run` never flies a stale build, and starts neither CMake nor a compiler if nothing has changed.

The launcher runs in a small checkout, whose programs print a text of their sources. Stand-ins before the real cmake
and ninja record how these are called."""

import re
import shutil
import subprocess
import unittest

from checkout import CheckoutTest
from places import BUILD, ROOT
from sls.launcher.building import FLYING

CMAKE = """cmake_minimum_required(VERSION 3.25)
set(CMAKE_C_COMPILER_WORKS TRUE)  # these two save two builds in each new tree
set(CMAKE_C_ABI_COMPILED TRUE)
project(small LANGUAGES C)
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/bin)
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS CMakePresets.json)
set(programs %s)
foreach(program IN LISTS programs)
  add_executable(${program} main.c)
endforeach()
add_custom_target(flight DEPENDS ${programs})
option(SLS_BUILD_TOOLS "As in the root of the project" ON)
if(SLS_BUILD_TOOLS)
  add_executable(sls_verify main.c)
endif()
""" % " ".join(FLYING)
MAIN = """#include <stdio.h>
#include "text.h"
int main(void) { return puts(TEXT) < 0; }
"""


class BuildTest(CheckoutTest):
    parts = ("CMakePresets.json", "config/scenarios")

    def setUp(self):
        super().setUp()
        self.write("CMakeLists.txt", CMAKE)
        self.write("main.c", MAIN)
        self.write("text.h", '#define TEXT "first"\n')
        for name in ("cmake", "ninja", "make", "dpkg-query", "node", "npm"):
            self.stand_in(name, {"dpkg-query": 'for name; do printf "%s=installed " "$name"; done', "npm": "false",
                                 "node": "echo v18.0.0"}.get(name, f"exec {shutil.which(name)} \"$@\""))

    def write(self, name, text):
        super().write(f"checkout/{name}", text)

    def start(self, root=None):
        return subprocess.Popen([(root or self.root) / "sls", "run", "short", "--in-process"], env=self.environment,
                                cwd=self.folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

    def launch(self, root=None):
        self.calls.write_text("")
        launcher = self.start(root)
        output, errors = launcher.communicate(timeout=200)
        return subprocess.CompletedProcess([], launcher.returncode, output, errors), self.calls.read_text().splitlines()

    def expect_flight(self, text, root=None):
        """Flies; returns the calls of the tools."""
        done, calls = self.launch(root)
        self.assertEqual((done.returncode, done.stdout), (0, text + "\n"), done.stderr)
        return calls

    def expect_built(self, text, root=None):
        calls = self.expect_flight(text, root)
        self.assertTrue(any(call.startswith("cmake --build") for call in calls), calls)

    def expect_not_built(self, text):
        calls = self.expect_flight(text)
        self.assertEqual([re.sub(r" -C \S+", "", call) for call in calls], ["ninja -n flight"])

    def git(self, *words):
        subprocess.run(["git", "-c", "user.name=a", "-c", "user.email=a@example.org", *words], cwd=self.root, check=True,
                       capture_output=True)

    def test_a_flight_after_a_change_is_of_the_changed_sources_and_a_failed_build_does_not_fly(self):
        def list_times():
            return {path: path.stat().st_mtime_ns for path in (self.root / "build").rglob("*")}

        self.expect_built("first")
        before = list_times()
        self.expect_not_built("first")
        self.assertEqual(list_times(), before)  # finding that nothing has changed writes nothing
        self.write("text.h", "#error no text\n")
        for _ in range(2):
            done, _ = self.launch()
            self.assertEqual((done.returncode, done.stdout), (1, ""))
            self.assertIn("text.h:1:2: error: #error no text", done.stderr)
            self.assertRegex(done.stderr, r"sls: error: the build failed \(whole log: \S+/build\.log\)\n$")
        self.write("text.h", '#define TEXT "header"\n')
        self.expect_built("header")
        self.write("main.c", MAIN.replace("TEXT)", '"source")'))
        self.expect_built("source")
        self.write("text.c", 'const char* text(void) { return "new file"; }\n')
        self.write("main.c", MAIN.replace("int main", "const char* text(void);\nint main").replace("TEXT)", "text())"))
        self.write("CMakeLists.txt", CMAKE.replace("main.c", "main.c text.c"))
        self.expect_built("new file")
        self.write("CMakeLists.txt", CMAKE.replace("main.c", "main.c text.c") + "add_compile_definitions(UNUSED)\n")
        self.expect_built("new file")
        self.expect_not_built("new file")

    def test_a_deleted_program_is_made_again(self):
        self.expect_built("first")
        (self.root / "build/bin/closed_loop").unlink()
        self.expect_built("first")
        (self.root / "build/bin/recorder").unlink()
        self.expect_built("first")
        shutil.rmtree(self.root / "build")
        self.expect_built("first")
        self.expect_not_built("first")

    def test_another_branch_is_another_build(self):
        self.write(".gitignore", "build\n")
        self.git("init", "-q", "-b", "one")
        self.git("add", ".")
        self.git("commit", "-q", "-m", "One")
        self.expect_built("first")
        self.git("switch", "-q", "-c", "two")
        self.expect_not_built("first")
        self.write("text.h", '#define TEXT "second"\n')
        self.git("commit", "-q", "-a", "-m", "Two")
        self.expect_built("second")
        self.git("switch", "-q", "one")
        self.expect_built("first")

    def test_another_preset_is_applied_also_one_with_another_compiler(self):
        self.expect_built("first")
        (self.folder / "bin/other_cc").symlink_to(shutil.which("cc"))
        presets = (self.root / "CMakePresets.json").read_text()
        self.assertIn('"CMAKE_BUILD_TYPE": "Release"', presets)
        self.write("text.h", "")
        for text, compiler in (("flag", ""), ("other", '"CMAKE_C_COMPILER": "other_cc", ')):
            self.write("CMakePresets.json", presets.replace(
                '"CMAKE_BUILD_TYPE": "Release"', rf'{compiler}"CMAKE_C_FLAGS": "-DTEXT=\\\"{text}\\\""'))
            self.expect_built(text)
            self.expect_not_built(text)

    def test_a_first_flight_builds_what_it_needs_and_a_whole_tree_stays_whole(self):
        self.assertTrue(any(call.startswith("cmake --preset flight --fresh") for call in self.expect_flight("first")))
        done = subprocess.run([self.root / "sls", "verify"], env=self.environment, cwd=self.folder, capture_output=True,
                              text=True, timeout=200, check=False)
        self.assertEqual((done.returncode, done.stdout), (0, "first\n"), done.stderr)
        self.write("text.h", '#define TEXT "header"\n')
        self.assertTrue(any(call.startswith("cmake --preset release") for call in self.expect_flight("header")))
        self.expect_not_built("header")

    def test_a_long_build_says_how_far_it_is_by_the_lines_of_its_files_once_a_tenth_is_done(self):
        launcher = (self.root / "sls").read_text()
        self.assertIn(" next=15\n", launcher)
        (self.root / "sls").write_text(launcher.replace(" next=15\n", " next=3\n"))  # the first time after 3 s
        self.write("compiler", '#!/bin/sh\ncase "$*" in *closed_loop*) sleep 5 ;; esac\nexec "$@"\n')
        (self.root / "compiler").chmod(0o755)
        self.write("CMakeLists.txt", CMAKE + """add_executable(long long.c)
set_target_properties(${programs} long PROPERTIES C_COMPILER_LAUNCHER ${CMAKE_SOURCE_DIR}/compiler)
add_dependencies(closed_loop sim_server control_client recorder)
add_dependencies(long closed_loop)
add_dependencies(flight long)
""")
        for lines, expected in ((100_000, r"(sls: built 9 of 10 files; about 0 s left\n)?"),
                                (1, r"sls: built [4-7] of 10 files; about \d+ s left\n")):
            self.write("long.c", MAIN + "\n" * lines)
            self.write("text.h", f'#define TEXT "{lines}"\n')
            done, _ = self.launch()
            self.assertRegex("".join(re.findall(r"sls: built .*\n", done.stderr)), f"^{expected}$")
            self.assertRegex(done.stderr, r"sls: \S+/build: configured in \d+ s, compiled in \d+ s\n")

    def test_a_tree_that_was_made_with_make_or_copied_is_made_anew(self):
        subprocess.run(["cmake", "-G", "Unix Makefiles", "-S", self.root, "-B", self.root / "build"], check=True,
                       capture_output=True)
        self.expect_built("first")
        self.expect_not_built("first")
        copy = self.folder / "copy"
        shutil.copytree(self.root, copy)
        (copy / "text.h").write_text('#define TEXT "copy"\n')
        self.expect_built("copy", copy)
        self.assertEqual(self.expect_flight("first")[1:], [])

    def test_a_tree_of_an_earlier_system_or_of_another_fast_dds_is_made_anew(self):
        self.expect_built("first")
        cache = self.root / "build/CMakeCache.txt"
        cache.write_text(re.sub("(?m)^(SLS_MADE_ON:STRING=).*$", r"\1debian 9", cache.read_text()))
        self.assertIn("debian 9", cache.read_text())
        for _ in ("the system is newer", "SLS_FASTDDS_PREFIX is set"):
            calls = self.expect_flight("first")
            self.assertEqual([call for call in calls if "--fresh" in call][0].split()[1:4], ["--preset", "flight", "--fresh"])
            self.expect_not_built("first")
            self.environment["SLS_FASTDDS_PREFIX"] = str(self.folder)

    def test_flights_that_start_together_build_one_after_the_other(self):
        # Two Ninjas in one folder would spoil its files.
        self.write("CMakeLists.txt", CMAKE + """add_custom_command(OUTPUT stamp COMMAND sh -c
          "mkdir alone && sleep 0.2 && rmdir alone && touch stamp" VERBATIM)
add_custom_target(slow DEPENDS stamp)
add_dependencies(closed_loop slow)
""")
        launchers = [self.start() for _ in range(4)]
        for launcher in launchers:
            output, errors = launcher.communicate(timeout=200)
            self.assertEqual((launcher.returncode, output), (0, "first\n"), errors)


class RealTreeTest(unittest.TestCase):
    def setUp(self):
        if not (BUILD / "build.ninja").exists():
            self.skipTest(f"{BUILD} was not made with Ninja")

    def test_a_built_tree_has_nothing_to_do(self):
        # A target that is always out of date would start CMake and Ninja before every flight.
        done = subprocess.run(["ninja", "-C", BUILD, "-n", *FLYING, "sls_view", "_sls_core"], capture_output=True,
                              text=True, timeout=60, check=True)
        self.assertTrue(done.stdout.endswith("ninja: no work to do.\n"), "build first; then: " + done.stdout[-300:])

    def test_cmake_runs_again_when_a_preset_changes(self):
        rule = re.search(r"^build build\.ninja.*?: RERUN_CMAKE.*$", (BUILD / "build.ninja").read_text(), re.MULTILINE)
        self.assertTrue(f" {ROOT}/CMakePresets.json " in rule.group(0), "no rule depends on CMakePresets.json")

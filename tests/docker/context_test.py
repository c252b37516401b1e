"""Tests the files of docker/ without a Docker engine: .dockerignore admits every path that the Dockerfile copies and
every folder that CMake builds without tests."""

import pathlib
import re
import unittest

import yaml
from places import ROOT
from sls.launcher.docker_demo import BASES


def list_allowed():
    """Paths that .dockerignore admits after its first pattern, which excludes everything."""
    lines = (ROOT / ".dockerignore").read_text(encoding="utf-8").split("\n")
    patterns = [line for line in lines if line and not line.startswith("#")]
    assert patterns[0] == "*"
    return {pattern[1:] for pattern in patterns if pattern.startswith("!")}


def is_let_through(path):
    parts = pathlib.PurePosixPath(path).parts
    return any("/".join(parts[:end]) in list_allowed() for end in range(1, len(parts) + 1))


def list_folders_of_cmake():
    """Folders that the root CMakeLists.txt adds if SLS_BUILD_TESTS and SLS_BUILD_FUZZERS are off."""
    text = (ROOT / "CMakeLists.txt").read_text(encoding="utf-8")
    text = re.sub(r"if\(SLS_BUILD_(TESTS|FUZZERS).*?endif\(\)", "", text, flags=re.DOTALL)
    return re.findall(r"add_subdirectory\((\S+)\)", text)


def list_copied():
    text = (ROOT / "docker/Dockerfile").read_text(encoding="utf-8")
    copies = re.findall(r"^COPY (?!--from)(.+) \S+$", text, flags=re.MULTILINE)
    return [path.rstrip("/") for copy in copies for path in copy.split() if path != "."]


class ContextTest(unittest.TestCase):
    def test_all_that_cmake_builds_is_in_the_context(self):
        folders = list_folders_of_cmake()
        self.assertIn("sim_server", folders)
        self.assertEqual([folder for folder in folders if not is_let_through(folder)], [])

    def test_all_that_the_dockerfile_copies_is_in_the_context(self):
        copied = list_copied()
        self.assertIn("config", copied)
        self.assertEqual([path for path in copied if not is_let_through(path)], [])

    def test_the_system_chooses_the_base_in_dockerfile_compose_and_launcher(self):
        dockerfile = (ROOT / "docker/Dockerfile").read_text(encoding="utf-8")
        build = yaml.safe_load((ROOT / "docker/service.yaml").read_text(encoding="utf-8"))["services"]["service"]["build"]
        self.assertEqual(build["args"]["SYSTEM"], "${SLS_SYSTEM:-debian12}")
        self.assertEqual(set(re.findall(r"^FROM (\S+)", dockerfile, re.MULTILINE)), {"$DEBIAN12", "$DEBIAN13", "$SYSTEM"})
        self.assertIn("ARG SYSTEM=debian12\n", dockerfile)
        for system, base in (("debian12", "debian:bookworm-slim"), ("debian13", "debian:trixie-slim")):
            self.assertIn(f"ARG {system.upper()}={base}\nFROM" if system == "debian13" else f"ARG {system.upper()}={base}\n",
                          dockerfile)
            self.assertIn(f"FROM ${system.upper()} AS {system}\n", dockerfile)
            self.assertEqual(build["args"][system.upper()], f"${{SLS_BASE:-{base}}}")
            self.assertEqual(BASES[system], base)

"""Properties of a machine that, besides the scenario, may determine the bits of a flight: processor level,
libraries, versions."""

import hashlib
import os
import platform
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from sls.core import load_core

# Flags of /proc/cpuinfo that each level of the x86-64 psABI adds. numpy and the C library, which own
# measures may use, choose their functions by them. So equal bits are promised only within one level.
LEVEL_FLAGS = (
    ("x86-64-v2", {"cx16", "lahf_lm", "popcnt", "sse4_1", "sse4_2", "ssse3"}),
    ("x86-64-v3", {"avx", "avx2", "bmi1", "bmi2", "f16c", "fma", "abm", "movbe"}),
    ("x86-64-v4", {"avx512f", "avx512bw", "avx512cd", "avx512dq", "avx512vl"}),
)
# Features that glibc's sin and cos check. A processor may have some of them without the whole level.
LIBM_FLAGS = {"fma", "fma4", "avx2", "avx"}


def calc_level(architecture: str, flags: set[str]) -> str:
    """The feature level, such as `x86-64-v3`; for other architectures the architecture's name."""
    if architecture != "x86_64":
        return architecture
    level = "x86-64-v1"
    for name, needed in LEVEL_FLAGS:
        if not needed <= flags:
            break
        level = name
    return level


def read_flags() -> set[str]:
    try:
        for line in Path("/proc/cpuinfo").read_text().splitlines():
            if line.startswith("flags"):
                return set(line.partition(":")[2].split())
    except OSError:
        pass
    return set()


def find_version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "none"


@cache
def describe_machine() -> dict[str, str]:
    """Everything that could change a bit of the table, by name. Machines with equal descriptions give
    equal rows. `core`: hash of the compiled module `_sls_core`."""
    flags = read_flags()
    return {
        "level": calc_level(platform.machine(), flags),
        "libm": " ".join(sorted(LIBM_FLAGS & flags)),
        "tunables": os.environ.get("GLIBC_TUNABLES", ""),
        "libc": " ".join(platform.libc_ver()),
        "python": platform.python_version(),
        "numpy": find_version("numpy"),
        "scipy": find_version("scipy"),
        "core": hashlib.sha256(Path(str(load_core().__file__)).read_bytes()).hexdigest()[:16],
    }


def host_name() -> str:
    return platform.node()


def find_difference(expected: dict[str, str], got: dict[str, str]) -> str:
    """A phrase that describes the first difference; empty if there is none."""
    for name in sorted({*expected, *got}):
        if expected.get(name) != got.get(name):
            return f"{name}: expected {expected.get(name) or 'none'}, got {got.get(name) or 'none'}"
    return ""

"""Recorded numbers depend neither on the C library's elementary functions nor on the processor.

usage: same_bits_test.py CHECK BUILD
  symbols       programs and Python module need no function of libm but exact ones
  instructions  neither they nor Simbody hold fused instructions
  calls         the sources call nothing whose bits depend on the version of Eigen
  flights       every shipped scenario: no call of an inexact function of libm, the same certificate with the
                processor's features masked: with all masks for one scenario of each plant and autopilot, else with the
                one that masks most
"""

import json
import os
import platform
import re
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

CHECK, BUILD = sys.argv[1], Path(sys.argv[2])
ROOT = Path(__file__).resolve().parents[2]
SHIM = BUILD / "tests/libraries/math_shim.so"

# IEEE 754 asks for the nearest result of the square root; the others only select, round or scale: they have one result.
EXACT = {"sqrt", "fabs", "floor", "ceil", "trunc", "round", "lround", "llround", "rint", "lrint", "llrint", "nearbyint",
         "fmod", "remainder", "ldexp", "frexp", "scalbn", "modf", "nextafter", "fmax", "fmin", "copysign"}
# Since Eigen 5 these add from left to right, before in halves: common/model/dot.hpp. The others call dot().
BY_VERSION = re.compile(r"(?:\.|->)(?:dot|slerp|angularDistance|setFromTwoVectors)\(|\bFromTwoVectors\(")
# Masks of features by which glibc and others choose their code.
MASKS = ("", "-AVX2,-FMA,-FMA4",
         "-AVX,-AVX2,-FMA,-FMA4,-AVX512F,-AVX512VL,-AVX512DQ,-AVX512BW,-AVX512CD,-SSE4_1,-SSE4_2")
# Simbody asks for the decimal digits of a double when it is loaded; they serve its text.
HARMLESS = ("log10", "1", "libSimTKcommon")

LONG = re.compile(r"\bfor_s: \d{3}\b")  # a stage whose later steps are like the earlier ones


def list_programs() -> list[Path]:
    programs = [BUILD / "bin" / name for name in ("closed_loop", "sim_server", "control_client", "recorder")]
    return programs + sorted((BUILD / "python").glob("_sls_core.*.so"))


def list_symbols(file: Path, which: str) -> set[str]:
    """Names of a file's dynamic symbols without their versions."""
    lines = subprocess.run(["nm", "-D", which, file], check=True, capture_output=True, text=True).stdout.splitlines()
    return {line.split()[-1].split("@")[0] for line in lines if line}


def find_library(program: Path, name: str) -> Path:
    lines = subprocess.run(["ldd", program], check=True, capture_output=True, text=True).stdout.splitlines()
    return Path(next(line.split("=>")[1].split()[0] for line in lines if line.strip().startswith(name)))


def check_symbols() -> list[str]:
    libm = list_symbols(find_library(BUILD / "bin/closed_loop", "libm.so"), "--defined-only")
    assert {"sin", "cos", "pow", "hypotf"} <= libm, "expected the symbols of libm"
    errors = []
    for program in list_programs():
        inexact = sorted(list_symbols(program, "--undefined-only") & libm - EXACT)
        if inexact:
            errors.append(f"{program.name}: expected functions of common/model/math.hpp, got {', '.join(inexact)}")
    return errors


def check_instructions() -> list[str]:
    if platform.machine() != "x86_64":
        return []
    simbody = [find_library(BUILD / "bin/closed_loop", f"libSimTK{name}") for name in ("common", "math", "simbody")]
    errors = []
    for file in list_programs() + simbody:
        found = subprocess.run(["sh", "-c", 'objdump -d --no-show-raw-insn "$1" | grep -cE "vfn?m(add|sub)"', "sh", file],
                               check=False, capture_output=True, text=True).stdout.strip()
        if found != "0":
            errors.append(f"{file.name}: expected no fused instruction, got {found}")
    return errors


def check_calls() -> list[str]:
    sources = [file for folder in ("common", "sim_server", "control_client", "closed_loop", "recorder", "python/bindings")
               for file in (ROOT / folder).rglob("*.[ch]pp")]
    assert len(sources) > 100 and BY_VERSION.search("a.dot(b)"), "expected sources"
    return [f"{file.relative_to(ROOT)}:{number}: expected model::dot() or a formula, got {call[0]}"
            for file in sources for number, line in enumerate(file.read_text(encoding="utf-8").splitlines(), 1)
            for call in BY_VERSION.finditer(line.partition("//")[0])]


def fly(scenario: Path, mask: str, folder: Path) -> tuple[str, list[str]]:
    """Certificate of a flight in process, and the inexact functions that it called."""
    out, calls = folder / "recording", folder / "calls"
    text = scenario.read_text(encoding="utf-8")
    if (shorter := LONG.sub("for_s: 32", text)) != text:
        scenario = folder / scenario.name
        scenario.write_text(shorter, encoding="utf-8")
    environment = os.environ | {"LD_PRELOAD": str(SHIM), "SLS_MATH_CALLS": str(calls)}
    if mask:
        environment["GLIBC_TUNABLES"] = f"glibc.cpu.hwcaps={mask}"
    subprocess.run([BUILD / "bin/closed_loop", "--scenario", scenario, "--out", out], check=True, env=environment,
                   capture_output=True, text=True)
    found = [line.split(maxsplit=2) for line in calls.read_text(encoding="utf-8").splitlines()]
    return (json.loads((out / "manifest.json").read_text(encoding="utf-8"))["certificate"],
            [" ".join(call) for call in found
             if call[:2] != list(HARMLESS[:2]) or not Path(call[2]).name.startswith(HARMLESS[2])])


def choose_masks(scenarios: list[Path]) -> dict[Path, tuple[str, ...]]:
    """The masks of each scenario: all for the first with its plant and autopilot."""
    chosen, seen = dict[Path, tuple[str, ...]](), set[tuple[str, ...]]()
    for scenario in scenarios:
        models = tuple(sorted(re.findall(r"\bmodel: (\w+)", scenario.read_text(encoding="utf-8"))))
        chosen[scenario] = MASKS[:1] if platform.machine() != "x86_64" else (
            MASKS[::len(MASKS) - 1] if models in seen else MASKS)
        seen.add(models)
    return chosen


def check_flight(scenario: Path, masks: tuple[str, ...]) -> list[str]:
    certificates, errors = {}, []
    for mask in masks:
        with tempfile.TemporaryDirectory() as folder:
            certificates[mask], calls = fly(scenario, mask, Path(folder))
        if calls:
            errors.append(f"{scenario.stem}: expected no inexact function of libm, got {'; '.join(calls)}")
    if len(set(certificates.values())) != 1:
        errors.append(f"{scenario.stem}: expected one certificate, got {certificates}")
    return errors


def check_flights() -> list[str]:
    with tempfile.TemporaryDirectory() as folder:  # the shim counts
        calls = Path(folder) / "calls"
        subprocess.run(["/usr/bin/python3", "-c", "import math, sys; math.sin(len(sys.argv))"], check=True,
                       env=os.environ | {"LD_PRELOAD": str(SHIM), "SLS_MATH_CALLS": str(calls)})
        assert "sin 1 " in calls.read_text(encoding="utf-8"), "expected a call of sin by Python"
    scenarios = sorted((ROOT / "config/scenarios").glob("*.yaml"))
    assert scenarios, "expected scenarios"
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        masks = choose_masks(scenarios)
        return [error for errors in pool.map(check_flight, masks, masks.values()) for error in errors]


failures = {"symbols": check_symbols, "instructions": check_instructions, "calls": check_calls,
            "flights": check_flights}[CHECK]()
if failures:
    sys.exit("\n".join(failures))

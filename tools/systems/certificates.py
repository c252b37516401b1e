"""Flies scenarios in one process on several processors and prints their certificates as a table.

The processors are those of this machine with features of its C library masked (GLIBC_TUNABLES), models that qemu-x86_64
emulates, and ARM, emulated by qemu-aarch64. The certificate of every scenario must be the same on all of them. The
exceptions are plants that Simbody integrates on ARM, because Debian's Simbody for ARM uses fused instructions:
docs/arm.md."""

import argparse
import concurrent.futures
import csv
import json
import os
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass, field
from pathlib import Path

import yaml

ROOT = Path(__file__).resolve().parents[2]
LONGEST_FLIGHT_S = 900.0  # of one scenario, on a busy machine
NO_FMA = "-FMA,-FMA4,-AVX512F,-AVX512VL,-AVX512DQ,-AVX512BW"
MASKS = {"no AVX": f"-AVX,-AVX2,{NO_FMA}", "AVX, no FMA": NO_FMA}
MODELS = ("qemu64", "Nehalem", "Haswell")  # without AVX: the first two; the last has AVX2 and FMA
WITHOUT_SIMBODY = ("analytic",)  # plants
DIGITS = 8  # of a certificate, in the table
COLUMNS = 31


@dataclass(frozen=True, eq=False)
class Processor:
    name: str
    programs: Path  # folder of closed_loop
    prefix: tuple[str, ...] = ()  # starts a program
    environment: dict[str, str] = field(default_factory=dict)
    is_arm: bool = False


@dataclass(frozen=True)
class Flight:
    """What one scenario gave on one processor. `load` has the rows x, y, z of the first vehicle's load, in m."""
    certificate: str
    error: str
    load: list[list[float]]


def find_emulator(name: str, tree: Path | None) -> str | None:
    """qemu-NAME of the tree or of this machine."""
    places = [str(tree / "usr/bin")] if tree else []
    return next(filter(None, (shutil.which(f"qemu-{name}{ending}", path=place)
                              for place in [*places, os.environ.get("PATH", "")] for ending in ("", "-static"))), None)


def list_processors(build: Path, arm_build: Path | None, tree: Path | None) -> list[Processor]:
    """This machine first, with which the others are compared. Without an emulator, fewer."""
    programs = build / "bin"
    found = [Processor("this machine", programs)]
    found += [Processor(name, programs, environment={"GLIBC_TUNABLES": f"glibc.cpu.hwcaps={mask}"})
              for name, mask in MASKS.items()]
    if emulator := find_emulator("x86_64", tree):
        found += [Processor(model, programs, (emulator, "-cpu", model)) for model in MODELS]
    emulator = find_emulator("aarch64", tree)
    if arm_build and emulator:
        # Debian's links to BLAS and LAPACK are absolute: from outside the tree they lead to this machine's.
        places = ":".join(f"/usr/lib/aarch64-linux-gnu/{name}" for name in ("blas", "lapack"))
        libraries = ("-L", str(tree), "-E", f"LD_LIBRARY_PATH={places}") if tree else ()
        found.append(Processor("aarch64", arm_build / "bin", (emulator, *libraries), is_arm=True))
    return found


def find_plant(scenario: yaml.MappingNode) -> yaml.MappingNode | None:
    return next((value for key, value in scenario.value if key.value == "plant"), None)


def find_model(scenario: yaml.MappingNode) -> str:
    plant = find_plant(scenario)
    named = [value.value for key, value in (plant.value if plant else []) if key.value == "model"]
    return named[0] if named else "slung_load"


def make_text(text: str) -> yaml.ScalarNode:
    return yaml.ScalarNode("tag:yaml.org,2002:str", text)


def write_analytic(scenario: yaml.MappingNode, file: Path) -> None:
    """Writes the scenario with the plant `analytic`, which has no key `pendulum`."""
    plant = find_plant(scenario)
    if not plant:
        plant = yaml.MappingNode("tag:yaml.org,2002:map", [])
        scenario.value.append((make_text("plant"), plant))
    plant.value = [(key, value) for key, value in plant.value if key.value not in ("model", "pendulum")]
    plant.value.append((make_text("model"), make_text("analytic")))
    file.write_text(yaml.serialize(scenario), encoding="utf-8")


def list_scenarios(names: list[str], folder: Path) -> dict[str, tuple[Path, str]]:
    """{name: (file, plant)} of shipped scenarios, all by default. Those of slung_load a second time with the plant
    analytic, written to `folder`, so that ARM flies every law and every fault without Simbody."""
    found: dict[str, tuple[Path, str]] = {}
    for file in sorted((ROOT / "config/scenarios").glob("*.yaml")):
        if names and file.stem not in names:
            continue
        scenario = yaml.compose(file.read_text(encoding="utf-8"))
        found[file.stem] = file, find_model(scenario)
        if found[file.stem][1] == "slung_load":
            variant = folder / f"{file.stem}-analytic.yaml"
            write_analytic(scenario, variant)
            found[variant.stem] = variant, "analytic"
    return found


def read_load(file: Path) -> list[list[float]]:
    with open(file, encoding="utf-8", newline="") as rows:
        return [[float(row[f"load_{axis}_m"]) for axis in "xyz"] for row in csv.DictReader(rows)
                if row["vehicle_id"] == "0"]


def fly(processor: Processor, scenario: Path, keeps_load: bool) -> Flight:
    with tempfile.TemporaryDirectory(prefix="sls-certificates-") as folder:
        recording = Path(folder) / "recording"
        try:
            done = subprocess.run(
                [*processor.prefix, str(processor.programs / "closed_loop"), "--scenario", str(scenario), "--out",
                 str(recording)], env={**os.environ, **processor.environment}, stdin=subprocess.DEVNULL,
                capture_output=True, text=True, timeout=LONGEST_FLIGHT_S, check=False)
        except subprocess.TimeoutExpired:
            return Flight("", f"has not ended after {LONGEST_FLIGHT_S:.0f} s", [])
        if done.returncode != 0:
            last = (done.stderr.strip().splitlines() or ["no message"])[-1]
            return Flight("", f"exit code {done.returncode}: {last}", [])
        manifest = json.loads((recording / "manifest.json").read_text(encoding="utf-8"))
        return Flight(manifest["certificate"], "", read_load(recording / "state.csv") if keeps_load else [])


def calc_difference(flight: Flight, reference: Flight) -> float:
    """The largest difference of a coordinate of the load, in m; infinite for flights of different length."""
    if len(flight.load) != len(reference.load):
        return float("inf")
    return max(abs(a - b) for one, other in zip(flight.load, reference.load, strict=True)
               for a, b in zip(one, other, strict=True))


def judge(flights: dict[Processor, Flight], plant: str) -> tuple[dict[str, str], list[str], bool]:
    """({processor: cell of the table}, defects, whether only Simbody for ARM makes a difference). The first flight is
    the reference."""
    reference = next(iter(flights.values()))
    cells, defects, is_fused = {}, [], False
    for processor, flight in flights.items():
        cells[processor.name] = flight.certificate[:DIGITS] or "failed"
        if flight.error:
            defects.append(f"{processor.name}: {flight.error}")
        elif flight.certificate == reference.certificate:
            continue
        elif processor.is_arm and plant not in WITHOUT_SIMBODY:
            is_fused = True
            cells[processor.name] = f"{calc_difference(flight, reference):.1e} m"
        else:
            defects.append(f"{processor.name}: expected certificate {reference.certificate[:DIGITS]}…, got "
                           f"{flight.certificate[:DIGITS]}…")
    return cells, defects, is_fused


def print_table(processors: list[Processor], names: list[str] | None = None, jobs: int = 0) -> bool:
    """Flies the named shipped scenarios (all by default) and prints the table. True if the certificates are as they
    must be. The variants with the plant analytic do not fly on emulated x86 models, to save time."""
    with tempfile.TemporaryDirectory(prefix="sls-scenarios-") as folder, \
            concurrent.futures.ThreadPoolExecutor(jobs or os.cpu_count()) as pool:
        scenarios = list_scenarios(names or [], Path(folder))
        flying = {name: {processor: pool.submit(fly, processor, file, plant not in WITHOUT_SIMBODY)
                         for processor in processors
                         if processor.is_arm or not processor.prefix or file.parent != Path(folder)}
                  for name, (file, plant) in scenarios.items()}
        print(f"{'scenario':{COLUMNS}}  {'plant':10}", *(f"{processor.name:>12}" for processor in processors),
              flush=True)
        all_defects, fused = [], 0
        for name, (_, plant) in scenarios.items():
            flights = {processor: flight.result() for processor, flight in flying.pop(name).items()}
            cells, defects, is_fused = judge(flights, plant)
            all_defects += [f"{name}: {'; '.join(defects)}"] if defects else []
            fused += is_fused
            print(f"{name:{COLUMNS}}  {plant:10}",
                  *(f"{cells.get(processor.name, '-'):>12}" for processor in processors), flush=True)
    for defect in all_defects:
        print(f"error: {defect}")
    print(f"{len(scenarios)} scenarios on {len(processors)} processors: " +
          (f"{len(all_defects)} without one certificate" if all_defects else "one certificate each") +
          (f"; {fused} of Simbody's differ on ARM, by the length in the table (docs/arm.md)" if fused else ""))
    return not all_defects


def find_unknown(names: list[str]) -> str:
    """An error line for the first name that is no shipped scenario; or nothing."""
    known = {file.stem for file in (ROOT / "config/scenarios").glob("*.yaml")}
    return next((f"SCENARIO: expected a name in config/scenarios, got '{name}'" for name in names
                 if name not in known), "")


def main() -> int:
    parser = argparse.ArgumentParser(prog="tools/systems/certificates.py", description=__doc__)
    parser.add_argument("scenarios", nargs="*", metavar="SCENARIO", help="name in config/scenarios (default: all)")
    parser.add_argument("--build", type=Path, default=ROOT / "build", metavar="DIR",
                        help="build of this machine (default: build)")
    parser.add_argument("--arm-build", type=Path, metavar="DIR", help="build for ARM (default: none)")
    parser.add_argument("--tree", type=Path, metavar="DIR",
                        help="folder with ARM's libraries, and emulators (default: those of this machine)")
    arguments = parser.parse_args()
    for build in filter(None, (arguments.build, arguments.arm_build)):
        if not (build / "bin/closed_loop").is_file():
            print(f"certificates.py: error: {build}: expected a build with bin/closed_loop, got none",
                  file=sys.stderr)
            return 2
    if defect := find_unknown(arguments.scenarios):
        print(f"certificates.py: error: {defect}", file=sys.stderr)
        return 2
    return 0 if print_table(list_processors(arguments.build, arguments.arm_build, arguments.tree),
                            arguments.scenarios) else 1


if __name__ == "__main__":
    sys.exit(main())

"""Cross-builds for ARM in a clean Debian 12, flies under emulation, and prints a table: ./sls systems aarch64.

The commands are those of docs/arm.md. The certificate of each shipped scenario is compared between this machine, its
feature levels, emulated x86 models and emulated ARM. Then a client on emulated ARM flies over DDS with a server and a
recorder of this machine. Whatever is mounted is in a mount namespace that ends with its processes."""

import argparse
import hashlib
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import certificates
import tree as trees

ROOT = certificates.ROOT
DOCUMENT = ROOT / "docs/arm.md"
BUILD = ROOT / "build-aarch64"  # of the preset
NATIVE_PROGRAMS = ("closed_loop", "recorder", "sim_server")
HOST_TOOLS = ("debootstrap", "unshare", "ip")
NEEDED_GB = 4  # 2.4 for the tree, 0.1 for the build, the rest while packages are unpacked
LIMITS_S = {"debootstrap": 900, "packages": 1800, "build": 7200, "flight": 600}
DDS_SCENARIOS = ("figure_eight", "figure_eight_pid", "multirotor_figure_eight")
ISOLATED = ("unshare", "--mount", "--propagation", "private", "--pid", "--fork", "--kill-child")
# $1 is the tree, $2 the project, which has the same path inside, $3 the commands.
ENTER = """set -e
mount -t proc proc "$1/proc"
mount --rbind /dev "$1/dev"
mkdir -p "$1$2"
mount --bind "$2" "$1$2"
cd /
exec chroot "$1" /bin/sh -e -c "cd '$2'
$3"
"""
# $1 is the folder of server and recorder, $2 the scenario, $3 the recording; the client's command follows. A network of
# their own: other flights of this machine do not take part.
FLY = """set -e
ip link set lo up
bin=$1 scenario=$2 recording=$3 qos=config/qos/udp.xml
shift 3
"$bin/recorder" --out "$recording" --qos $qos & recorder=$!
"$bin/sim_server" --scenario "$scenario" --qos $qos & server=$!
"$@" --scenario "$scenario" --qos $qos
wait $server
wait $recorder
"""


class StepError(Exception):
    """What failed, in one line."""


def run(what: str, command: list[str], log: Path, environment: dict[str, str] | None = None) -> None:
    """Runs a command that may take LIMITS_S[what]; its output goes to `log`.

    Raises:
        StepError: it failed or took longer.
    """
    with open(log, "a", encoding="utf-8") as output:
        try:
            code = subprocess.run(command, stdin=subprocess.DEVNULL, stdout=output, stderr=subprocess.STDOUT, cwd=ROOT,
                                  env=environment, timeout=LIMITS_S[what], check=False).returncode
            result = f"exit code {code}"
        except subprocess.TimeoutExpired:
            result = f"no end after {LIMITS_S[what]} s"
    if result != "exit code 0":
        last = (log.read_text(encoding="utf-8", errors="replace").strip().splitlines() or ["no output"])[-1]
        raise StepError(f"{what}: expected exit code 0, got {result}: {last} (whole log: {log})")


def read_commands() -> tuple[str, str]:
    """(the commands of docs/arm.md that install packages, those that build)."""
    section = DOCUMENT.read_text(encoding="utf-8").split("\n## Building\n")[1].split("\n## ")[0]
    commands = "".join(line.removeprefix("    ") for line in section.splitlines(keepends=True)
                       if line.startswith("    "))
    packages, cmake, build = commands.partition("cmake --preset")
    return packages, cmake + build


@contextmanager
def system_tree(named: Path | None) -> Iterator[Path]:
    """The folder of the tree: the named one, which stays, or a temporary one."""
    if named:
        yield named.resolve()
        return
    folder = Path(tempfile.mkdtemp(prefix="sls-aarch64-", dir=os.environ.get("TMPDIR", "/var/tmp"))).resolve()
    try:
        yield folder
    finally:
        try:
            trees.remove(folder)
        except trees.Failure as failure:  # mounted, but never by this program
            print(f"sls: {failure}", file=sys.stderr)


@contextmanager
def log_file() -> Iterator[Path]:
    """A file for the output of commands, which stays if an error names it."""
    descriptor, name = tempfile.mkstemp(prefix="sls-aarch64-", suffix=".log")
    os.close(descriptor)
    is_named = False
    try:
        yield Path(name)
    except StepError as error:
        is_named = name in str(error)
        raise
    finally:
        if not is_named:
            os.unlink(name)


def make_tree(tree: Path, log: Path) -> None:
    """Makes a Debian 12 with the packages of docs/arm.md, unless the folder holds it."""
    packages = read_commands()[0]
    stamp, wanted = tree / "sls-aarch64.stamp", hashlib.sha256(packages.encode()).hexdigest()
    if stamp.is_file() and stamp.read_text(encoding="utf-8") == wanted:
        return
    tree.mkdir(parents=True, exist_ok=True)
    if not (tree / "debootstrap.done").is_file():
        if any(tree.iterdir()):
            raise StepError(f"--tree: {tree}: expected a tree of this command, or an empty folder, got other files")
        print("making a Debian 12 with debootstrap", flush=True)
        run("debootstrap", [*ISOLATED, "debootstrap", "--variant=minbase", "bookworm", str(tree), trees.find_mirror()],
            log)
        (tree / "debootstrap.done").touch()
    (tree / "etc/dpkg/dpkg.cfg.d/no_sync").write_text("force-unsafe-io\n", encoding="utf-8")
    (tree / "etc/apt/apt.conf.d/yes").write_text('APT::Get::Assume-Yes "true";\n', encoding="utf-8")
    for file in (Path("/etc/resolv.conf"), Path("/etc/hosts"), *Path("/etc/apt/apt.conf.d").glob("*proxy*")):
        if file.is_file():
            shutil.copy(file, f"{tree}{file}")  # settings with which this machine reaches the mirror
    print("installing the packages of docs/arm.md", flush=True)
    run("packages", enter(tree, packages + "apt-get clean\n"), log, clean_environment())
    stamp.write_text(wanted, encoding="utf-8")


def enter(tree: Path, commands: str) -> list[str]:
    return [*ISOLATED, "sh", "-c", ENTER, "sh", str(tree), str(ROOT), commands]


def clean_environment() -> dict[str, str]:
    kept = {name: value for name, value in os.environ.items() if name.lower().endswith("_proxy")}
    return {**kept, "PATH": "/usr/sbin:/usr/bin:/sbin:/bin", "DEBIAN_FRONTEND": "noninteractive", "LC_ALL": "C.UTF-8"}


def fly_over_dds(build: Path, tree: Path, scenario: Path, log: Path) -> str:
    """Flies with a client on emulated ARM; returns the certificate of a complete recording."""
    emulator = certificates.find_emulator("aarch64", tree)
    environment = {name: value for name, value in os.environ.items() if name not in
                   ("SLS_DOMAIN", "FASTRTPS_DEFAULT_PROFILES_FILE", "ROS_DISCOVERY_SERVER")}
    with tempfile.TemporaryDirectory(prefix="sls-aarch64-flight-") as folder:
        recording = Path(folder) / "recording"
        run("flight", [*ISOLATED, "--net", "sh", "-c", FLY, "sh", str(build / "bin"), str(scenario), str(recording),
                       str(emulator), "-L", str(tree), str(BUILD / "bin/control_client")], log, environment)
        manifest = json.loads((recording / "manifest.json").read_text(encoding="utf-8"))
    if not manifest["complete"] or manifest["missing"]:
        raise StepError(f"{scenario.stem}: expected a complete recording, got one with missing rows (log: {log})")
    return manifest["certificate"]


def count_fused(tree: Path) -> int:
    """Number of fused multiply-adds in closed_loop for ARM. Its own code must have none: `-ffp-contract=off` and Eigen
    without vector instructions."""
    said = subprocess.run(enter(tree, "aarch64-linux-gnu-objdump -d build-aarch64/bin/closed_loop\n"), check=True,
                          capture_output=True, text=True, env=clean_environment(), timeout=LIMITS_S["flight"]).stdout
    return len(re.findall(r"\tf(?:n?m(?:add|sub)|ml[as])\t", said))


def print_flights(build: Path, tree: Path, log: Path) -> bool:
    """Flies DDS_SCENARIOS with the client on ARM; true if their certificates are those of this machine."""
    is_equal = True
    for name in DDS_SCENARIOS:
        scenario = ROOT / f"config/scenarios/{name}.yaml"
        here = certificates.fly(certificates.Processor("this machine", build / "bin"), scenario, False)
        began = time.monotonic()
        got = fly_over_dds(build, tree, scenario, log)
        is_same = got == here.certificate
        is_equal &= is_same
        print(f"over DDS, client on ARM: {name}: {got[:8]}, " +
              ("the certificate of this machine" if is_same else f"expected {here.certificate[:8]}") +
              f", {time.monotonic() - began:.0f} s", flush=True)
    return is_equal


def check_machine(build: Path) -> str:
    """What this machine lacks, in one line; or nothing."""
    if os.geteuid() != 0:
        return "expected root, because a system of its own is made and entered, got another user"
    missing = [tool for tool in HOST_TOOLS if not shutil.which(tool)]
    if missing:
        return f"expected {' '.join(HOST_TOOLS)}, got no {' '.join(missing)}: apt-get install debootstrap iproute2"
    if not all((build / "bin" / program).is_file() for program in NATIVE_PROGRAMS):
        return f"{build}: expected the programs of this machine, got none; run ./sls build"
    return ""


def check_space(folder: Path) -> None:
    while not folder.exists():
        folder = folder.parent
    free_gb = shutil.disk_usage(folder).free / 1e9
    if free_gb < NEEDED_GB:
        raise StepError(f"{folder}: expected {NEEDED_GB} GB of free space, got {free_gb:.1f} GB")


def end(number: int, _frame: object) -> None:
    sys.exit(128 + number)


def main() -> int:
    parser = argparse.ArgumentParser(prog="./sls systems aarch64", description=__doc__)
    parser.add_argument("scenarios", nargs="*", metavar="SCENARIO",
                        help="name in config/scenarios (default: all; 20 minutes on two processors)")
    parser.add_argument("--build", type=Path, default=ROOT / "build", metavar="DIR",
                        help="build of this machine (default: build)")
    parser.add_argument("--tree", type=Path, metavar="DIR",
                        help="folder of the Debian 12, kept for the next time (default: a temporary one)")
    arguments = parser.parse_args()
    build = arguments.build.resolve()
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, end)
    defect = certificates.find_unknown(arguments.scenarios) or check_machine(build)
    if defect:
        print(f"sls: error: {defect}", file=sys.stderr)
        return 2
    try:
        with log_file() as log, system_tree(arguments.tree) as tree:
            if not (tree / "sls-aarch64.stamp").is_file():
                check_space(tree)
            make_tree(tree, log)
            print("building for ARM", flush=True)
            run("build", enter(tree, read_commands()[1]), log, clean_environment())
            fused = count_fused(tree)
            print(f"fused instructions in closed_loop for ARM: {fused}, expected 0", flush=True)
            processors = certificates.list_processors(build, BUILD, tree)
            is_one = certificates.print_table(processors, arguments.scenarios)
            return 0 if print_flights(build, tree, log) and is_one and fused == 0 else 1
    except StepError as error:
        print(f"sls: error: {error}", file=sys.stderr)
        return 1


if __name__ == "__main__":
    sys.exit(main())

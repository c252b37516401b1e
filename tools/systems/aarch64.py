"""What ./sls systems does in the tree aarch64, a Debian 12: it runs the commands of docs/arm.md there, compares the
certificates of the shipped scenarios on this machine, its feature levels, emulated x86 models and emulated ARM, and
flies a client on emulated ARM over DDS with a server and a recorder of this machine."""

import json
import re
import shutil
import sys

import tree as trees

ROOT = trees.ROOT
BUILD = "build-aarch64"  # of the preset
DDS_SCENARIOS = ("figure_eight", "figure_eight_pid", "multirotor_figure_eight")
# Instructions that round a product and a sum once. Our own code must have none: -ffp-contract=off, Eigen not vectorised.
FUSED = "[[:space:]]f(n?m(add|sub)|ml[as])[[:space:]]"
# $1 is the checkout of this machine, $2 the scenario, $3 a folder for the recordings; the client's command follows. A
# network of their own: other flights of this machine do not take part.
FLY = """set -e
unset SLS_DOMAIN ROS_DISCOVERY_SERVER FASTRTPS_DEFAULT_PROFILES_FILE FASTDDS_DEFAULT_PROFILES_FILE
ip link set lo up
mkdir -p "$3"
cd "$1"
flight="--scenario config/scenarios/$2.yaml" out=$3 qos="--qos config/qos/udp.xml"
shift 3
build/bin/recorder --out "$out/dds" $qos & recorder=$!
build/bin/sim_server $flight $qos & server=$!
"$@" $flight $qos
wait $server
wait $recorder
build/bin/closed_loop $flight --out "$out/here"
"""


def list_scenarios(only):
    """Names of shipped scenarios that match `only`.

    @throws Failure if there are none."""
    try:
        names = [file.stem for file in sorted((ROOT / "config/scenarios").glob("*.yaml")) if re.search(only, file.stem)]
    except re.error as error:
        raise trees.Failure(f"--only: expected a regular expression, got '{only}': {error}") from None
    if not names:
        raise trees.Failure(f"--only: expected to match a name in config/scenarios, got '{only}'")
    return names


def check(arguments):
    """@throws Failure where something is missing, before a tree is made."""
    for program in ("closed_loop", "recorder", "sim_server"):
        if not (ROOT / "build/bin" / program).is_file():
            raise trees.Failure(f"{ROOT / 'build/bin' / program}: expected a program of this machine, got none; run "
                                "./sls build")
    if not shutil.which("ip"):
        raise trees.Failure("ip is missing: apt-get install iproute2")
    list_scenarios(arguments.only or "")


def read_commands():
    """(the commands of docs/arm.md that install packages, those that build)."""
    section = (ROOT / "docs/arm.md").read_text(encoding="utf-8").split("\n## Building\n")[1].split("\n## ")[0]
    commands = "".join(line.removeprefix("    ") for line in section.splitlines(keepends=True)
                       if line.startswith("    "))
    packages, cmake, build = commands.partition("cmake --preset")
    return packages, cmake + build


def fly_over_dds(system, scenario, client, column):
    """Flies with this command of a client; the row names the certificate, which must be that of a flight in process."""
    row, out = f"over DDS: {scenario}", system.path / "recordings" / scenario
    if column.run(row, system, f"dds-{scenario}", "unshare", "--net", "sh", "-c", FLY, "sh", ROOT, scenario, out, *client,
                  here=True):
        flown, here = (json.loads((out / name / "manifest.json").read_text(encoding="utf-8")) for name in ("dds", "here"))
        is_same = flown["complete"] and not flown["missing"] and flown["certificate"] == here["certificate"]
        column.is_good &= is_same
        column.rows[row] += f", {flown['certificate'][:8]}" + (
            "" if is_same else f" and missing: {flown['missing']}, expected {here['certificate'][:8]} and nothing missing")


def look_at(system, arguments, column):
    """Builds and flies. Prints the table of the certificates; the rest is rows of the column.

    @throws Failure if the packages or the build fail."""
    packages, build = read_commands()
    packages = packages.replace("http://deb.debian.org/debian", trees.find_mirror())
    system.variables["DEBIAN_FRONTEND"] = "noninteractive"
    for name, commands in (("packages", packages), ("build", build)):
        if not column.run(name, system, name, "sh", "-e", "-c", commands):
            system.check(name, 1)
    fused = system.ask(f"aarch64-linux-gnu-objdump -d {BUILD}/bin/closed_loop | grep -cE '{FUSED}' || true")
    column.rows["fused instructions"] = fused
    column.is_good &= fused == "0"
    column.run("certificates", system, "certificates", sys.executable, "-B", ROOT / "tools/systems/certificates.py",
               "--arm-build", system.checkout / BUILD, "--tree", system.path,
               *(list_scenarios(arguments.only) if arguments.only else []), here=True)
    print(system.log("certificates").read_text(encoding="utf-8"), flush=True)
    client = (system.path / "usr/bin/qemu-aarch64", "-L", system.path, system.checkout / BUILD / "bin/control_client")
    for scenario in DDS_SCENARIOS:
        fly_over_dds(system, scenario, client, column)

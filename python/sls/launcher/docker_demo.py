"""`./sls docker-demo`: builds the image and flies one of the compose files."""

import os
import re
import shutil
import subprocess
import tempfile
import threading
import time
from pathlib import Path

from sls.launcher.arguments import Parser
from sls.launcher.building import call_script, run, run_logged
from sls.launcher.flights import print_summary
from sls.launcher.place import ROOT, Failure, find_file, list_choices, say
from sls.launcher.supervision import Supervisor

NAMES = ("plain", "discovery", "standby", "secure", "fleet")
BASES = {"debian12": "debian:bookworm-slim", "debian13": "debian:trixie-slim"}
HALVES = ("0-3", "4-7")
TEXT = """\
Builds the image, flies in containers and prints the summary of ./sls demo.
NAME is one of
  plain      server, controller, recorder on a network of containers (default)
  discovery  the same through a discovery server
  standby    two controllers; the first is killed in flight
  secure     with DDS Security; SLS_KEYS: the folder that ./sls keys made
             (default: new keys)
  fleet      eight vehicles: one server flies 0 to 3, another 4 to 7

SLS_IMAGE names an existing image to use; SLS_SYSTEM the system of a new one,
debian12 or debian13 (default: debian12); SLS_BASE its base (default:
debian:bookworm-slim or debian:trixie-slim). Needs a Docker engine with docker
compose or docker-compose."""


def is_done(*command: str | Path, limit_s: float | None = None) -> bool:
    try:
        return subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=False,
                              timeout=limit_s).returncode == 0
    except (OSError, subprocess.TimeoutExpired):
        return False


# --- the image ------------------------------------------------------------------------------------


def find_compose() -> list[str]:
    if not is_done("docker", "version"):
        raise Failure("no Docker engine answers: expected one, such as of apt-get install docker.io docker-compose")
    if is_done("docker", "compose", "version"):
        return ["docker", "compose"]
    if shutil.which("docker-compose"):
        return ["docker-compose"]
    raise Failure("expected docker compose or docker-compose, got neither: apt-get install docker-compose")


def make_base(base: str) -> None:
    if is_done("docker", "image", "inspect", base):
        return
    say(f"pulling {base}")
    if is_done("docker", "pull", "--quiet", base, limit_s=120):
        return
    say("no image registry gives it: making it from Debian's packages")
    if os.geteuid() != 0:
        raise Failure(f"this needs root once: sudo docker/base-image.sh {base}")
    if not shutil.which("debootstrap"):
        call_script("@install", "debootstrap")
    run(ROOT / "docker/base-image.sh", base)


def build_image() -> None:
    if os.environ.get("SLS_IMAGE"):
        return
    system = os.environ.get("SLS_SYSTEM") or "debian12"
    if system not in BASES:
        raise Failure(f"SLS_SYSTEM: expected one of {' '.join(BASES)}, got '{system}'", 2)
    base = os.environ.get("SLS_BASE") or BASES[system]
    make_base(base)
    if shutil.which("npm"):  # this machine may trust a proxy that the base image does not
        call_script("@npm", ROOT / "tools/view/page")
    log = tempfile.mkstemp()[1]
    say(f"building the image sls for {system}, for the first time some minutes (log: {log})")
    # An engine without BuildKit pulls the base of both systems, so both are the one that is here.
    is_built, _ = run_logged(
        Path(log), "docker", "build", "--build-arg", f"SYSTEM={system}", "--build-arg", f"DEBIAN12={base}",
        "--build-arg", f"DEBIAN13={base}", "-f", ROOT / "docker/Dockerfile", "-t", "sls", "-t", f"sls:{system}", ROOT)
    if not is_built:
        raise Failure(f"the image was not built (whole log: {log})")
    os.unlink(log)


# --- the flight -----------------------------------------------------------------------------------


def fly(name: str, compose: list[str], recording: Path) -> int:
    """Flies; afterwards no container is left, and no network."""
    project = f"sls-demo-{os.getpid()}"
    file = f"docker/compose{'' if name == 'plain' else '.' + name}.yaml"
    compose = [*compose, "--project-name", project, "--file", str(ROOT / file)]
    say(f"flying {Path(os.environ['SLS_SCENARIO']).stem} with {file}")

    def find(service: str) -> str:
        words = ["docker", "ps", "--all", "--quiet", "--filter", f"label=com.docker.compose.project={project}",
                 "--filter", f"label=com.docker.compose.service={service}"]
        return subprocess.run(words, capture_output=True, text=True, check=False).stdout.strip()

    def kill_in_flight(container: str) -> None:
        """Kills the first controller once the recording has 800 of its steps."""
        rows = recording / "command.csv"
        while not rows.is_file() or rows.read_text(encoding="utf-8", errors="replace").count(",primary") <= 800:
            if is_over.wait(0.02):
                return
        if is_done("docker", "kill", container):
            say("killed the first controller")

    services, is_over = ["recorder", "server", "controller"], threading.Event()
    with Supervisor() as supervisor:
        try:
            done = subprocess.run([*compose, "up", "--no-start"], stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                                  text=True, check=False)
            if done.returncode != 0:
                say(*done.stdout.splitlines()[-5:])
                raise Failure("the containers were not made")
            if name == "fleet":
                services = [f"{service}-{half}" for service in services for half in HALVES]
            elif name == "discovery":
                is_done("docker", "start", find("discovery"))
            elif name == "standby":
                services[2] = "standby"
                is_done("docker", "start", find("controller"))  # its end does not end the flight
                threading.Thread(target=kill_in_flight, args=[find("controller")], daemon=True).start()
            for service in services:  # a process that passes on signals, output and exit code of the container
                supervisor.start(service, ["sh", "-c", 'exec docker start --attach "$1" >&2', "sh", find(service)],
                                 patience_s=60)
            return supervisor.wait_all()
        finally:
            is_over.set()
            if not is_done(*compose, "down", "--volumes", "--timeout", "30"):
                say("warning: docker compose down failed: see docker ps --all")


def prepare(name: str, scenario: Path, scratch: Path, user: str) -> None:
    """Sets the variables that the compose files read."""
    if name == "secure":
        keys = scratch / "keys"
        if os.environ.get("SLS_KEYS"):
            shutil.copytree(os.environ["SLS_KEYS"], keys)
        else:
            run(ROOT / "config/security/keys.sh", keys)
        run("chown", "-R", user, keys)
        os.environ["SLS_KEYS"] = str(keys)
    if name == "fleet":
        text = scenario.read_text(encoding="utf-8")
        scenario = scratch / scenario.name
        scenario.write_text(text if re.search("^vehicles:", text, re.MULTILINE) else text + "\nvehicles: 8\n",
                            encoding="utf-8")
        scratch.chmod(0o755)
    os.environ["SLS_SCENARIO"] = str(scenario)


def docker_demo(words: list[str]) -> int:
    parser = Parser("docker-demo", "[NAME] [OPTIONS]", TEXT)
    parser.add_argument("--scenario", metavar="SCENARIO", default="figure_eight",
                        help="a name in config/scenarios or a path (default: figure_eight)")
    parser.add_argument("--out", metavar="DIR", help="folder of the recording, new or empty; of a fleet it has a "
                        "folder for each server's vehicles (default: recordings/docker-NAME-UTCTIME)")
    parser.add_argument("--build", action="store_true", help="build only the image, for use with docker compose")
    options, name = parser.parse(words, "name", "plain")
    if name not in NAMES:
        raise Failure(f"docker-demo: expected {list_choices(NAMES)}, got '{name}'", 2)
    scenario = Path(find_file("scenarios", options.scenario)).resolve()
    when = time.strftime("%Y%m%dT%H%M%SZ", time.gmtime())
    recording = Path(options.out or f"recordings/docker-{name}-{when}").resolve()
    if recording.exists() and (not recording.is_dir() or any(recording.iterdir())):
        raise Failure(f"{recording}: expected a new or empty folder, got files in it", 2)
    compose = find_compose()
    build_image()
    if options.build:
        return 0

    parts = [recording / half for half in HALVES] if name == "fleet" else [recording]
    for part in parts:
        part.mkdir(parents=True, exist_ok=True)
    # No program runs as root. If the caller is root, the image's user owns the folders during the flight.
    is_root = os.geteuid() == 0
    user = "1000:1000" if is_root else f"{os.geteuid()}:{os.getegid()}"
    with tempfile.TemporaryDirectory() as scratch:
        try:
            if is_root:
                run("chown", "-R", user, recording)
            prepare(name, scenario, Path(scratch), user)
            os.environ.update(SLS_USER=user, SLS_RECORDING=str(recording))
            code = fly(name, compose, recording)
        finally:
            if is_root:
                run("chown", "-R", "0:0", recording)
    if code == 0:
        for part in parts:
            print_summary(part)
    return code

"""sls_add_flight_test, and examples/ci as its user has it: the shell lines are those of the workflow, run against an
installation. tests/package runs them all in a clean Debian."""

import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest
import yaml
from own_domain import own_domain
from places import BUILD, ROOT


@pytest.fixture(scope="module")
def prefix(tmp_path_factory):
    folder = tmp_path_factory.mktemp("installed")
    subprocess.run(["cmake", "--install", BUILD, "--prefix", folder], check=True, capture_output=True)
    return folder


@pytest.fixture
def run(prefix):
    """A function that runs shell lines in a folder as GitHub does, with the installation."""
    kept = {key: value for key, value in os.environ.items() if not key.startswith(("SLS_", "PYTHONPATH"))}
    environment = {**kept, "PATH": f"{prefix}/bin:{os.environ['PATH']}", "CMAKE_PREFIX_PATH": str(prefix)}

    def run(folder, lines, code=0, **more):
        done = subprocess.run(["sh", "-e", "-c", lines], cwd=folder, env={**environment, **more}, text=True,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=400)
        assert (done.returncode != 0) == bool(code), done.stdout
        return done.stdout
    return run


@pytest.fixture
def folder(prefix, tmp_path):
    return Path(shutil.copytree(prefix / "share/doc/sls/examples/ci", tmp_path / "ci"))


def read_steps(folder):
    """The steps of the workflow's job by the first word of their names."""
    workflow = yaml.safe_load((folder / ".github/workflows/flights.yml").read_text())
    assert set(workflow) == {"name", True, "jobs"}  # YAML 1.1 reads the key `on` as true
    job, = workflow["jobs"].values()
    assert set(job) == {"runs-on", "timeout-minutes", "container", "steps"} and job["container"] == "debian:12"
    for step in job["steps"]:
        assert set(step) <= {"name", "env", "if", "run", "uses", "with"} and ("run" in step) != ("uses" in step), step
        assert re.fullmatch(r"actions/[\w-]+@v\d+", step.get("uses", "actions/none@v0"))
    return {step["name"].split()[0]: step for step in job["steps"] if "name" in step}


def test_the_story_from_nothing_to_a_red_job_is_true(run, prefix, tmp_path):
    """Each command of the document, with the output that it shows. They are those of the job."""
    page = (ROOT / "docs/testing-your-controller.md").read_text()
    story = re.search(r"## 5\. From nothing to a red job\n(.*?)\n## ", page, re.DOTALL)[1]
    shown = re.findall(r"^    \$ (.*)\n((?:    (?!\$).*\n)*)", story + "\n", re.MULTILINE)
    (install, _), (copy, _), *rest = shown
    assert install.endswith("./sls.deb")
    run(tmp_path, copy.replace("/usr/share", f"{prefix}/share"))
    steps = read_steps(tmp_path / "mine")
    for command, output in rest:
        said = run(tmp_path / "mine", command, code="not held" in output, CFLAGS="-Werror")
        pattern = ".*?".join(re.escape(part) for part in re.sub("^    ", "", output, flags=re.M).split("…"))
        assert re.search(pattern, said, re.DOTALL), said
    commands = [command for command, _ in rest]
    assert [commands.count(steps[name]["run"]) for name in ("Build", "Fly")] == [2, 2]
    assert {file.name for file in (tmp_path / "mine").glob(steps["Publish"]["with"]["path"])} == {"flight", "flight.xml"}


def test_the_services_of_the_compose_file_fly_what_the_check_expects(run, folder, prefix):
    """Without an engine: the commands of its services, with the paths that the volumes and the image give them."""
    services = yaml.safe_load((folder / "compose.yaml").read_text())["services"]
    assert list(services) == ["server", "recorder", "controller"]
    image = re.findall(r"^COPY (\S+) (\S+)$", (folder / "Dockerfile").read_text(), re.MULTILINE)
    assert image == [("scenario.yaml", "/flight/"), ("build/my_law.so", "/flight/build/")]
    run(folder, read_steps(folder)["Build"]["run"])
    processes = []
    with own_domain() as domain:
        for name, service in services.items():
            assert service["image"] == ("${MY_IMAGE:-my-controller}" if "build" in service else "${SLS_IMAGE:-sls}")
            words = service["command"]
            for own, path in (volume.split(":")[:2] for volume in service.get("volumes", [".:/flight"])):
                words = [str(folder / word.replace(path, own, 1)) if word.startswith(path) else word for word in words]
            processes.append(subprocess.Popen([prefix / "bin" / words[0], *words[1:], f"--domain={domain}"],
                                              cwd=prefix / "share/sls", stderr=(folder / f"{name}.log").open("w")))
        try:
            codes = [process.wait(60) for process in processes]
        finally:
            for process in processes:
                process.kill()
    assert codes == [0, 0, 0], [file.read_text() for file in folder.glob("*.log")]
    assert "1 held" in run(folder, "sls check check.yaml --recording recording")


@pytest.mark.skipif(os.geteuid() != 0, reason="network namespaces need root")
def test_hosts_with_delay_fly_the_same_bytes(run, tmp_path):
    """The check of `short` has a certificate."""
    assert "1 held" in run(tmp_path, "sls check short --placement hosts --under delay_ms=1,jitter_ms=2,loss=0.05")


@pytest.mark.parametrize("arguments, expected", [
    ("NAME a CHECK none.yaml", r"sls_add_flight_test\(a\): CHECK: expected a file, got /.*/none.yaml"),
    ("NAME a FILE none.yaml", r"sls_add_flight_test: expected NAME and CHECK, and maybe .*, got: NAME;a;FILE"),
    ("NAME a CHECK check.yaml PLACEMENT shm udp UNDER loss=0.2 busy TIMEOUT 7",
     r'/bin/sls" "check" "\S+/check.yaml" .*"--placement" "shm,udp" "--under" "loss=0.2,busy"\) .* TIMEOUT "7"')])
def test_the_function_passes_its_words_on_and_names_mistakes(run, tmp_path, arguments, expected):
    (tmp_path / "CMakeLists.txt").write_text("cmake_minimum_required(VERSION 3.25)\nproject(a NONE)\nenable_testing()\n"
        f"find_package(sls REQUIRED COMPONENTS headers)\nsls_add_flight_test({arguments})\n")
    (tmp_path / "check.yaml").touch()
    said = run(tmp_path, "cmake -B build", code="TIMEOUT" not in arguments)
    if "TIMEOUT" in arguments:
        said = (tmp_path / "build/CTestTestfile.cmake").read_text()
    assert re.search(expected, re.sub(r"\s+", " ", said)), said

"""Set-up and build, which the file `sls` does, and programs that take the place of the launcher."""

import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn

from sls.launcher.place import BUILD, IS_BUILT_ELSEWHERE, IS_INSTALLED, PYTHON_PATH, ROOT, Failure

FLYING = ("sim_server", "control_client", "recorder", "closed_loop")
PROGRAMS = (*FLYING, "sim_ctl", "sls_verify", "sls_convert", "delay_margin", "sls_doctor", "sls_view")
PYTHON = "/usr/bin/python3"

is_installing = True  # False with --no-install


def call_script(action: str, *words: str | Path) -> None:
    """Runs an action of the file `sls`. It has printed what failed."""
    flags = [] if is_installing else ["--no-install"]
    code = subprocess.run([ROOT / "sls", *flags, action, *words], check=False).returncode
    if code != 0:
        raise SystemExit(code if code > 0 else 128 - code)


def setup(*lists: str) -> None:
    """Installs what building and flying need, and packages or lists of packages of the file `sls`."""
    call_script("@setup", *lists)


def install_missing(*lists: str) -> None:
    if is_installing:
        call_script("@install", *lists)


def install_node_modules(folder: Path) -> None:
    call_script("@npm", folder)


def build_tree(preset: str, folder: Path, *targets: str) -> None:
    call_script("@tree", preset, folder, *targets)


def build_programs(*targets: str) -> None:
    """Brings the targets up to date. A build made elsewhere (SLS_BUILD) is used unchanged."""
    if not IS_BUILT_ELSEWHERE and not IS_INSTALLED:
        call_script("@build", *targets)


def run(*command: str | Path, **more: str | Path) -> None:
    """Runs a command, with its exit code if it fails."""
    code = subprocess.run(command, check=False, **more).returncode  # type: ignore[call-overload]
    if code != 0:
        raise SystemExit(code if code > 0 else 128 - code)


def replace_by(*command: str | Path, **variables: str) -> NoReturn:
    """Executes a command in place of the launcher, with these environment variables added."""
    sys.stdout.flush()
    try:
        os.execvpe(command[0], [str(word) for word in command], {**os.environ, **variables})
    except OSError as error:
        raise Failure(f"{command[0]}: {error.strerror}") from None


def replace_by_python(*words: str | Path, paths: Sequence[str] = PYTHON_PATH, **variables: str) -> NoReturn:
    """-P: Python imports nothing from the working folder; -B: it writes no compiled files."""
    replace_by(PYTHON, "-BP", *words, PYTHONPATH=":".join(paths), **variables)


def replace_by_program(name: str, words: Sequence[str], folder: str = "bin") -> NoReturn:
    """Builds a program and executes it. To print its help it is used as it is."""
    program = BUILD / folder / name
    if not (is_help_asked(words) and os.access(program, os.X_OK)):
        build_programs(name)
    replace_by(program, *words)


def is_help_asked(words: Sequence[str]) -> bool:
    return "--help" in words or "-h" in words

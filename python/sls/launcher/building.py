"""Set-up and build, which the file `sls` does, and programs that take the place of the launcher."""

import os
import re
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NoReturn

from sls.launcher.place import BUILD, IS_BUILT_ELSEWHERE, IS_INSTALLED, IS_OF_PIP, PYTHON_PATH, ROOT, Failure, say

FLYING = ("sim_server", "control_client", "recorder", "closed_loop")
PROGRAMS = (*FLYING, "sim_ctl", "sls_verify", "sls_convert", "delay_margin", "sls_doctor", "sls_view",
            "sls_worlds")
PYTHON = sys.executable  # Debian's, or that of a virtual environment

is_installing = True  # False with --no-install


def run(*command: str | Path, **more: Any) -> None:
    """Runs a command; ends with its exit code if it fails."""
    code = subprocess.run(command, check=False, **more).returncode
    if code != 0:
        raise SystemExit(code if code > 0 else 128 - code)


def run_logged(log: Path, *command: str | Path, **more: Any) -> tuple[bool, str]:
    """Runs a command with its output in `log`; returns whether it succeeded, and the output. Prints the errors."""
    with log.open("wb") as said:
        done = subprocess.run(command, check=False, stdout=said, stderr=said, **more)
    text = log.read_text(encoding="utf-8", errors="replace")
    if done.returncode != 0:
        lines = text.splitlines()
        errors = [line for line in lines if re.search(r"[eE]rror|ERROR|SUMMARY|what\(\)", line)]
        say(*(errors[:20] or lines[-15:]))
    return done.returncode == 0, text


def call_script(action: str, *words: str | Path) -> None:
    """Runs an action of the file `sls`, see its end: @setup LIST…, @install LIST…, @npm FOLDER, @tree PRESET FOLDER
    TARGET…, @build TARGET…. A pip installation has no such file: a command that lacks a package says so."""
    if IS_OF_PIP:
        return
    run(ROOT / "sls", *([] if is_installing else ["--no-install"]), action, *words)


def build_programs(*targets: str) -> None:
    """Brings the targets up to date. A build made elsewhere (SLS_BUILD) is used unchanged."""
    if not IS_BUILT_ELSEWHERE and not IS_INSTALLED:
        call_script("@build", *targets)


def replace_by(*command: str | Path, **variables: str) -> NoReturn:
    """Executes a command in place of the launcher, with these environment variables added."""
    sys.stdout.flush()
    try:
        os.execvpe(command[0], [str(word) for word in command], {**os.environ, **variables})
    except OSError as error:
        raise Failure(f"{command[0]}: {error.strerror}") from None


def replace_by_module(name: str, *words: str | Path, paths: Sequence[str] = PYTHON_PATH, **variables: str) -> NoReturn:
    """-P: Python imports nothing from the working folder; -B: it writes no compiled files."""
    replace_by(PYTHON, "-BP", "-m", name, *words, PYTHONPATH=":".join(paths), **variables)


def replace_by_program(name: str, words: Sequence[str], folder: str = "bin") -> NoReturn:
    """Builds a program and executes it. To print its help it is used as it is."""
    program = BUILD / folder / name
    if not (is_help_asked(words) and os.access(program, os.X_OK)):
        build_programs(name)
    replace_by(program, *words)


def is_help_asked(words: Sequence[str]) -> bool:
    return "--help" in words or "-h" in words

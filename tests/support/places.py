"""The project and the build tree that is tested (SLS_BUILD), and how tests start its launcher and its Python."""

import os
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
BUILD = Path(os.environ.get("SLS_BUILD", ROOT / "build")).resolve()


def launch(*words, code=0, timeout=200, **options):
    """Runs ./sls. Its exit code must be `code`."""
    done = subprocess.run([ROOT / "sls", *map(str, words)], capture_output=True, text=True, timeout=timeout, **options)
    assert done.returncode == code, done.stdout + done.stderr
    return done


def run_python(code, **options):
    """Runs code in another Python with the package."""
    return subprocess.run(["/usr/bin/python3", "-B", "-c", code], capture_output=True, text=True, timeout=100, **options)

"""Runs a command of `./sls`. Works as a script, too, from any folder and without PYTHONPATH."""

import sys
from pathlib import Path


def start() -> int:
    """Runs the command of the command line; returns its exit code, 130 after Ctrl-C."""
    try:
        from sls.launcher.commands import main
        from sls.launcher.place import printing
        code = 0
        with printing():
            code = main(sys.argv[1:])
        return code
    except KeyboardInterrupt:
        return 130


if __name__ == "__main__":
    package = str(Path(__file__).resolve().parents[2])
    if package not in sys.path:
        sys.path.insert(0, package)
    sys.exit(start())

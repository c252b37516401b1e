"""Runs a command of `./sls`. Works as a script, too, from any folder and without PYTHONPATH."""

import sys
from pathlib import Path

if __name__ == "__main__":
    package = str(Path(__file__).resolve().parents[2])
    if package not in sys.path:
        sys.path.insert(0, package)
    try:
        from sls.launcher.commands import main
        sys.exit(main(sys.argv[1:]))
    except KeyboardInterrupt:
        sys.exit(130)

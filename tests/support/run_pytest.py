"""Runs pytest on the given files with Debian's Python: run_pytest.py FILE…. Exit code 77 if a package is missing, which is
found without importing it: that would take a second."""

import sys
from importlib.util import find_spec

if missing := [name for name in ("numpy", "pytest", "scipy", "yaml") if not find_spec(name)]:
    print(f"skipped: no module {', '.join(missing)} (apt-get install python3-pytest python3-scipy python3-yaml)")
    sys.exit(77)
import pytest  # noqa: E402

sys.exit(pytest.main(["-q", "-rs", "-p", "no:cacheprovider", *sys.argv[1:]]))

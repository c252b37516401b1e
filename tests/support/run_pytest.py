"""Runs pytest on the given files with Debian's Python: run_pytest.py FILE…. The files and the programs that they start may
import the package, its module in the build tree SLS_BUILD, and tests/support. Exit code 77 if a package is missing, which is
found without importing it: that would take a second."""

import os
import sys
import tempfile
from importlib.util import find_spec

from places import BUILD, ROOT

if missing := [name for name in ("matplotlib", "numpy", "pytest", "scipy", "yaml") if not find_spec(name)]:
    print("skipped: expected Debian's packages " + ", ".join(f"python3-{name}" for name in missing))
    sys.exit(77)
import pytest  # noqa: E402

package = [str(ROOT / "python"), str(BUILD / "python")]
sys.path[:0] = package
with tempfile.TemporaryDirectory() as cache:  # matplotlib must not write into the home folder
    os.environ |= {"SLS_BUILD": str(BUILD), "PYTHONPATH": os.pathsep.join(package), "MPLCONFIGDIR": cache}
    sys.exit(pytest.main(["-q", "-rs", "-p", "no:cacheprovider", *sys.argv[1:]]))

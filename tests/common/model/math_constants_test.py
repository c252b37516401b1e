"""math_constants.hpp is what math_constants.py writes, except for white space. usage: math_constants_test.py FOLDER"""

import subprocess
import sys
from pathlib import Path

folder = Path(sys.argv[1])
written = subprocess.run([sys.executable, "-B", folder / "math_constants.py"], check=True, capture_output=True,
                         encoding="utf-8").stdout


def to_tokens(text: str) -> str:
    return "".join(text.replace("///", "").replace("//", "").split())


if to_tokens(written) != to_tokens((folder / "math_constants.hpp").read_text(encoding="utf-8")):
    sys.exit("common/model/math_constants.hpp: expected what math_constants.py writes")

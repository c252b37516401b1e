"""Where the launcher is and what it says: paths, messages, names of scenarios."""

import os
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
# An installed tree is PREFIX/share/sls. Its `bin` is a link to the programs, and nothing is built.
IS_INSTALLED = ROOT.parts[-2:] == ("share", "sls") and not (ROOT / "CMakeLists.txt").is_file()
SELF = "sls" if IS_INSTALLED else "./sls"
IS_BUILT_ELSEWHERE = bool(os.environ.get("SLS_BUILD"))
BUILD = Path(os.environ.get("SLS_BUILD") or (ROOT if IS_INSTALLED else ROOT / "build"))
PYTHON_PATH = [str(ROOT / "python"), str(BUILD / "python")]
if IS_INSTALLED:
    PYTHON_PATH.append(str(ROOT.parents[1] / "lib/python3/dist-packages"))


class Failure(Exception):
    """Ends the launcher with one line and an exit code."""

    def __init__(self, text: str, code: int = 1) -> None:
        super().__init__(text)
        self.code = code


def say(text: str) -> None:
    text = text.replace("see ./sls", f"see {SELF}")
    print(f"sls: {text}", file=sys.stderr, flush=True)


def list_names(kind: str) -> list[str]:
    """Names of the files of config/KIND, which commands take instead of a path."""
    return sorted(file.stem for file in (ROOT / "config" / kind).glob("*.yaml"))


def find_scenario(name: str) -> str:
    """The file of a scenario; a name means that in config/scenarios."""
    if "/" in name or name.endswith(".yaml") or os.path.isfile(name):
        return name
    return str(ROOT / f"config/scenarios/{name}.yaml")

"""Where the launcher is and what it says: paths, messages, names of scenarios."""

import codecs
import difflib
import os
import re
import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

PACKAGE = Path(__file__).resolve().parents[1]
IS_OF_PIP = (PACKAGE / "config").is_dir()  # with the programs in the package, and nothing else
ROOT = PACKAGE if IS_OF_PIP else PACKAGE.parents[1]
# The Debian package's tree is PREFIX/share/sls; its `bin` is a link to the programs. Nothing is built there.
IS_INSTALLED = IS_OF_PIP or ROOT.parts[-2:] == ("share", "sls") and not (ROOT / "CMakeLists.txt").is_file()
START = (sys.executable, "-BP", str(PACKAGE / "launcher/__main__.py"))  # begins a command of the launcher
SELF = "sls" if IS_INSTALLED else "./sls"
IS_BUILT_ELSEWHERE = bool(os.environ.get("SLS_BUILD"))
BUILD = Path(os.environ.get("SLS_BUILD") or (ROOT if IS_INSTALLED else ROOT / "build"))
PYTHON_PATH = [] if IS_OF_PIP else [str(ROOT / "python"), str(BUILD / "python")]
if IS_INSTALLED and not IS_OF_PIP:
    PYTHON_PATH.append(str(ROOT.parents[1] / "lib/python3/dist-packages"))
# The middleware reads them. Flights that tests or checks start must not: they have a domain and a profile of their own.
STRAY_VARIABLES = ("ROS_DISCOVERY_SERVER", "ROS_SUPER_CLIENT", "FASTRTPS_DEFAULT_PROFILES_FILE", "SLS_DOMAIN",
                   "FASTDDS_DEFAULT_PROFILES_FILE", "FASTDDS_ENVIRONMENT_FILE", "FASTDDS_BUILTIN_TRANSPORTS")


class Failure(Exception):
    """Ends the launcher with one line and an exit code."""

    def __init__(self, text: str, code: int = 1) -> None:
        super().__init__(text)
        self.code = code


# C0, DEL, C1, separators of lines, changes of direction, bytes that are not UTF-8.
CONTROLS = re.compile("[\0-\x1f\x7f-\x9f\u2028-\u202e\u2066-\u2069\ud800-\udfff]")


def escape_controls(text: object) -> str:
    """`text`, which may be of a file or of the network, in one line that cannot control a terminal."""
    return CONTROLS.sub(lambda found: found[0].encode("unicode_escape").decode(), str(text))


def say(*lines: str) -> None:
    text = "\n".join(map(escape_controls, lines)).replace("see ./sls", f"see {SELF}")
    try:
        print(f"sls: {text}", file=sys.stderr, flush=True)
    except OSError:
        drop(2)


def drop(descriptor: int) -> None:
    """What is still written there is lost: it has no reader, or its disk is full."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), descriptor)


SIGNS = {"≤": "<=", "≥": ">=", "…": "...", "×": "x", "–": "-"}


def spell(error: UnicodeError) -> tuple[str, int]:
    """What ASCII or Latin-1 lack, in letters of ASCII."""
    assert isinstance(error, UnicodeEncodeError)
    text = "".join(SIGNS.get(sign, sign) for sign in error.object[error.start:error.end])
    return text.encode("ascii", "backslashreplace").decode(), error.end


codecs.register_error("spell", spell)


@contextmanager
def printing() -> Iterator[None]:
    """In it, standard output takes every text in any encoding, and its reader may go, as `head` does."""
    if hasattr(sys.stdout, "reconfigure"):
        sys.stdout.reconfigure(errors="spell")
    try:
        yield
        if sys.stdout:
            sys.stdout.flush()
    except BrokenPipeError:
        drop(1)
    except OSError:
        try:
            sys.stdout.flush()
        except OSError:
            drop(1)  # else Python 3.14 fails again at its end and makes the exit code 120
        raise


def show(text: str) -> None:
    """Prints `text`, which may have several lines, on standard output."""
    print("\n".join(map(escape_controls, text.split("\n"))))


def list_names(kind: str) -> list[str]:
    """Names of the files of config/KIND, which commands take instead of a path."""
    return sorted(file.stem for file in (ROOT / "config" / kind).glob("*.yaml"))


def list_choices(names: Sequence[str]) -> str:
    return f"{', '.join(names[:-1])} or {names[-1]}"


def suggest(word: str, names: Iterable[str]) -> str:
    """The end of an error line: the name that is nearest to the word, if one is near."""
    near = difflib.get_close_matches(word, list(names), 1, 0.65)
    return f"; did you mean '{near[0]}'?" if near else ""


def expect_no_folder_of_recordings(name: str) -> None:
    """Raises Failure, which names the newest recordings in the folder."""
    found = [file.parent for file in Path(name).glob("*/manifest.json")]
    if found and not Path(name, "manifest.json").exists():
        newest = sorted(found, key=lambda folder: folder.stat().st_mtime, reverse=True)[:3]
        raise Failure(f"{name}: expected a recording, got a folder of {len(found)}; the newest: "
                      + ", ".join(map(str, newest)), 2)


def find_file(kind: str, name: str) -> str:
    """The file of a scenario or a campaign. A name means that in config/KIND, `scenarios` or `campaigns`.

    @throws Failure if there is none."""
    is_path = "/" in name or name.endswith((".yaml", ".yml")) or os.path.isfile(name)
    file = name if is_path else str(ROOT / f"config/{kind}/{name}.yaml")
    if not os.path.exists(file):
        raise Failure(f"{file}: expected a {kind[:-1]}, got no such file"
                      + suggest(Path(name).stem, list_names(kind)), 2)
    return file

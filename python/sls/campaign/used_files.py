"""Files that decide rows beside the campaign's own: shared libraries of the scenarios, and modules that own
measures import. The plan holds their hashes; a rebuilt or edited one is refused."""

import hashlib
import os
import sys
import sysconfig
from pathlib import Path

import yaml

from sls.campaign.campaign import Campaign
from sls.input_error import InputError
from sls.strict_files import open_regular

# Python, whose version the plan holds, and this package, which the user does not change.
OTHERS = [Path(sysconfig.get_path("stdlib")).resolve(), Path(__file__).resolve().parents[1]]
STARTED = {"__main__", "sitecustomize", "usercustomize"}  # modules that Python itself starts
PACKAGES = {"site-packages", "dist-packages"}  # folders of installed packages


def list_libraries(campaign: Campaign) -> set[Path]:
    """The shared libraries that the base scenario and the campaign name."""
    texts = [token.value for text in (campaign.base_text, campaign.text) for token in yaml.scan(text)
             if isinstance(token, yaml.ScalarToken)]
    return {(campaign.base.parent / text).resolve() for text in texts if text.endswith(".so")}


def list_modules() -> set[Path]:
    """The files of all modules of this process that are neither installed nor of this package."""
    files = {Path(file).resolve() for name, module in list(sys.modules.items())
             if name not in STARTED and (file := getattr(module, "__file__", None))}
    return {file for file in files if file.suffix in (".py", ".so") and file.is_file()
            and not any(map(file.is_relative_to, OTHERS)) and not PACKAGES & set(file.parts)
            and not file.name.startswith("_sls_core")}


def hash_used_files(campaign: Campaign) -> dict[str, str]:
    """SHA-256 by path of the libraries, and of the modules if there are own measures, which must have been
    called once. The path of a file beside the campaign or its base is relative to the campaign's folder:
    they may move together."""
    folder, base = campaign.file.resolve().parent, campaign.base.resolve().parent
    files = list_libraries(campaign) | (list_modules() if campaign.own_measures else set())
    return {os.path.relpath(file, folder) if file.is_relative_to(folder) or file.is_relative_to(base)
            else str(file): calc_hash(file) for file in sorted(files)}


def calc_hash(file: Path) -> str:
    """Raises InputError if the file cannot be read."""
    try:
        with open_regular(file) as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest()
    except OSError as error:
        raise InputError(f"{file}: expected a file that the campaign uses, got: {error.strerror}") from None


def refuse_changed_files(used: dict[str, str], folder: Path) -> None:
    """Raises InputError unless the files have the hashes `used`. `folder` is that of the campaign file."""
    for name, expected in used.items():
        file = folder / name
        if (got := calc_hash(file)) != expected:
            raise InputError(f"{file}: expected the file with which the campaign was begun (sha256 "
                             f"{expected[:16]}…), got {got[:16]}…: its rows could differ; another folder "
                             "flies all runs with this one")

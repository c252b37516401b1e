"""Reads the tables of the code for the pages."""

import json
import os
import pathlib
import re
import subprocess
import sys

import help_text

ROOT = pathlib.Path(__file__).resolve().parents[2]

sys.path.insert(0, str(ROOT / "python"))
from sls.launcher.commands import COMMANDS  # noqa: E402


class StaleReference(Exception):
    """A table and its description do not match."""


def read(path):
    return (ROOT / path).read_text(encoding="utf-8")


def run(command, **more):
    """The output of the command."""
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=120, **more)
    except OSError as error:
        raise StaleReference(f"{command[0]}: {error.strerror} (is it built? ./sls build)") from error
    if done.returncode != 0:
        raise StaleReference(f"{' '.join(map(str, command))}: exit code {done.returncode}: {done.stderr.strip()}")
    return done.stdout


# --- programs -------------------------------------------------------------------------------------


def list_programs():
    """The programs that the project installs, as CMakeLists.txt names them."""
    match = re.search(r"set\(installed_programs\s+([^)]*)\)", read("CMakeLists.txt"))
    return match[1].split()


def read_help(build, program, *arguments):
    text = run([build / "bin" / program, *arguments, "--help"])
    # The paths of the tree and of the programs differ between machines.
    text = re.sub(r"=\S*/config/qos/", "=config/qos/", text)
    return re.sub(r"(Usage: )\S*/", r"\1", text)


def load_programs(build):
    """Help of each program and of its subcommands: {name: (Help, {subcommand: Help})}."""
    programs = {}
    for name in list_programs():
        main = help_text.parse(read_help(build, name))
        programs[name] = (main, {item.names[0]: help_text.parse(read_help(build, name, item.names[0]))
                                 for item in main.subcommands})
    return programs


def read_version(build):
    return run([build / "bin/sim_server", "--version"]).strip()


def load_exit_codes():
    """[(code, meaning)] of every program."""
    header = read("common/app/run_main.hpp")
    codes = re.findall(r"kExit\w+ = (\d+);\s*///< (.*)", header)
    return codes + [(code, f"Interrupted by {name}.") for code, name in re.findall(r"(\d+) \((SIG\w+)\)", header)]


# --- the launcher ---------------------------------------------------------------------------------


def read_launcher(build):
    """{"": the text of ./sls help, command: that of ./sls COMMAND --help}."""
    environment = dict(os.environ, SLS_BUILD=str(build), COLUMNS="100", LC_ALL="C.UTF-8")

    def ask(*arguments):
        text = run([ROOT / "sls", *arguments], env=environment, cwd=ROOT)
        text = text.replace(str(build) + "/", "build/").replace(str(ROOT) + "/", "")
        text = re.sub(r"=\S*/config/qos/", "=config/qos/", text)
        return re.sub(r"([Uu]sage: )(?!\./sls\b)\S*/", r"\1", text).rstrip()

    return {"": ask("help")} | {name: ask(name, "--help") for name in COMMANDS if name != "help"}


# --- scenario -------------------------------------------------------------------------------------

# Endings of names: style guide, "Frames and units". The longest ending that matches is used.
UNITS = {
    "kg_m2": "kg·m²", "kg": "kg", "m_s2": "m/s²", "m_s": "m/s", "m": "m", "per_rad_s2": "s²/rad", "per_rad_s": "s/rad",
    "per_rad": "1/rad", "per_s": "1/s", "rad_s": "rad/s", "rad": "rad", "s": "s", "hz": "Hz", "n_s_m": "N·s/m",
    "m2": "m²", "kg_m3": "kg/m³", "v": "V", "ohm": "Ω", "ah": "A·h", "w": "W", "n_s2_m": "N·s²/m", "n_s2": "N·s²", "n_m_s": "N·m·s", "n_m": "N·m", "n_per_m": "N/m", "n": "N",
}  # fmt: skip


def find_unit(path):
    name = path.rsplit(".", 1)[-1]
    fitting = [ending for ending in UNITS if name.endswith("_" + ending)]
    return UNITS[max(fitting, key=len)] if fitting else ""


def load_words():
    """{key: what its row of the page says by hand}: `text`, the meaning; others with their marker, `<!--range-->`."""
    words = {}
    for line in read("docs/reference/scenario.md").splitlines():
        if line.startswith("| `"):
            keys, *_, meaning = line[2:-2].split(" | ")
            by_hand = {name: text for text, name in re.findall(r"(<!--(\w+)-->.*?) \|", line)}
            by_hand["text"] = re.sub(r" With `\w+`: [^.]*\.$", "", meaning)
            words |= dict.fromkeys(re.findall("`(.*?)`", keys), by_hand)
    return words


def load_keys(build):
    """Every key with unit and meaning.

    @throws StaleReference for a key without a row of the page or a row without a key.
    """
    words_of = load_words()
    unused = set(words_of)
    rows, by_path = [], {}
    for key in json.loads(run([build / "bin/sls_scenario_keys"])):
        path = key["path"]
        if path.replace("plant.rotors[i].", "plant.rotor.") in words_of.keys() - {path}:
            continue  # the meaning of `plant.rotors` says it for all
        if path not in words_of:
            raise StaleReference(f"docs/reference/scenario.md: no row for the key '{path}'")
        unused.discard(path)
        by_hand = words_of[path]
        key["meaning"] = by_hand["text"]
        key["unit"] = by_hand.get("unit") or find_unit(path)
        key["also"] = by_hand.get("range", "")
        words = by_hand.get("default") or (by_hand.get("none", "") if key["default"] == "none" else "")
        key["default_words"] = words
        # Keys that differ only in a default that depends on another key share one row.
        alike = (path, key["type"], key["range"], key["presence"], key["condition"])
        if words and alike in by_path:
            continue
        by_path[alike] = key
        rows.append(key)
    if unused:
        raise StaleReference(f"docs/reference/scenario.md: no key for the row of '{min(unused)}'")
    return rows

#!/usr/bin/env python3
"""Draws the diagrams of docs/ from their sources: NAME.dot by Graphviz, NAME.puml by PlantUML.

    docs/diagrams/make.py [NAME…]        all of them by default

Each SVG says in its last line from which text it was drawn; tests/docs/architecture_test.py compares. The layers
(layers.dot) are themselves made from the rules in tests/includes_test.py.
"""

import hashlib
import pathlib
import re
import subprocess
import sys

FOLDER = pathlib.Path(__file__).resolve().parent
ROOT = FOLDER.parents[1]
STYLE = FOLDER / "style.puml"  # which every .puml includes
sys.path.append(str(ROOT / "tests"))
from includes_test import RULES  # noqa: E402


def list_sources():
    """Every source of an SVG."""
    files = [path for path in FOLDER.iterdir() if path.suffix in (".dot", ".puml")]
    return sorted(path for path in files if path != STYLE)


def calc_mark(source):
    """The line that its SVG ends with."""
    text = source.read_bytes() + (STYLE.read_bytes() if source.suffix == ".puml" else b"")
    return f"<!-- drawn from {source.name}, SHA-256 {hashlib.sha256(text).hexdigest()} -->"


# Which folders the picture shows, in rows from top to bottom. tools/ and bench/ are not shown.
ROWS = [
    ["worlds", "python"],
    ["closed_loop"],
    ["sim_server", "control_client", "recorder"],
    ["sim_server/plants", "sim_server/autopilots", "control_client/laws", "control_client/core", "recorder/core",
     "common/bus"],
    ["common/bus/fastdds", "common/app", "common/plugin"],
    ["common/config", "common/sync"],
    ["common/model"],
]
LIBRARIES = ["Fast DDS", "Simbody"]


def draw_layers():
    """The text of layers.dot. An arrow leads from a folder to what it may include; what follows from other arrows
    is left out."""
    shown = [folder for row in ROWS for folder in row]
    below = {}
    for folder in shown:
        others = {name for name in shown for other in RULES[folder]
                  if name != folder and (name == other or name.startswith(other + "/"))}
        others |= {name for name in shown if name.startswith(folder + "/")}
        below[folder] = others | (set(RULES[folder]) & set(LIBRARIES))
    edges = []
    for folder in shown:
        implied = set()
        for other in below[folder] & set(shown):
            implied |= below[other] - {folder}
        edges += [(folder, other) for other in sorted(below[folder] - implied)]
    lines = ["// Made by docs/diagrams/make.py from the rules in tests/includes_test.py. Do not edit.",
             "digraph layers {",
             '  graph [rankdir=TB, fontname="Helvetica", bgcolor=white, nodesep=0.3, ranksep=0.5, pad=0.2]',
             '  node [shape=box, style="rounded,filled", fontname="Helvetica", fontsize=12, fillcolor="#eef4fb", '
             'color="#1f84d6"]',
             '  edge [color="#666666", arrowsize=0.7]']
    for row in ROWS:
        lines.append("  {rank=same; " + "; ".join(f'"{name}"' for name in row) + "}")
    lines += [f'  "{name}" [shape=ellipse, style=filled, fillcolor="#fff6e8", color="#e08600"]' for name in LIBRARIES]
    lines += [f'  "{above}" -> "{other}"' for above, other in edges]
    return "\n".join(lines + ["}", ""])


def draw(source):
    """Writes the SVG beside `source`."""
    text = source.read_text()
    if source.suffix == ".dot":
        command = ["dot", "-Tsvg"]
    else:
        command = ["plantuml", "-tsvg", "-pipe"]
    svg = subprocess.run(command, input=text, text=True, cwd=FOLDER, stdout=subprocess.PIPE, check=True).stdout
    svg = re.sub(r"<!--.*?-->\n?", "", svg, flags=re.DOTALL).rstrip("\n")  # versions, and the source once more
    source.with_suffix(".svg").write_text(f"{svg}\n{calc_mark(source)}\n")


def main(names):
    (FOLDER / "layers.dot").write_text(draw_layers())
    for source in list_sources():
        if not names or source.stem in names:
            draw(source)
            print(source.with_suffix(".svg").relative_to(ROOT))


if __name__ == "__main__":
    main(sys.argv[1:])

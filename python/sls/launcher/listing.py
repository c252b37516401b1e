"""`./sls list`: scenarios, campaigns, laws and plants, one line each."""

import re
import shutil
import sys
import textwrap

from sls.launcher.arguments import Parser
from sls.launcher.place import ROOT, list_names

# As control_client/laws/laws.def and sim_server/plants/plants.def name them.
LAWS = {
    "qsf": "quasi-static feedback linearisation; the default",
    "cooperative": "the pose of one load, carried by several vehicles",
    "pid": "a cascade for position, velocity and rod angle",
    "PATH.so": "an own law in C, C++ or generated code: examples/my_controller",
}
PLANTS = {
    "slung_load": "point mass, massless rod, point load, by Simbody; the default",
    "analytic": "the same by its equations, written independently",
    "cables": "up to 16 vehicles on one load, cables that go slack, winches, ground",
    "multirotor": "rotors, a body that tilts, an autopilot",
    "PATH.so": "an own plant: examples/my_plant",
}


def describe(kind: str, name: str) -> str:
    """The first sentence of the comment at the start of a file."""
    text = (ROOT / f"config/{kind}/{name}.yaml").read_text(encoding="utf-8")
    comment = re.match("(?:#.*\n)*", text)
    words = " ".join(line.lstrip("# ") for line in comment[0].splitlines()) if comment else ""
    return re.split(r"(?<=[.])\s", words)[0].rstrip(".:")


def print_list(words: list[str]) -> int:
    Parser("list", "", "Lists the scenarios, control laws, plants and campaigns, with one line each.").parse(words)
    parts = {f"{kind.capitalize()}: {use}": {name: describe(kind, name) for name in list_names(kind)}
             for kind, use in (("scenarios", "./sls run NAME"), ("campaigns", "./sls campaign NAME"))}
    parts |= {"Laws: controller.law in a scenario": LAWS, "Plants: plant.model in a scenario": PLANTS}
    # A pipe takes lines of any length. Since Python 3.14 the size is that of a terminal at stderr, too.
    width = shutil.get_terminal_size().columns if sys.stdout.isatty() else 10**6
    for title, entries in parts.items():
        print(title)
        longest = max(map(len, entries))
        for name, text in entries.items():
            room = max(width - longest - 4, 20)
            print(f"  {name:<{longest}}  {textwrap.shorten(text, room, placeholder=' …')}")
        print()
    return 0

"""What a word of a command line can become: `sls @complete WORD…`, which tools/completion/sls.bash asks.

The options are those of docs/reference/commands.md, so nothing is built, and no program is started."""

import re
from collections.abc import Collection

from sls.launcher.place import IS_INSTALLED, ROOT, list_names

PAGE = (ROOT.parent / "doc/sls" if IS_INSTALLED else ROOT) / "docs/reference/commands.md"
CONTROLS = ("pause", "step", "resume", "start", "reset", "stop", "status")
FLOWN = ("status", "report", "compare")
SUBCOMMANDS = {"ctl": CONTROLS, "campaign": FLOWN}
# Folders of config whose names a command takes, and the commands that take a recording or another folder.
NAMES = {"run": "scenarios", "demo": "scenarios", "delay-margin": "scenarios", "worlds": "scenarios", "check": "checks",
         "campaign": "campaigns"}
FOLDERS = ("campaign-worker", "convert", "keys", "plot", "report", "verify", "view")
# The kinds of files by which bash adds to the words.
KINDS = {"FILE": "file", "DIR": "dir", "SCENARIO": "yaml"}
OPTION = re.compile(r"^(?:  |\| `)(?:-\w(?: \S+)?, ?)?(--[\w-]+)(?: (\S.*?))?(?:`? \| (.*)|  +(.*))?$", re.MULTILINE)
CHOICES = re.compile(r"(?:[\w ]+: )?([a-z][\w-]*(?:(?:, | or )[a-z][\w-]*)+)(?= \(default| alone$|$)")


def read_options(command: str) -> dict[str, tuple[str, str]]:
    """{option: (its argument, or empty; its meaning)}; none if the page or the command is not there."""
    page = PAGE.read_text(encoding="utf-8") if PAGE.is_file() else ""
    common = {"--help": ("", "")}
    if program := re.search(rf"^\| `\./sls {re.escape(command)}` \| \[(\w+)\]", page, re.MULTILINE):
        section = page.partition(f"\n## {program[1]}\n")[2].partition("\n## ")[0]
        common["--version"] = ("", "")
    else:
        section = page.partition(f"\n### ./sls {command}\n")[2].partition("\n### ")[0].partition("\n## ")[0]
    section = re.sub(r"\n {4,}(?=[^\s-])", "  ", section)  # lines that go on
    found = {name: (argument, " ".join((cells or meaning).split()))
             for name, argument, cells, meaning in OPTION.findall(section)}
    return common | found if section or f"\n| `./sls {command}` |" in page else {}


def list_values(argument: str, meaning: str) -> list[str]:
    """The words that an option takes; none if they are not listed."""
    if named := re.search(r"\{(.*)\}", argument):
        return named[1].split(",")
    if cells := re.match(r"(`[^|]+`) \|", meaning):
        return re.findall("`(.*?)`", cells[1])
    listed = CHOICES.match(meaning)
    return re.split(", | or ", listed[1]) if listed else []


def complete(words: list[str], commands: Collection[str]) -> tuple[str, list[str]]:
    """(the kind of files that the last word can name: file, dir, yaml or empty; the other words that it can become)."""
    command, *others = words
    previous, current = words[-2] if others else "", words[-1]
    options = read_options(command)
    argument, meaning = options.get(previous, ("", ""))
    if not others or command == "help":
        return "", sorted(commands)
    if argument:
        values = list_names("scenarios") if argument == "SCENARIO" else list_values(argument, meaning)
        return "" if values and argument != "SCENARIO" else KINDS.get(argument.split()[0], ""), values
    if current.startswith("-"):
        return "", list(options)
    values = list(SUBCOMMANDS.get(command, ())) if len(others) == 1 else []
    if command in NAMES:
        return "yaml", values + list_names(NAMES[command])
    if command in FOLDERS:
        return "dir", values
    return "" if values else "file", values

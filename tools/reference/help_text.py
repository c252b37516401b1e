"""Reads the text that --help of a program prints, as CLI11 formats it."""

import dataclasses
import re


@dataclasses.dataclass
class Item:
    """An option, a positional argument or a subcommand."""

    names: list  # "-h", "--help"; one name if the item is no option
    argument: str = ""  # "FILE"; empty: a flag
    choices: list = dataclasses.field(default_factory=list)
    range: str = ""
    default: str = ""
    notes: list = dataclasses.field(default_factory=list)  # "required", "excludes --force"
    text: str = ""

    def spell(self):
        """The item as a user types it: "-h, --help", "--qos FILE"."""
        return ", ".join(self.names) + (f" {self.argument}" if self.argument else "")


@dataclasses.dataclass
class Help:
    description: str
    usage: str
    positionals: list
    options: list
    subcommands: list

    def list_own(self):
        """Arguments and options but those of every program."""
        return self.positionals + [option for option in self.options if option.names[-1] not in ("--help", "--version")]


def parse_item(spec, text):
    """An item from the two columns of its line."""
    notes, choices, default, limits = [], [], "", ""
    spec = re.sub(r" \(Env:\w+\)$", "", spec)  # ./sls help has it once for all programs
    for word in ("Excludes", "Needs"):
        match = re.search(rf" {word}: ((?:--[\w-]+ ?)+)", spec + " ")
        if match:
            notes.append(f"{word.lower()} " + ", ".join(f"`{name}`" for name in match[1].split()))
            spec = (spec + " ").replace(match[0], " ").strip()
    if spec.endswith(" REQUIRED"):
        notes.append("required")
        spec = spec[: -len(" REQUIRED")]
    names = []
    while match := re.match(r"(--?[\w-]+)(?:,\s*|\s+|$|(?==))", spec):
        names.append(match[1])
        spec = spec[match.end():]
        if not spec.startswith("-"):
            break
    if not names:
        name, _, spec = spec.partition(" ")
        names = [name]
    match = re.match(r"([^=]*)=(.*)$", spec)
    if match and "{" not in match[2]:
        spec, default = match[1], match[2]
    match = re.search(r":?\{([^}]*)\}", spec)
    if match:
        choices = match[1].split(",")
        spec = spec.replace(match[0], "") or "VALUE"
    match = re.search(r":?(?:INT|UINT|FLOAT)? ?in \[(\S+) - (\S+)\]", spec)
    if match:
        limits = f"{match[1]} to {match[2]}"
        spec = spec.replace(match[0], "")
    argument = re.sub(r":(TEXT|INT|UINT|FLOAT)\b", "", spec).strip()
    if not names[0].startswith("-") and argument == "TEXT":
        argument = ""
    return Item(names, argument, choices, limits, default, notes, text)


def parse(text):
    """The parts of one help text."""
    description, _, rest = text.partition("Usage: ")
    usage, _, rest = rest.partition("\n")
    parts = {"Positionals": [], "Options": [], "Subcommands": []}
    for title, lines in re.findall(r"^(\w+):\n((?: .*\n)+)", rest, re.MULTILINE):
        for entry in re.split(r"\n(?=  \S)", lines):
            first, *more = map(str.strip, entry.strip().splitlines())
            spec, _, meaning = re.sub(r"\s{2,}", "\t", first, count=1).partition("\t")
            parts.setdefault(title.capitalize(), []).append(parse_item(spec, " ".join([meaning, *more]).strip()))
    return Help(description.strip(), usage.strip().replace("(0x)", "..."), parts["Positionals"],
                parts["Options"], parts["Subcommands"])

"""Reads the text that --help prints: that of CLI11, of argparse, and of the launcher."""

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

    @property
    def is_option(self):
        return self.names[0].startswith("-")

    def spell(self):
        """The item as a user types it: "-h, --help", "--qos FILE"."""
        return ", ".join(self.names) + (f" {self.argument}" if self.argument else "")


@dataclasses.dataclass
class Help:
    description: str
    usage: list  # without the word "usage:"
    positionals: list
    options: list
    subcommands: list

    def list_own(self):
        """Arguments and options but --help and --version."""
        return self.positionals + [option for option in self.options if not {"--help", "--version"} & set(option.names)]


def _split_lines(text):
    """(spec, meaning) of every indented entry, with the lines that continue it joined."""
    entries, indent = [], 0
    for line in text.splitlines():
        body = line.strip()
        here = len(line) - len(line.lstrip())
        if not body:
            indent = 0
            continue
        if here == 0:
            continue
        is_entry = re.match(r"-{1,2}\w", body) or not indent or here <= indent
        if entries and indent and here > indent and not is_entry:
            entries[-1][1] = (entries[-1][1] + " " + body).strip()
            continue
        spec, _, meaning = re.sub(r"\s{2,}", "\t", body, count=1).partition("\t")
        entries.append([spec, meaning])
        indent = here
    return entries


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
    usage, sections, heads = [], {}, []
    section, is_usage = None, False
    for line in text.splitlines():
        match = re.match(r"[Uu]sage: (.*)", line)
        if match:
            usage.append(match[1].strip().replace("(0x)", "..."))
            is_usage, section = True, None
            continue
        if is_usage and line.startswith(" ") and line.strip():
            if re.match(r" {2,}-", line) and not line.strip().startswith("["):
                is_usage = False
            elif line.strip().startswith("./sls"):
                usage.append(line.strip())
                continue
            else:
                usage[-1] += " " + line.strip()
                continue
        is_usage = False
        match = re.match(r"(Options|options|Positionals|positional arguments|Subcommands):$", line)
        if match:
            section = match[1].lower().split()[0].rstrip("s")
        if match or section is None and not line.startswith(" "):
            if not match:
                heads.append(line)
            continue
        sections.setdefault(section or "option", []).append(line)
    parts = {name: [parse_item(*entry) for entry in _split_lines("\n".join(lines))]
             for name, lines in sections.items()}
    return Help("\n".join(heads).strip(), usage, parts.get("positional", []),
                [item for item in parts.get("option", []) if item.is_option],
                parts.get("subcommand", []))

"""The pages of docs/reference as Markdown."""

import re

import sources

NOTE = ("<!-- Generated from the code's own tables by ./sls reference; changes here are lost. "
        "tests/docs/reference_test.py compares. -->\n")


def make_table(head, rows):
    lines = ["| " + " | ".join(head) + " |", "|" + " --- |" * len(head)]
    lines += ["| " + " | ".join(cell.replace("|", "\\|") for cell in row) + " |" for row in rows]
    return "\n".join(lines) + "\n"


def shorten_number(text):
    return re.sub(r"-?\d+\.\d{7,}", lambda match: f"{float(match[0]):.6g}", text)


def to_range(key):
    text = key["range"]
    if key["type"] == "name or path":
        names = text.removesuffix(" or a shared library (a path ending in .so)").split(", ")
        text = ", ".join(f"`{name}`" for name in names) + ", or a path ending in `.so`"
    elif key["type"] != "text":
        text = re.sub(r"\b(?:radians )?from ", "", text)
        text = re.sub(r"\bpi\b", "π", text).replace("-", "−").replace(">=", "≥").replace("<=", "≤")
    if key["also"].startswith("<!--range-->>"):
        return key["also"]  # stricter than the rule for the value alone
    return ("; " if text and key["also"] else "").join([text, key["also"]])


def to_default(key):
    if key["presence"] == "required":
        return "required"
    if key["presence"].startswith("one of ") and not key["default"]:  # an optional key of one alternative has one
        parts = [" and ".join(f"`{name}`" for name in part.split("+")) for part in key["presence"][7:].split(", ")]
        return "exactly one of " + ", ".join(parts)
    if key["default_words"]:
        return key["default_words"]
    text = shorten_number(re.sub(r"-0(?![.\d])", "0", key["default"].strip('"')))
    return "none" if key["default"] == "none" else f"`{text}`" if text else ""


def to_type(key):
    text = key["type"]
    if text.startswith(("map", "list", "number", "name or path", "whole number", "text", "time", "vector")):
        return text
    return ", ".join(f"`{value}`" for value in text.split(", "))


def to_condition(key):
    name, _, values = key["condition"].partition(": ")
    values = [value if " " in value else f"`{value}`" for value in values.split(", ")]
    return f"With `{name}`: " + (", ".join(values[:-1]) + " or " if values[1:] else "") + values[-1]


def merge_alike(rows):
    """Rows of keys with one name, such as those that all faults have, as one row."""
    merged = {}
    for path, *cells in rows:
        merged.setdefault((path.rpartition(".")[2], *cells), []).append(path)
    return [[", ".join(f"`{path}`" for path in paths), *cells] for (_, *cells), paths in merged.items()]


def make_scenario_page(build):
    text = "# Scenario keys\n\n" + """\
<!-- The meanings, and in other cells what follows a marker (unit, range, default, or none: the behaviour without a value),
are written here. ./sls reference makes the rest of the tables from the code's own. tests/docs/reference_test.py compares.
A new key needs a row with its name and meaning in any table, and a row needs a key. -->

Every key of a scenario file. [common/config](../../common/config/README.md) describes how the file is read, and fleets.

- All units are SI, angles are in radians, the world frame is x forward, y right, z down.
- A *vector* is a list of three numbers. A *time* is at most 1,000,000 s and a whole number of nanoseconds.
- Numbers are finite. `[i]` stands for each element of a list. The keys of a map come in any order.
- A rule that names a number holds for each component of a vector.
- Keys under "With `model`: …" belong to these values of `model` in the same section, and are refused with others.
"""
    sections = {}
    for key in sources.load_keys(build):
        section = sections.setdefault(re.split(r"[.\[]", key["path"])[0], {})
        # Keys of a model have a table of their own; the meaning of other conditional keys ends with their condition.
        condition = to_condition(key) if key["condition"] else ""
        own_table = condition if key["condition"].startswith(("model", "law")) else ""
        meaning = key["meaning"] + (f" {condition}." if condition and not own_table else "")
        section.setdefault(own_table, []).append(
            [key["path"], to_type(key), key["unit"], to_range(key), to_default(key), meaning])
    for name, tables in sections.items():
        text += f"\n## {name}\n"
        for condition, rows in tables.items():
            text += f"\n### {condition}\n" if condition else ""
            text += "\n" + make_table(["key", "type", "unit", "range", "default", "meaning"], merge_alike(rows))
    return text


def make_recordings_page(build):
    columns = sources.run([build / "bin/recorder", "--columns"]).rstrip()
    columns = re.sub(r"^(`\w+\.csv`(?:, `\w+\.csv`)*)$", lambda match: "## " + match[1].replace("`", ""), columns,
                     flags=re.MULTILINE)
    return "# Columns of a recording\n\n" + NOTE + """
Every CSV file of a recording and its columns, as `recorder --columns` prints them.
[recorder](../../recorder/README.md) says what the other files hold.
`pandas.read_csv` changes last bits, unless it is called with `float_precision="round_trip"`.

""" + columns + "\n"


def to_rows(items):
    rows = []
    for item in items:
        notes = ([item.range] if item.range else []) + [f"`{choice}`" for choice in item.choices]
        # A default within the sentence holds on every machine; the value that --help prints may differ between them.
        default = "" if re.search(r"\bdefault:", item.text) else item.default
        default = "required" if "required" in item.notes else f"`{default}`" if default else ""
        extra = "; ".join(note for note in item.notes if note != "required")
        rows.append([f"`{item.spell()}`", ", ".join(notes), default, item.text + (f" ({extra})" if extra else "")])
    return rows


def describe_help(name, parsed, level):
    text = f"\n{'#' * level} {name}\n\n{parsed.description}\n\n    {parsed.usage}\n"
    if items := parsed.list_own():
        text += "\n" + make_table(["argument", "values", "default", "meaning"], to_rows(items))
    return text


def make_commands_page(build):
    text = "# Commands and options\n\n" + NOTE + """
First the commands of `./sls`, then the programs that they start. Each text is what `--help` prints. Every command has
`--help`, every program `--help` and `--version`. All have these exit codes:

""" + make_table(["code", "meaning"], sources.load_exit_codes()) + "\n## ./sls\n"
    launcher = sources.read_launcher(build)
    programs = sources.load_programs(build)
    helps = {sources.read_help(build, name).rstrip(): name for name in programs}
    text += "\n" + to_block(launcher.pop("")) + "\nThese commands start a program with the same options:\n\n"
    text += make_table(["command", "program"], [[f"`./sls {command}`", f"[{helps[block]}](#{helps[block]})"]
                                                for command, block in launcher.items() if block in helps])
    plain = {command: found[1].replace("\n", " ") for command, block in launcher.items()
             if (found := re.fullmatch(rf"usage: \./sls {command}\n\n((?:.+\n?)+)", block))}
    text += "\nThese have no options:\n\n" + make_table(["command", "meaning"], [
        [f"`./sls {command}`", meaning] for command, meaning in plain.items()])
    for command, block in launcher.items():
        if block not in helps and command not in plain:
            text += f"\n### ./sls {command}\n\n" + to_block(block)
    for name, (parsed, subcommands) in programs.items():
        text += describe_help(name, parsed, 2)
        if subcommands:
            text += "\n" + make_table(["subcommand", "meaning"], [
                [f"`{its_help.usage.replace(' [OPTIONS]', '')}`", "; ".join([its_help.description] + [
                    f"{item.names[0]}: {item.text}" for item in its_help.positionals])]
                for its_help in subcommands.values()])
        for subcommand, its_help in subcommands.items():
            if any(item.names[0].startswith("-") for item in its_help.list_own()):
                text += describe_help(f"{name} {subcommand}", its_help, 3)
    return text


def to_block(text):
    """The text without its line of --help."""
    return "```text\n" + re.sub(r"^  -h, ?--help .*\n", "", text, flags=re.MULTILINE).rstrip() + "\n```\n"


def find_block(page, command):
    """The text of a command in docs/reference/commands.md; for "" the text of ./sls help."""
    heading = re.escape(f"### ./sls {command}" if command else "## ./sls")
    match = re.search(rf"^{heading}\n\n```text\n(.*?)\n```$", page, re.MULTILINE | re.DOTALL)
    return match[1] if match else ""


def find_row(page, command):
    """What the tables say of a command without a block: a link to the program that it starts, or its meaning."""
    match = re.search(rf"^\| `\./sls {re.escape(command)}` \| (.*) \|$", page, re.MULTILINE)
    return match[1] if match else ""


PAGES = {
    "scenario.md": make_scenario_page,
    "recordings.md": make_recordings_page,
    "commands.md": make_commands_page,
}

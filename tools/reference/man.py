"""The man pages: sls(1) and one for each program."""

import datetime
import os
import re

import pages
import sources


def escape(text):
    """Escapes `text` so that roff prints it unchanged."""
    text = text.replace("\\", "\\e").replace("-", "\\-")
    return "\n".join("\\&" + line if line.startswith((".", "'")) else line for line in text.splitlines())


def make_date():
    seconds = os.environ.get("SOURCE_DATE_EPOCH")
    zone = datetime.timezone.utc
    when = datetime.datetime.fromtimestamp(int(seconds), zone) if seconds else datetime.datetime.now(zone)
    return when.strftime("%Y-%m-%d")


def make_start(name, version, summary, synopsis):
    text = f'.TH {name.upper()} 1 {make_date()} "{version}" "User Commands"\n.SH NAME\n'
    summary = summary.rstrip(".")
    # The line has no other plain "-" and no line break, so that apropos finds all of it.
    text += f"{escape(name)} \\- {escape(summary[0].lower() + summary[1:])}\n.SH SYNOPSIS\n"
    command, _, rest = synopsis.partition(" ")
    return text + f".B {escape(command)}\n" + (escape(rest) + "\n" if rest else "")


def make_items(items):
    text = ""
    for item in items:
        names = ", ".join(f"\\fB{escape(name)}\\fR" for name in item.names)
        argument = f" \\fI{escape(item.argument)}\\fR" if item.argument else ""
        values = ([f"One of {', '.join(item.choices)}."] if item.choices else []) + \
                 ([f"Range: {item.range}."] if item.range else [])
        default = "" if re.search(r"\bdefault:", item.text) or not item.default else f"Default: {item.default}."
        notes = [note.replace("`", "")[0].upper() + note.replace("`", "")[1:] + "." for note in item.notes]
        meaning = item.text[0].upper() + item.text[1:] + "." if item.text else ""
        text += f".TP\n{names}{argument}\n" + escape(" ".join(filter(None, [meaning, *values, default, *notes]))) + "\n"
    return text


def make_end(name, names):
    text = ".SH EXIT STATUS\n"
    for code, meaning in sources.load_exit_codes():
        text += f".TP\n.B {code}\n{escape(meaning)}\n"
    others = [f".BR {escape(other)} (1)" for other in names if other != name]
    return text + ".SH SEE ALSO\n" + " ,\n".join(others) + "\n"


def make_program(name, parsed, subcommands, version, names):
    summary = re.split(r"(?<=\.)\s", parsed.description.replace("\n", " "))[0]
    text = make_start(name, version, summary, parsed.usage)
    text += ".SH DESCRIPTION\n" + escape(parsed.description) + "\n"
    for title, items in (("ARGUMENTS", parsed.positionals), ("COMMANDS", parsed.subcommands),
                         ("OPTIONS", parsed.options)):
        if items:
            text += f".SH {title}\n" + make_items(items)
    for subcommand, its_help in subcommands.items():
        if own := its_help.list_own():
            text += f'.SH "OPTIONS OF {subcommand.upper()}"\n' + make_items(own)
    return text + make_end(name, names)


def make_launcher(page, version, names):
    """Made from docs/reference/commands.md, so that no command has to run."""
    overview = pages.find_block(page, "")
    usage = next((line.partition(":")[2].strip() for line in overview.splitlines()
                  if line.lower().startswith("usage:")), "./sls COMMAND [OPTIONS]")
    text = make_start("sls", version, "sets up, builds, flies and tests the slung-load simulator",
                      usage.removeprefix("./"))
    text += ".SH DESCRIPTION\n.nf\n" + escape(re.sub(r"\n\n+", "\n.sp\n", overview)).replace("\\&.sp", ".sp")
    text += "\n.fi\n.SH COMMANDS\n"
    for command in sources.COMMANDS:
        block = pages.find_block(page, command)
        if block:
            text += f".SS {escape(command)}\n.nf\n"
            text += escape(re.sub(r"\n\n+", "\n.sp\n", block)).replace("\\&.sp", ".sp") + "\n.fi\n"
        elif row := pages.find_row(page, command):
            program = re.match(r"\[(\w+)\]", row)
            meaning = f"Starts\n.BR {escape(program[1])} (1)\nwith the same options." if program else escape(row)
            text += f".SS {escape(command)}\n{meaning}\n"
    return text + make_end("sls", names)


def make(build):
    """{file name: text} of every page."""
    programs = sources.load_programs(build)
    version = sources.read_version(build)
    names = ["sls", *sorted(programs)]
    made = {"sls.1": make_launcher(sources.read("docs/reference/commands.md"), version, names)}
    for name, (parsed, subcommands) in programs.items():
        made[f"{name}.1"] = make_program(name, parsed, subcommands, version, names)
    return made

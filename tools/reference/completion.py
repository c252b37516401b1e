"""The bash completion of ./sls and sls, from docs/reference/commands.md and the programs."""

import re

import help_text
import pages
import sources

HEAD = """\
# Completion of ./sls and sls in bash. To use it: source tools/completion/sls.bash
# Generated from the help of ./sls and of the programs by ./sls reference; changes here are lost.
# tests/docs/completion_test.py completes with it. shellcheck shell=bash
"""

FUNCTIONS = r"""
# _sls_names KIND: names of the scenarios, campaigns or checks that the launcher finds.
_sls_names() {
  local launcher folder file
  launcher="$(type -P -- "${COMP_WORDS[0]/#\~/$HOME}")" || launcher=$PWD/sls
  folder="$(dirname -- "$(readlink -f -- "$launcher")")"
  for folder in "$folder/config" "$folder/../share/sls/config" /usr/share/sls/config; do
    for file in "$folder/$1"/*.yaml; do
      [[ -f $file ]] || continue
      file=${file##*/}
      echo "${file%.yaml}"
    done
  done
}

# _sls_values KIND WORD: what WORD can become. KIND is file, dir, scenario, campaign, check or the values themselves.
_sls_values() {
  case $1 in
    file) compgen -f -- "$2" ;;
    dir) compgen -d -- "$2" ;;
    scenario) compgen -W "$(_sls_names scenarios)" -- "$2"; compgen -f -X '!*.yaml' -- "$2"; compgen -d -- "$2" ;;
    campaign | check) compgen -W "$(_sls_names "$1"s)" -- "$2"; compgen -f -X '!*.yaml' -- "$2"; compgen -d -- "$2" ;;
    any) ;;
    *) compgen -W "$1" -- "$2" ;;
  esac
}

_sls() {
  local current=${COMP_WORDS[COMP_CWORD]} previous=${COMP_WORDS[COMP_CWORD - 1]} command=${COMP_WORDS[1]} kind=''
  COMPREPLY=()
  if ((COMP_CWORD == 1)); then
    kind=$_sls_commands
  elif [[ -n ${_sls_arguments["$command $previous"]-} ]]; then
    kind=${_sls_arguments["$command $previous"]}
  elif [[ $current == -* ]]; then
    kind=${_sls_options["$command"]-}
  elif [[ -n ${_sls_subcommands["$command"]-} ]] && ((COMP_CWORD == 2)); then
    mapfile -t COMPREPLY < <(compgen -W "${_sls_subcommands["$command"]}" -- "$current")
    kind=${_sls_positionals["$command"]-any}
  else
    kind=${_sls_positionals["$command"]-file}
  fi
  local values
  mapfile -t values < <(_sls_values "$kind" "$current" | sort -u)
  COMPREPLY+=("${values[@]}")
  case $kind in
    file | dir | scenario | campaign | check) compopt -o filenames 2>/dev/null ;;
  esac
  return 0
}

# Bash uses it for every path that ends in sls, ./sls too.
complete -F _sls sls
"""

KINDS = {"FILE": "file", "DIR": "dir", "A": "dir", "B": "dir", "SCENARIO": "scenario", "RECORDING": "dir"}


def find_kind(item, known):
    """Kind of an option's argument, see _sls_values; empty if the option takes none."""
    if not item.argument:
        return ""
    if item.choices:
        return " ".join(item.choices)
    if listed := re.match(r"(?:[\w ]+: )?([a-z][\w-]*(?:(?:, | or )[a-z][\w-]*)+)(?= \(default| alone$|$)", item.text):
        return " ".join(re.split(r", | or ", listed[1]))
    if item.argument == "FILE" and (kind := re.search("config/(campaign|check)s", item.text)):
        return kind[1]
    first = item.argument.split()[0].strip("[]…")
    # If the launcher passes the option on to a program, the help of that program lists the values.
    return KINDS.get(first) or known.get(item.names[-1]) or "any"


def find_positional(command, text):
    """Kind of the command's positional argument; empty if it has none."""
    usage = help_text.parse(text).usage or [re.sub(r"\s{2,}.*", "", text.partition("\n")[0])]
    words = re.findall(r"\b[A-Z]+\b", re.sub(r"\[--?\w[^\]]*\]+|\[OPTIONS\]", " ", " ".join(usage)))
    if "FILE" in words and (kind := re.search("config/(campaign|check)s", text)):
        return kind[1]
    return next((KINDS[word] for word in words if word in KINDS), "")


def make(page, programs):
    """Text of the completion file, from the text of docs/reference/commands.md and sources.load_programs()."""
    known = {item.names[-1]: " ".join(item.choices)
             for main, _ in programs.values() for item in main.options if item.choices}
    overview = pages.find_block(page, "")
    options, arguments, positionals, subcommands = {}, {}, {}, {}
    for command in sources.list_commands():
        block = pages.find_block(page, command)
        link = re.search(rf"^### \./sls {command}\n\nIt starts `(\w+)`", page, re.MULTILINE)
        if link:
            main, below = programs[link[1]]
            subcommands[command] = " ".join(below)
            items = main.options + [option for its_help in below.values() for option in its_help.options]
            positionals[command] = "dir" if main.positionals else ""
        else:
            items = help_text.parse(block).options
            positionals[command] = find_positional(command, block)
            lines = [line for line in (overview + "\n" + block).splitlines()
                     if re.search(rf"^\s*(?:usage: )?(?:\./)?(?:sls )?{command} [a-z]+ [A-Z]", line)]
            below = re.findall(rf"(?:\b{command}|\|) ([a-z]+) (?=[A-Z])", "\n".join(lines))
            subcommands[command] = " ".join(dict.fromkeys(below))
        names = ["--help", *(name for item in items for name in item.names if name.startswith("--"))]
        options[command] = " ".join(dict.fromkeys(names))
        for item in items:
            for name in item.names:
                if kind := find_kind(item, known):
                    arguments[f"{command} {name}"] = kind
    positionals["help"] = " ".join(sorted(options))
    return HEAD + "\n".join([
        "",
        f'_sls_commands="{" ".join(sorted(options))}"',
        *to_array("_sls_options", options),
        *to_array("_sls_subcommands", subcommands),
        *to_array("_sls_positionals", positionals),
        *to_array("_sls_arguments", arguments),
    ]) + "\n" + FUNCTIONS


def to_array(name, values):
    return [f"declare -gA {name}=(", *(f'  ["{key}"]="{value}"' for key, value in sorted(values.items()) if value), ")"]

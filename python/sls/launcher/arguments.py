"""Options of the launcher's own commands: argparse with the project's error lines."""

import argparse
import re
from collections.abc import Callable, Iterable
from typing import Any, NoReturn

from sls.launcher.place import SELF, Failure, find_file, list_choices, suggest


def make_unknown_option(command: str, word: str, known: Iterable[str]) -> Failure:
    name = word.partition("=")[0]
    return Failure(f"unknown option '{name}'{suggest(name, known)} (see ./sls {command} --help)", 2)


def checked(expected: str, convert: Callable[[str], Any], fits: Callable[[Any], bool]) -> Callable[[str], str]:
    """The type of an option whose word goes on to a program unchanged, if its value fits."""
    def check(word: str) -> str:
        try:
            if fits(convert(word)):
                return word
        except ValueError:
            pass
        raise argparse.ArgumentTypeError(f"expected {expected}, got '{word}'")
    return check


def whole(first: int, last: int) -> Callable[[str], str]:
    return checked(f"{first} to {last}", int, lambda number: first <= number <= last)


def one_of(*names: str) -> Callable[[str], str]:
    return checked(list_choices(names), str, lambda word: word in names)


def filled(kind: str) -> Callable[[str], str]:
    return checked(f"a {kind}", str, bool)


POSITIVE = checked("a number > 0", float, lambda number: 0 < number < float("inf"))


class Parser(argparse.ArgumentParser):
    """`usage` follows the command's name."""

    def __init__(self, command: str, usage: str, text: str) -> None:
        super().__init__(prog=f"{SELF} {command}", usage=f"{SELF} {command} {usage}".rstrip(), description=text,
                         allow_abbrev=False, add_help=False, formatter_class=argparse.RawDescriptionHelpFormatter)
        self.add_argument("-h", "--help", action="help", help=argparse.SUPPRESS)
        self.command = command

    def error(self, message: str) -> NoReturn:
        message = message.removeprefix("argument ").replace("expected one argument", "expected a value")
        message = re.sub("ignored explicit argument (.*)", r"expected no value, got \1", message)
        raise Failure(f"{message} (see ./sls {self.command} --help)", 2)

    def parse(self, words: list[str], what: str = "", default: str = "") -> tuple[argparse.Namespace, str]:
        """Options, and the word that belongs to none: `what` names it; without a default it must be there."""
        options, others = self.parse_known_args(words)
        for word in others:
            if word.startswith("-"):
                raise make_unknown_option(self.command, word, self._option_string_actions)
        if others and not what:
            self.error(f"{self.command}: expected no argument, got '{others[0]}'")
        if len(others) > 1:
            raise Failure(f"expected one {what}, got '{others[0]}' and '{others[1]}'", 2)
        if what and not others and not default:
            self.error(f"expected a {what}")
        return options, others[0] if others else default

    def parse_scenario(self, words: list[str], default: str = "") -> tuple[argparse.Namespace, str]:
        options, name = self.parse(words, "scenario", default)
        return options, find_file("scenarios", name)

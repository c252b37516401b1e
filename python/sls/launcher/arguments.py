"""Options of the launcher's own commands: argparse with the project's error lines."""

import argparse
import re
from collections.abc import Callable, Iterable
from typing import NoReturn

from sls.launcher.place import SELF, Failure, find_file, suggest


def make_unknown_option(command: str, word: str, known: Iterable[str]) -> Failure:
    name = word.partition("=")[0]
    return Failure(f"unknown option '{name}'{suggest(name, known)} (see ./sls {command} --help)", 2)


def checked(pattern: str, expected: str,
            fits: Callable[[float], bool] = lambda _: True) -> Callable[[str], str]:
    """The type of an option: its word, if all of it matches and its number fits."""
    def check(word: str) -> str:
        if not re.fullmatch(pattern, word) or not fits(float(word) if "[0-9]" in pattern else 0.0):
            raise argparse.ArgumentTypeError(f"expected {expected}, got '{word}'")
        return word
    return check


def whole(first: int, last: int) -> Callable[[str], str]:
    return checked("[0-9]{1,9}", f"{first} to {last}", lambda number: first <= number <= last)


def above_zero(most: float = float("inf")) -> Callable[[str], str]:
    expected = "a number > 0" + (f" and <= {most:g}" if most < float("inf") else "")
    return checked(r"[+]?([0-9]+[.]?[0-9]*|[.][0-9]+)(e[+-]?[0-9]{1,3})?", expected, lambda number: 0 < number <= most)


def one_of(*names: str) -> Callable[[str], str]:
    return checked("|".join(names), f"{', '.join(names[:-1])} or {names[-1]}")


def path(kind: str) -> Callable[[str], str]:
    return checked(".+", f"a {kind}")


class Parser(argparse.ArgumentParser):
    """`usage` follows the command's name."""

    def __init__(self, command: str, usage: str, text: str) -> None:
        super().__init__(prog=f"{SELF} {command}", usage=f"{SELF} {command} {usage}".rstrip(),
                         description=text, allow_abbrev=False,
                         formatter_class=argparse.RawDescriptionHelpFormatter)
        self.command = command

    def error(self, message: str) -> NoReturn:
        message = message.removeprefix("argument ")
        message = message.replace("expected one argument", "expected a value")
        message = re.sub("ignored explicit argument (.*)", r"expected no value, got \1", message)
        raise Failure(f"{message} (see ./sls {self.command} --help)", 2)

    def parse(self, words: list[str], most: int = 0) -> tuple[argparse.Namespace, list[str]]:
        """Options, and the at most `most` words that belong to none."""
        options, others = self.parse_known_args(words)
        for word in others:
            if word.startswith("-"):
                raise make_unknown_option(self.command, word, self._option_string_actions)
        if len(others) > most:
            raise Failure(f"{self.command}: expected {most or 'no'} argument{'s' * (most > 1)}, got "
                          f"'{others[most]}' (see ./sls {self.command} --help)", 2)
        return options, others

    def parse_scenario(self, words: list[str],
                       default: str | None = None) -> tuple[argparse.Namespace, str]:
        options, others = self.parse(words, 2)
        if len(others) > 1:
            raise Failure(f"expected one scenario, got '{others[0]}' and '{others[1]}'", 2)
        if not others and default is None:
            raise Failure(f"expected a scenario (see ./sls {self.command} --help)", 2)
        return options, find_file("scenarios", others[0] if others else str(default))

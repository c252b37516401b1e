"""Options of the launcher's own commands: argparse with the project's error lines."""

import argparse
from typing import NoReturn

from sls.launcher.place import SELF, Failure


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
        raise Failure(f"{message} (see ./sls {self.command} --help)", 2)

    def parse(self, words: list[str], most: int = 0) -> tuple[argparse.Namespace, list[str]]:
        """Options, and the at most `most` words that belong to none."""
        options, others = self.parse_known_args(words)
        for word in others:
            if word.startswith("-"):
                raise Failure(f"unknown option '{word}' (see ./sls {self.command} --help)", 2)
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
        return options, others[0] if others else str(default)

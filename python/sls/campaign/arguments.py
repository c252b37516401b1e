"""What the command lines of the package share: a parser, types of arguments, signals that end a command."""

import argparse
import re
import signal
from typing import NoReturn

from sls.input_error import InputError


class Ended(KeyboardInterrupt):
    """SIGTERM or SIGHUP."""


def raise_ended(*_: object) -> None:
    raise Ended


def catch_end_signals() -> None:
    """Makes SIGTERM and SIGHUP raise Ended. A signal that is ignored, as SIGHUP is under nohup, stays ignored."""
    for number in (signal.SIGTERM, signal.SIGHUP):
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, raise_ended)


class Parser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        raise InputError(f"{self.prog.removeprefix('./sls ')}: {message} (see {self.prog} --help)")


def to_count(text: str) -> int:
    """Raises ArgumentTypeError."""
    if not text.isdecimal() or not 1 <= int(text) <= 10**9:
        raise argparse.ArgumentTypeError(f"expected a whole number of at least 1, got '{text}'")
    return int(text)


def parse_range(text: str) -> tuple[int, int]:
    """Parses `A-B` or `A`. Raises ArgumentTypeError."""
    match = re.fullmatch(r"(\d{1,12})(?:-(\d{1,12}))?", text)
    if not match or int(match[2] or match[1]) < int(match[1]):
        raise argparse.ArgumentTypeError(f"expected A-B with A ≤ B, got '{text}'")
    return int(match[1]), int(match[2] or match[1])

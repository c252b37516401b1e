"""Command lines of campaigns: a parser and types of arguments."""

import argparse
import re
from typing import NoReturn

from sls.input_error import InputError


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

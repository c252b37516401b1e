"""Errors in the user's input."""

from sls.errors import ConfigError
from sls.launcher.place import escape_controls


class InputError(ConfigError):
    """An error with one line: place, expected value and found value. Controls are escaped."""

    def __init__(self, text: object) -> None:
        super().__init__(escape_controls(text))

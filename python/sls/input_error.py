"""Errors in the user's input."""

import re

from sls.errors import ConfigError


class InputError(ConfigError):
    """An error with one line: place, expected value and found value. Control characters are escaped."""

    def __init__(self, text: str):
        super().__init__(re.sub("[\x00-\x1f\x7f-\x9f\ud800-\udfff]", lambda found: f"\\x{ord(found[0]):02x}", text))

"""Errors in the user's input."""

from sls.errors import ConfigError


class InputError(ConfigError):
    """An error with one line: place, expected value and found value."""

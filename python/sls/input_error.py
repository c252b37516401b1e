"""Errors in the user's input."""

from sls.errors import ConfigError


class InputError(ConfigError):
    """One line that names the place, what was expected there and what was found."""

"""What is wrong with what the user gave us."""

from sls.errors import ConfigError


class InputError(ConfigError):
    """One line that names the place, what was expected there and what was found."""

"""The exceptions of this package. Their texts are one line: place, key, expected, got.

The extension module raises the same classes. A disk that fails raises OSError."""


class ConfigError(ValueError):
    """A mistake in a file or in an argument. Exit code 2 of the programs."""


class RunError(RuntimeError):
    """A run that could not finish, because of a broken control law or a damaged recording. Exit code 1
    of the programs. If Python code was the reason, its exception is `__cause__`."""


class LawFault(Exception):
    """Raised by a Python control law that cannot compute a force, for example for a level rod. The
    flight fails with this error code, as with a law in C++."""

    CODES = ("free_fall", "rod_level", "not_finite")

    def __init__(self, code: str):
        """`code`: one of CODES. Raises ConfigError for any other text."""
        if code not in self.CODES:
            raise ConfigError(f"LawFault: expected one of {', '.join(self.CODES)}, got {code!r}")
        super().__init__(code)
        self.code = code

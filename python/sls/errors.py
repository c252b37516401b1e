"""The exceptions of this package. Their texts are one line: place, key, expected, got.

The extension module raises the same classes. A disk that refuses is an OSError."""


class ConfigError(ValueError):
    """A mistake in a file or in what was asked for: exit code 2 of the programs."""


class RunError(RuntimeError):
    """A run that could not finish: a broken control law, a damaged recording. Exit code 1
    of the programs. Where Python code was the reason, its exception is `__cause__`."""


class LawFault(Exception):
    """Raised by a Python control law that has no force to answer, such as for a level rod. The
    flight ends as failed with this error code, as for a law in C++."""

    CODES = ("free_fall", "rod_level", "not_finite")

    def __init__(self, code: str):
        """`code` is one of CODES. Raises ConfigError for another one."""
        if code not in self.CODES:
            raise ConfigError(f"LawFault: expected one of {', '.join(self.CODES)}, got {code!r}")
        super().__init__(code)
        self.code = code

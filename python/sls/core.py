"""Imports the extension module. The error has one line that tells how to build it."""

from types import ModuleType


def load_core() -> ModuleType:
    """The module _sls_core. Raises ImportError if it is not built."""
    try:
        import _sls_core
    except ModuleNotFoundError as error:
        if error.name != "_sls_core":
            raise
        raise ImportError("expected the module _sls_core: run ./sls python or ./sls build",
                          name="_sls_core") from None
    return _sls_core

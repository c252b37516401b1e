"""A Python control law for a running server over DDS, beside or instead of `control_client`.

    sls.Client(my_law, "figure_eight.yaml").run()        # with sim_server and recorder elsewhere
"""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Iterable
from types import FrameType
from typing import TYPE_CHECKING, Any

from sls.closed_loop import to_scenario, to_whole
from sls.core import load_core
from sls.errors import ConfigError

if TYPE_CHECKING:
    from _sls_core import Scenario
    from sls.flight import Law, LawWithMemory

LOG_LEVELS = ("debug", "info", "warning", "error")
PATIENCE_S = 20.0  # after a stop signal, equal to that of the programs


def read_domain() -> int:
    """The DDS domain in SLS_DOMAIN; 0 if it is not set."""
    text = os.environ.get("SLS_DOMAIN") or "0"
    if not (text.isascii() and text.isdecimal() and int(text) <= 232):
        raise ConfigError(f"SLS_DOMAIN: expected a DDS domain, 0 to 232, got {text!r}")
    return int(text)


class Client:
    """Answers every state sample of a run with the force of a Python law, by the rules of
    `control_client`. It announces itself to the server. It is stateless: the law's memory travels in
    the samples. Of several clients of a vehicle the strongest one flies, the others stand by."""

    def __init__(self, law: Law | LawWithMemory, scenario: Scenario | str | os.PathLike[str], *,
                 name: str = "python", strength: int = 0,
                 vehicles: Iterable[int] | str | None = None, follow: bool = False,
                 qos: str | os.PathLike[str] | None = None, domain: int | None = None,
                 log_level: str = "info"):
        """Does not join the domain yet: `run` does.

        law: as in `sls.fly`: called with sls.Now, returns the force (3 floats, N, in W) or, if it
            has a `memory_size`, (force, memory). One law for all vehicles. It is called on a thread
            of the middleware, which then holds the GIL.
        scenario: a scenario from `sls.load_scenario`, or an argument of that function; equal to the
            server's scenario.
        name: in recordings and messages, 1 to 32 letters, digits, '_', '-' or '.'.
        strength: of several clients the one with the largest strength flies.
        vehicles: ids, or text such as "0-9,20"; None: all vehicles of the server.
        follow: fly on with a server that replaces this one; without it `run` raises RunError.
        qos: QoS file; None: config/qos/default.xml. A process can use only one.
        domain: DDS domain, 0 to 232; None: that of the environment variable SLS_DOMAIN, or 0.
        log_level: level of the lines on stderr: debug, info, warning or error.
        Raises ConfigError if one of these is not valid.
        """
        if vehicles is None:
            vehicles = "all"
        elif not isinstance(vehicles, str):
            vehicles = ",".join(str(to_whole("vehicles", vehicle, 0, 255))
                                for vehicle in sorted(set(vehicles)))
        if log_level not in LOG_LEVELS:
            raise ConfigError(f"log_level: expected one of {', '.join(LOG_LEVELS)}, got "
                              f"{log_level!r}")
        self._client = load_core().Client(
            law, to_scenario(scenario), name, to_whole("strength", strength, -2**31, 2**31 - 1),
            vehicles, bool(follow), "" if qos is None else os.fspath(qos),
            to_whole("domain", read_domain() if domain is None else domain, 0, 232), log_level,
            PATIENCE_S)

    def run(self) -> None:
        """Joins the run and flies to its end; after a reset it also flies the next run.

        Ctrl-C and SIGTERM end it in order: the client informs the server and raises
        KeyboardInterrupt or SystemExit(143). (SIGTERM: if the program has no handler for it.) Call
        it from the main thread; in another thread only `stop` ends it early.
        Raises ConfigError if the server flies another scenario or the QoS file is not valid;
        RunError if there is no server, the server disappears, the run fails or the law is broken.
        """
        with _terminable():
            self._client.run()

    def stop(self) -> None:
        """Ends in order a `run` in another thread. That `run` then returns."""
        self._client.stop()


class _terminable:
    """Context in which SIGTERM raises SystemExit(143) unless the program has a handler for it."""

    def __enter__(self) -> None:
        self._is_ours = (threading.current_thread() is threading.main_thread()
                         and signal.getsignal(signal.SIGTERM) is signal.SIG_DFL)
        if self._is_ours:
            signal.signal(signal.SIGTERM, _exit)

    def __exit__(self, *_: object) -> None:
        if self._is_ours:
            signal.signal(signal.SIGTERM, signal.SIG_DFL)


def _exit(number: int, _frame: FrameType | None) -> Any:
    raise SystemExit(128 + number)

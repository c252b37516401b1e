"""Flights from Python: fly a scenario, read its columns, write a control law, verify a recording.

    import sls
    flight = sls.fly(sls.load_scenario("figure_eight", vehicle__load_mass_kg=0.3))
    flight.load_position, flight.state["alpha_rad"], flight.metrics, flight.certificate

Each name is documented at its definition. Figures, reports and recordings work without the
extension module; flights need it (`./sls python` builds it). See python/README.md."""

import importlib as _importlib
import typing as _typing

if _typing.TYPE_CHECKING:
    from _sls_core import Now, Reference, Scenario, Vehicle

    from sls import cables, metrics
    from sls.client import Client
    from sls.closed_loop import ClosedLoop, LoopReference, LoopState
    from sls.columns import Columns
    from sls.errors import ConfigError, LawFault, RunError
    from sls.flight import Flight, FlownVehicle, Law, LawWithMemory, fly
    from sls.gains import lqr
    from sls.recordings import Recording
    from sls.scenario import load_scenario
    from sls.trajectory import Trajectory

__version__ = "0.1.0"  # that of CMakeLists.txt

# The module of each name. It is imported on first use: a program that only reads recordings needs
# neither the extension module nor the packages for figures.
_PLACES = {
    "Client": "sls.client",
    "ClosedLoop": "sls.closed_loop",
    "Columns": "sls.columns",
    "ConfigError": "sls.errors",
    "Flight": "sls.flight",
    "FlownVehicle": "sls.flight",
    "Law": "sls.flight",
    "LawFault": "sls.errors",
    "LawWithMemory": "sls.flight",
    "LoopReference": "sls.closed_loop",
    "LoopState": "sls.closed_loop",
    "Now": "_sls_core",
    "Recording": "sls.recordings",
    "Reference": "_sls_core",
    "RunError": "sls.errors",
    "Scenario": "_sls_core",
    "Trajectory": "sls.trajectory",
    "Vehicle": "_sls_core",
    "cables": "sls.cables",
    "fly": "sls.flight",
    "load_scenario": "sls.scenario",
    "lqr": "sls.gains",
    "metrics": "sls.metrics",
}

__all__ = sorted(_PLACES)


def __getattr__(name: str) -> object:
    if name not in _PLACES:
        raise AttributeError(f"module 'sls' has no attribute '{name}'")
    place = _PLACES[name]
    if place == "_sls_core":
        from sls.core import load_core
        value = getattr(load_core(), name)
    else:
        module = _importlib.import_module(place)
        value = module if place == f"sls.{name}" else getattr(module, name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*_PLACES, *(name for name in globals() if name.startswith("__"))})

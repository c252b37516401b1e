"""Reads check files. config/checks/README.md describes the keys."""

import difflib
import math
import os
import re
import shutil
import signal
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sls.campaign.expressions import Expression, ExpressionError
from sls.campaign.yaml_nodes import Place, parse_yaml, read_bytes
from sls.check.faults import PLACEMENTS, Fault, list_faults
from sls.errors import ConfigError
from sls.launcher.place import list_names, suggest
from sls.measures import AXES, MEASURES
from sls.scenario import ROOT, find_scenario, load_scenario, read_keys

if TYPE_CHECKING:
    from _sls_core import Scenario

MOST_BYTES = 1_000_000
KEYS = {"outcome": ("reason",), "measure": ("min", "max", "vehicle"),  # and those of the measure
        "value": ("min", "max", "stage", "window_s", "vehicle", "over"), "event": ("min", "max"), "certificate": ()}
KINDS = tuple(KEYS)
OUTCOMES = ("finished", "failed")
EVENTS = ("take_over", "fail_safe", "late_step", "refused_answer")
OF_ANSWERS = ("late_steps", "answer_age_max_ms")  # measures that are events rather than motion
OVER = ("max", "min", "mean", "rms", "end")
CONTROLLERS = {"command": ("env", "ready", "ready_s", "silent_s", "stop"), "python": ("ready_s", "silent_s"),
               "library": ("silent_s",)}
STOPS = ("SIGINT", "SIGTERM", "SIGHUP", "SIGKILL")
UNKNOWN = "unknown"  # of a certificate: --update writes it
DEFAULT_LIMIT_S, DEFAULT_SILENT_S, DEFAULT_READY_S = 300.0, 20.0, 60.0


@dataclass(frozen=True)
class Expectation:
    place: Place
    kind: str
    what: str
    low: float | None = None
    high: float | None = None
    stage: int | None = None
    window_s: tuple[float, float] | None = None
    vehicle: int | None = None
    over: str = "max"
    options: Mapping[str, Any] = field(default_factory=dict)  # other options of the measure
    reason: str = ""
    because: str = ""
    expression: Expression | None = None

    @property
    def unit(self) -> str:
        return MEASURES[self.what].unit if self.kind == "measure" else ""

    @property
    def text(self) -> str:
        """What is expected, without the bounds."""
        parts = [f"{self.over} of {self.what}" if self.kind == "value" else self.what]
        if self.kind == "certificate":
            parts = [f"certificate {self.what[:12]}…"]
        elif self.kind == "outcome":
            parts = [f"outcome {self.what}" + (f", reason with '{self.reason}'" if self.reason else "")]
        parts += [f"{key} {value}" for key, value in self.options.items()]
        if self.stage is not None:
            parts.append(f"stage {self.stage}")
        if self.window_s:
            parts.append(f"{self.window_s[0]:g} s to {self.window_s[1]:g} s")
        return ", ".join(parts)


@dataclass(frozen=True)
class Participant:
    """The process under test, or the law that flies in one of ours."""

    place: Place
    kind: str  # command, python or library
    words: tuple[str, ...]
    folder: Path  # in which it runs
    env: Mapping[str, str] = field(default_factory=dict)
    ready: str = ""
    ready_s: float = DEFAULT_READY_S
    silent_s: float = DEFAULT_SILENT_S
    stop: signal.Signals = signal.SIGTERM


@dataclass(frozen=True)
class Check:
    file: Path
    name: str
    scenario_file: Path
    scenario: "Scenario"
    expectations: tuple[Expectation, ...]
    controller: Participant | None = None
    placements: tuple[str, ...] = ()
    faults: tuple[Fault, ...] = ()
    limit_s: float = DEFAULT_LIMIT_S

    @cached_property
    def is_lockstep(self) -> bool:
        """Whether equal flights have equal bytes over DDS."""
        sync = read_keys(self.scenario).get("sync") or {}
        return sync.get("mode") != "realtime"


def find_checks(name: str) -> list[Path]:
    """The files of an argument: a file, the files of a folder, or a name in config/checks."""
    path = Path(name)
    if path.is_dir():
        if files := sorted(path.glob("*.yaml")):
            return files
        raise ConfigError(f"{path}: expected a folder with check files (*.yaml), got none")
    if path.is_file() or "/" in name or name.endswith((".yaml", ".yml")):
        return [path]
    shipped = ROOT / "config/checks" / f"{name}.yaml"
    if not shipped.is_file():
        raise ConfigError(f"{shipped}: expected a check, got no such file{suggest(name, list_names('checks'))}")
    return [shipped]


def load_check(file: Path, library: Path | None = None) -> Check:
    """With `library` in place of the controller. Raises ConfigError: one line with file, line, key, expected and got."""
    root = parse_yaml(read_bytes(file, "a check file", MOST_BYTES), file)
    if root.is_map and any(key.value == "mission" for key, _ in root.node.value):
        root.fail("expected a check, which names a scenario and what to expect of it, got a scenario: ./sls run flies it")
    known = ("scenario", "expect", "participants", "placements", "under", "limit_s")
    values = root.read_map("a check: scenario, expect …", known)
    place = root.require(values, "scenario", "a name in config/scenarios, or a path")
    named = place.read_text("a name in config/scenarios, or a path")
    is_path = "/" in named or named.endswith((".yaml", ".yml"))
    scenario_file = file.parent / named if is_path else find_scenario(named)
    if not scenario_file.is_file():
        place.fail(f"expected a scenario, got no such file: {scenario_file}")
    scenario = load_scenario(scenario_file)
    controller = read_participants(values["participants"]) if "participants" in values else None
    if library:
        if not library.is_file():
            raise ConfigError(f"--library: expected a shared library, got no such file: {library}")
        controller = Participant(root, "library", (str(library.resolve()),), file.parent.resolve())
    if controller and controller.kind == "library":
        scenario = put_library(controller, scenario, scenario_file)
    check = Check(file, file.stem, scenario_file, scenario, (), controller)
    items = root.require(values, "expect", "a list of expectations")
    expectations = [read_expectation(item, scenario) for item in items.read_list("a list of expectations")]
    if not any(one.kind == "outcome" for one in expectations):
        expectations.insert(0, Expectation(items, "outcome", "finished"))
    limit = values.get("limit_s")
    check = replace(check, expectations=tuple(expectations),
                    faults=list_faults(values["under"]) if "under" in values else (),
                    limit_s=read_positive(limit, "seconds") if limit else DEFAULT_LIMIT_S)
    return replace(check, placements=read_placements(values.get("placements"), check))


def find_refusal(check: Check, placement: str) -> str:
    """What to expect instead of a placement that cannot fly and judge this check; empty if it can."""
    kind = check.controller.kind if check.controller else ""
    if kind == "command" and placement in ("in-process", "worlds"):
        return "shm, udp or hosts, because its controller is a command"
    if placement != "worlds":
        return ""
    if kind == "python":
        return "another placement, because its controller is a Python function"
    unseen = next((one for one in check.expectations if one.kind == "event" or one.what in OF_ANSWERS), None)
    return f"another placement, because worlds do not judge {unseen.what} (line {unseen.place.line})" if unseen else ""


def read_positive(place: Place, unit: str) -> float:
    value = float(place.read_number(f"a number of {unit} > 0"))
    if value <= 0:
        place.fail_expected(f"a number of {unit} > 0")
    return value


# --- expectations ---------------------------------------------------------------------------------


def read_expectation(place: Place, scenario: "Scenario") -> Expectation:
    readers: dict[str, Callable[[Place], Any]] = {
        "stage": lambda at: read_stage(at, scenario), "window_s": lambda at: read_window(at, scenario),
        "vehicle": lambda at: at.read_whole(0, len(scenario.vehicles) - 1),
        "over": lambda at: read_word(at, OVER), "axis": lambda at: read_word(at, AXES),
        "within_m": lambda at: read_positive(at, "m"), "for_s": lambda at: read_positive(at, "s"),
        "reason": lambda at: at.read_text("a text"), "because": lambda at: at.read_text("a text")}
    known = ("min", "max", *readers)
    values = place.read_map("an expectation, such as { measure: load_error_rms_m, max: 0.02 }", (*KINDS, *known))
    kind = place.find_one(values, KINDS)
    made = read_kind(place, kind, values[kind])
    allowed = (*KEYS[kind], "because", *(MEASURES[made.what].options if kind == "measure" else ()))
    for key in values:
        if key in known and key not in allowed:
            values[key].fail(f"expected no such key beside {kind}: {made.what}, got one")
    low, high = (float(values[key].read_number(f"a number ({made.unit or 'no unit'})")) if key in values else None
                 for key in ("min", "max"))
    if "max" in KEYS[kind] and low is None and high is None:
        place.fail("expected a bound, min or max, got none")
    if low is not None and high is not None and low > high:
        values["max"].fail(f"expected at least min ({low:g}), got {high:g}")
    read = {key: readers[key](value) for key, value in values.items() if key in readers}
    options = {key: read.pop(key) for key in ("axis", "within_m", "for_s") if key in read}
    return replace(made, low=low, high=high, options=options, **read)


def read_kind(place: Place, kind: str, what: Place) -> Expectation:
    """The expectation without its further keys."""
    if kind in ("outcome", "event"):
        return Expectation(place, kind, read_word(what, OUTCOMES if kind == "outcome" else EVENTS))
    named = what.read_text("a text in quotes")
    if kind == "certificate" and named != UNKNOWN and not re.fullmatch("[0-9a-f]{64}", named):
        what.fail_expected(f"64 hexadecimal digits, or {UNKNOWN} (./sls check --update writes them)")
    if kind == "measure":
        check_measure(what, named)
    if kind != "value":
        return Expectation(place, kind, named)
    try:
        return Expectation(place, kind, named, expression=Expression(named))
    except ExpressionError as error:
        what.fail(str(error))


def read_word(place: Place, known: tuple[str, ...]) -> str:
    word = place.read_text(f"one of {', '.join(known)}")
    if word not in known:
        place.fail_expected(f"one of {', '.join(known)}")
    return word


def check_measure(place: Place, name: str) -> None:
    if name in MEASURES:
        return
    for other in MEASURES:
        stem = other.rpartition("_")[0]
        if MEASURES[other].unit and stem and name.rpartition("_")[0] == stem:
            place.fail(f"expected the unit {MEASURES[other].unit} ({other}), got {name}")
    near = difflib.get_close_matches(name, MEASURES, 1)
    place.fail(f"expected a measure, got {name}"
               + (f"; did you mean '{near[0]}'?" if near else f"; known are {', '.join(MEASURES)}"))


def read_stage(place: Place, scenario: "Scenario") -> int:
    names = [name for _, name, _, _ in scenario.stages]
    value = place.find_scalar()
    listed = ", ".join(f"{index} {name}" for index, name in enumerate(names))
    if isinstance(value, int) and not isinstance(value, bool) and 0 <= value < len(names):
        return value
    if isinstance(value, str) and names.count(value) == 1:
        return names.index(value)
    if isinstance(value, str) and names.count(value) > 1:
        place.fail(f"expected an index, because {names.count(value)} stages have this name ({listed}), got {value}")
    place.fail_expected(f"a stage of {scenario.name} ({listed})")


def read_window(place: Place, scenario: "Scenario") -> tuple[float, float]:
    """Only where every stage has a duration is the end of the flight known before it."""
    times = [item.read_number("a time in s") for item in place.list_items()] if place.is_list else []
    if len(times) != 2 or not 0 <= times[0] < times[1]:
        place.fail_expected("a window [from, to] in s with 0 <= from < to")
    durations = [for_s for _, _, for_s, _ in scenario.stages]
    end_s = math.fsum(one for one in durations if one) if all(durations) else math.inf
    if times[1] > end_s:
        place.fail(f"expected a window within the flight, which ends at {end_s:g} s, got {times[1]:g} s")
    return float(times[0]), float(times[1])


# --- participants, placements ---------------------------------------------------------------------


def read_participants(place: Place) -> Participant | None:
    values = place.read_map("a map of participants", ("controller",))
    if "controller" not in values:
        return None
    own = values["controller"]
    readers: dict[str, Callable[[Place], Any]] = {
        "env": lambda at: {name: value.read_text("a text in quotes") for name, value in at.read_map("variables").items()},
        "ready": lambda at: at.read_text("a text of its output"), "ready_s": lambda at: read_positive(at, "seconds"),
        "silent_s": lambda at: read_positive(at, "seconds"),
        "stop": lambda at: signal.Signals[read_word(at, STOPS)]}
    keys = own.read_map("a controller: command, python or library", (*CONTROLLERS, *readers))
    kind = own.find_one(keys, CONTROLLERS)
    folder = own.file.parent.resolve()
    words = read_words(keys[kind], kind, folder)
    for key in keys:
        if key not in (kind, *CONTROLLERS[kind]):
            keys[key].fail(f"expected no such key beside {kind}, got one")
    more = {key: readers[key](value) for key, value in keys.items() if key != kind}
    return Participant(own, kind, words, folder, **more)


def read_words(what: Place, kind: str, folder: Path) -> tuple[str, ...]:
    """Program and arguments of a command, FILE.py:NAME of a law in Python, or the path of a library."""
    if kind != "command":
        expected = "FILE.py:NAME, a file and a law in it" if kind == "python" else "a library's file"
        text = what.read_text(expected)
        file, colon, name = text.rpartition(":") if kind == "python" else (text, "", "law")
        if not name.isidentifier() or not (folder / file).is_file():
            what.fail_expected(expected)
        return (f"{folder / file}{colon}{name if colon else ''}",)
    words = tuple(item.read_text("a word in quotes")
                  for item in what.read_list("a list of words: program and arguments"))
    if not (os.access(folder / words[0], os.X_OK) if "/" in words[0] else shutil.which(words[0])):
        what.list_items()[0].fail_expected("a program that exists")
    return words


def put_library(controller: Participant, scenario: "Scenario", file: Path) -> "Scenario":
    """The scenario with the library as its law. Only another library has the same keys beside it."""
    law, values = controller.words[0], read_keys(scenario)
    # It flies from another folder.
    changes = {f"{key}.model": str((file.parent / model).resolve()) for key in ("plant", "autopilot")
               if str(model := (values.get(key) or {}).get("model")).endswith(".so")}
    if scenario.law.endswith(".so"):
        return load_scenario(file, changes={**changes, "controller.law": law})
    own = {"law": law, "force_limit_n": scenario.force_limit_n}
    return load_scenario(file, changes={**changes, "controller": own})


def read_placements(place: Place | None, check: Check) -> tuple[str, ...]:
    if place is None:
        return ("shm",) if check.controller and check.controller.kind == "command" else ("in-process",)
    names = []
    for item in place.read_list(f"a list of {', '.join(PLACEMENTS)}"):
        name = read_word(item, PLACEMENTS)
        if refusal := find_refusal(check, name):
            item.fail(f"expected {refusal}, got {name}")
        names.append(name)
    return tuple(dict.fromkeys(names))

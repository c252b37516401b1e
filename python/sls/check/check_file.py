"""Reads check files. config/checks/README.md describes the keys."""

import difflib
import math
import re
import signal
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import yaml

from sls.campaign.expressions import Expression, ExpressionError
from sls.campaign.yaml_nodes import Place, parse_yaml, read_bytes
from sls.check.faults import PLACEMENTS, Fault, list_faults
from sls.errors import ConfigError
from sls.launcher.place import list_names, suggest
from sls.measures import MEASURES
from sls.scenario import ROOT, find_scenario, load_scenario

if TYPE_CHECKING:
    from _sls_core import Scenario

MOST_BYTES = 1_000_000
KINDS = ("outcome", "measure", "value", "event", "certificate")
OUTCOMES = ("finished", "failed")
EVENTS = {"take_over": "changes of the controller that flies",
          "fail_safe": "steps flown with the fail-safe force",
          "late_step": "steps without an answer of their own: held or fail-safe",
          "refused_answer": "answers that the server refused"}
OVER = ("max", "min", "mean", "rms", "end")
AXES = ("x", "y", "z")
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
    options: Mapping[str, Any] = field(default_factory=dict)  # further ones of a measure
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
    name: str
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
        sync = yaml.safe_load(self.scenario.text).get("sync") or {}
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
        controller = Participant(root, "controller", "library", (str(library.resolve()),), file.parent.resolve())
    if controller and controller.kind == "library":
        scenario = put_library(controller, scenario, scenario_file)
    check = Check(file, file.stem, scenario_file, scenario, (), controller)
    items = root.require(values, "expect", "a list of expectations")
    if not items.is_list or not items.node.value:
        items.fail_expected("a list of expectations")
    expectations = [read_expectation(item, scenario) for item in items.list_items()]
    if not any(one.kind == "outcome" for one in expectations):
        expectations.insert(0, Expectation(items, "outcome", "finished"))
    limit = values.get("limit_s")
    placements = read_placements(values.get("placements"), controller)
    return replace(check, expectations=tuple(expectations), placements=placements,
                   faults=list_faults(values["under"]) if "under" in values else (),
                   limit_s=read_positive(limit, "seconds") if limit else DEFAULT_LIMIT_S)


def read_positive(place: Place, unit: str) -> float:
    value = float(place.read_number(f"a number of {unit} > 0"))
    if value <= 0:
        place.fail_expected(f"a number of {unit} > 0")
    return value


# --- expectations ---------------------------------------------------------------------------------


def read_expectation(place: Place, scenario: "Scenario") -> Expectation:
    known = ("min", "max", "stage", "window_s", "vehicle", "over", "axis", "within_m", "for_s", "reason", "because")
    values = place.read_map("an expectation, such as { measure: load_error_rms_m, max: 0.02 }", (*KINDS, *known))
    kinds = [kind for kind in KINDS if kind in values]
    if len(kinds) != 1:
        place.fail(f"expected exactly one of {', '.join(KINDS)}, got {' and '.join(kinds) or 'none'}")
    kind, what = kinds[0], values[kinds[0]]
    named = what.read_text(f"a text: {describe_kind(kind)}")
    made = Expectation(place, kind, named)
    allowed: tuple[str, ...] = ()
    if kind == "outcome":
        allowed = ("reason",)
        check_word(what, named, OUTCOMES)
    elif kind == "certificate":
        if named != UNKNOWN and not re.fullmatch("[0-9a-f]{64}", named):
            what.fail_expected(f"64 hexadecimal digits, or {UNKNOWN} (./sls check --update writes them)")
    elif kind == "event":
        allowed = ("min", "max")
        check_word(what, named, tuple(EVENTS))
    elif kind == "measure":
        check_measure(what, named)
        allowed = ("min", "max", "vehicle", *MEASURES[named].options)
    else:
        allowed = ("min", "max", "stage", "window_s", "vehicle", "over")
        try:
            made = replace(made, expression=Expression(named))
        except ExpressionError as error:
            what.fail(str(error))
    for key, value in values.items():
        if key in known and key not in (*allowed, "because"):
            value.fail(f"expected no such key beside {kind}: {named}, got one")
    return replace(made, **read_options(place, values, made, scenario))


def describe_kind(kind: str) -> str:
    return {"outcome": " or ".join(OUTCOMES), "event": ", ".join(EVENTS), "measure": "the name of a measure",
            "value": "arithmetic with columns", "certificate": "64 hexadecimal digits"}[kind]


def check_word(place: Place, word: str, known: tuple[str, ...]) -> None:
    if word not in known:
        place.fail_expected(f"one of {', '.join(known)}")


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


def read_options(place: Place, values: dict[str, Place], made: Expectation, scenario: "Scenario") -> dict[str, Any]:
    read: dict[str, Any] = {}
    for key, name in (("min", "low"), ("max", "high")):
        if key in values:
            unit = made.unit or "no unit"
            read[name] = float(values[key].read_number(f"a number ({unit})"))
    if made.kind in ("measure", "value", "event") and not read:
        place.fail("expected a bound, min or max, got none")
    if len(read) == 2 and read["low"] > read["high"]:
        values["max"].fail(f"expected at least min ({read['low']:g}), got {read['high']:g}")
    if "stage" in values:
        read["stage"] = read_stage(values["stage"], scenario)
    if "window_s" in values:
        read["window_s"] = read_window(values["window_s"], scenario)
    if "vehicle" in values:
        read["vehicle"] = values["vehicle"].read_whole(0, len(scenario.vehicles) - 1)
    if "over" in values:
        read["over"] = values["over"].read_text(f"one of {', '.join(OVER)}")
        check_word(values["over"], read["over"], OVER)
    options: dict[str, Any] = {}
    if "axis" in values:
        options["axis"] = values["axis"].read_text(f"one of {', '.join(AXES)}")
        check_word(values["axis"], options["axis"], AXES)
    for key, unit in (("within_m", "m"), ("for_s", "s")):
        if key in values:
            options[key] = read_positive(values[key], unit)
    read["options"] = options
    for key in ("reason", "because"):
        if key in values:
            read[key] = values[key].read_text("a text")
    return read


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
    known = ("command", "python", "library", "env", "ready", "ready_s", "silent_s", "stop")
    keys = own.read_map("a controller: command, python or library", known)
    kinds = [kind for kind in known[:3] if kind in keys]
    if len(kinds) != 1:
        own.fail(f"expected exactly one of {', '.join(known[:3])}, got {' and '.join(kinds) or 'none'}")
    kind, what = kinds[0], keys[kinds[0]]
    folder = own.file.parent.resolve()
    if kind == "command":
        if not what.is_list or not what.node.value:
            what.fail_expected("a list of words: program and arguments")
        words = [item.read_text("a word in quotes") for item in what.list_items()]
    else:
        words = [what.read_text("FILE.py:NAME" if kind == "python" else "the path of a library")]
        path = folder / words[0].rpartition(":")[0] if kind == "python" else folder / words[0]
        if kind == "python" and not words[0].rpartition(":")[2].isidentifier() or not path.is_file():
            what.fail_expected("FILE.py:NAME, a file and a law in it" if kind == "python" else "a library's file")
        words = [f"{path}:{words[0].rpartition(':')[2]}" if kind == "python" else str(path)]
    made = Participant(own, "controller", kind, tuple(words), folder)
    if kind != "command":
        for key in keys:
            if key not in (kind, "silent_s"):
                keys[key].fail(f"expected no such key beside {kind}, got one")
    if "env" in keys:
        env = {name: value.read_text("a text in quotes") for name, value in keys["env"].read_map("variables").items()}
        made = replace(made, env=env)
    if "ready" in keys:
        made = replace(made, ready=keys["ready"].read_text("a text of its output"))
    for key in ("ready_s", "silent_s"):
        if key in keys:
            made = replace(made, **{key: read_positive(keys[key], "seconds")})
    if "stop" in keys:
        word = keys["stop"].read_text("a signal")
        if word not in ("SIGINT", "SIGTERM", "SIGHUP", "SIGKILL"):
            keys["stop"].fail_expected("SIGINT, SIGTERM, SIGHUP or SIGKILL")
        made = replace(made, stop=signal.Signals[word])
    return made


def put_library(controller: Participant, scenario: "Scenario", file: Path) -> "Scenario":
    """The scenario with the library as its law. Only another library has the same keys beside it."""
    law, values = controller.words[0], yaml.safe_load(scenario.text)
    # It flies from another folder.
    changes = {f"{key}.model": str((file.parent / model).resolve()) for key in ("plant", "autopilot")
               if str(model := (values.get(key) or {}).get("model")).endswith(".so")}
    if scenario.law.endswith(".so"):
        return load_scenario(file, changes={**changes, "controller.law": law})
    own = {"law": law, "force_limit_n": scenario.force_limit_n}
    return load_scenario(file, changes={**changes, "controller": own})


def read_placements(place: Place | None, controller: Participant | None) -> tuple[str, ...]:
    if place is None:
        return ("shm",) if controller and controller.kind == "command" else ("in-process",)
    if not place.is_list or not place.node.value:
        place.fail_expected(f"a list of {', '.join(PLACEMENTS)}")
    names = []
    for item in place.list_items():
        name = item.read_text("a placement")
        check_word(item, name, PLACEMENTS)
        if name in ("in-process", "worlds") and controller and controller.kind == "command":
            item.fail(f"expected shm, udp or hosts for a controller with a command of its own, got {name}")
        names.append(name)
    return tuple(dict.fromkeys(names))

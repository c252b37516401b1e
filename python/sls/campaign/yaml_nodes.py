"""YAML as a tree of places with line numbers, and the errors of the package's strict readers. The rules
are those of scenarios: error messages have file, line and key; anchors, aliases and tags are refused;
only `true` and `false` are truth values; a number in quotes is text."""

import difflib
import re
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

import yaml

from sls.input_error import InputError
from sls.strict_files import read_limited

MOST_DEPTH = 16
WHOLE = re.compile(r"[-+]?[0-9]+")
NUMBER = re.compile(r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?")


@dataclass(frozen=True)
class Place:
    """A value in a file, with its path of keys."""

    file: Path
    node: yaml.Node
    path: str = ""

    @property
    def line(self) -> int:
        """Line of the value, from 1."""
        return self.node.start_mark.line + 1

    def fail(self, message: str) -> NoReturn:
        """Raises InputError `FILE:LINE: PATH: message`."""
        fail(self.file, self.line, self.path, message)

    def fail_expected(self, expected: str) -> NoReturn:
        self.fail(f"expected {expected}, got {self.brief}")

    def at(self, key: str, node: yaml.Node) -> "Place":
        return Place(self.file, node, f"{self.path}.{key}" if self.path else key)

    @property
    def brief(self) -> str:
        """The value as text of a few printable characters."""
        if isinstance(self.node, yaml.SequenceNode):
            return f"a list of {len(self.node.value)}"
        if isinstance(self.node, yaml.MappingNode):
            return "a map"
        if self.is_nothing:
            return "nothing"
        text = to_printable(self.node.value)
        return text if self.node.style is None else f'"{text}"'

    @property
    def is_map(self) -> bool:
        return isinstance(self.node, yaml.MappingNode)

    @property
    def is_list(self) -> bool:
        return isinstance(self.node, yaml.SequenceNode)

    @property
    def is_nothing(self) -> bool:
        return (isinstance(self.node, yaml.ScalarNode) and self.node.style is None
                and self.node.value in ("", "~", "null", "Null", "NULL"))

    def list_items(self) -> list["Place"]:
        """The items of a list. The path of an item ends with its index in brackets."""
        return [Place(self.file, item, f"{self.path}[{i}]")
                for i, item in enumerate(self.node.value)]

    def read_map(self, expected: str = "a map",
                 known: Collection[str] | None = None) -> dict[str, "Place"]:
        """The values of a map by key. Refuses keys that are not in `known`, and duplicate keys."""
        if not self.is_map:
            self.fail_expected(expected)
        values: dict[str, Place] = {}
        lines: dict[str, int] = {}
        for key_node, node in self.node.value:
            key_place = Place(self.file, key_node, self.path)
            if not isinstance(key_node, yaml.ScalarNode) or key_place.is_nothing:
                key_place.fail_expected("a key")
            key = key_node.value
            key_place = self.at(to_printable(key, 100), key_node)
            if key in values:
                key_place.fail(f"duplicate key; it is already on line {lines[key]}")
            if known is not None and key not in known:
                nearest = difflib.get_close_matches(key, known, n=1)
                key_place.fail(f"unknown key; did you mean '{nearest[0]}'?" if nearest else
                               f"unknown key; expected one of {', '.join(known)}")
            values[key] = self.at(to_printable(key, 100), node)
            lines[key] = key_place.line
        return values

    def require(self, values: dict[str, "Place"], key: str, expected: str) -> "Place":
        """The value of `key` in `values`, which `read_map` has read from this map. Refuses a missing key."""
        if key not in values:
            self.at(key, self.node).fail(f"missing key; expected {expected}")
        return values[key]

    def find_one(self, values: dict[str, "Place"], kinds: Collection[str]) -> str:
        """The one of these keys that `values`, read from this map, has. Refuses none and several."""
        found = [key for key in values if key in kinds]
        if len(found) != 1:
            self.fail(f"expected exactly one of {', '.join(kinds)}, got {' and '.join(found) or 'none'}")
        return found[0]

    def read_list(self, expected: str, count: int | None = None) -> list["Place"]:
        """The items of a list: `count` of them, or at least one."""
        if not self.is_list or not self.node.value or count not in (None, len(self.node.value)):
            self.fail_expected(expected)
        return self.list_items()

    def find_scalar(self) -> bool | int | float | str | None:
        """The value of a scalar; None for a list, a map, nothing and a number that is not finite."""
        if not isinstance(self.node, yaml.ScalarNode) or self.is_nothing:
            return None
        text = self.node.value
        if self.node.style is not None:
            return text
        if text in ("true", "false"):
            return text == "true"
        if WHOLE.fullmatch(text) and len(text) <= 20:
            return int(text)
        if NUMBER.fullmatch(text):
            return float(text) if abs(float(text)) < float("inf") else None
        if re.fullmatch(r"[-+]?\.?(inf|Inf|INF|nan|NaN|NAN)", text):
            return None
        return text

    def read_number(self, expected: str = "a number") -> int | float:
        """The value of a number; a whole number is an int."""
        value = self.find_scalar()
        if isinstance(value, bool) or not isinstance(value, int | float):
            self.fail_expected(expected)
        return value

    def read_whole(self, least: int, most: int) -> int:
        value = self.find_scalar()
        if isinstance(value, bool) or not isinstance(value, int) or not least <= value <= most:
            self.fail_expected(f"a whole number from {least} to {most}")
        return value

    def read_text(self, expected: str) -> str:
        value = self.find_scalar()
        if not isinstance(value, str) or not value:
            self.fail_expected(expected)
        return value

    def read_value(self) -> Any:
        """Any value that a scenario may hold: scalars, lists (as tuples), maps."""
        if self.is_list:
            return tuple(item.read_value() for item in self.list_items())
        if self.is_map:
            return {key: value.read_value() for key, value in self.read_map().items()}
        value = self.find_scalar()
        if value is None:
            self.fail_expected("a value")
        return value

    def to_plain(self) -> Any:
        """The value as the programs read it: maps, lists, numbers, truth values, texts; None for nothing."""
        if self.is_list:
            return [item.to_plain() for item in self.list_items()]
        if self.is_map:
            return {key: value.to_plain() for key, value in self.read_map().items()}
        value = self.find_scalar()
        return self.node.value if value is None and not self.is_nothing else value

    def find(self, path: str) -> "Place | None":
        """The place below this one at `path`, which has keys and indices separated by dots; None if there
        is none."""
        place: Place | None = self
        for part in path.split("."):
            if place is None:
                return None
            if place.is_map:
                place = place.read_map().get(part)
            elif place.is_list and part.isdecimal() and int(part) < len(place.node.value):
                place = place.list_items()[int(part)]
            else:
                return None
        return place


def fail(file: Path, line: int, path: str, message: str) -> NoReturn:
    """Raises InputError `FILE:LINE: PATH: message`, without a line below 1 and without an empty path."""
    place = f"{file}:{line}" if line > 0 else str(file)
    raise InputError(": ".join(part for part in (place, path, message) if part))


def to_printable(text: str, most: int = 40) -> str:
    escaped = "".join(letter if " " <= letter <= "~" else f"\\x{ord(letter):02x}"
                      for letter in text[:most])
    return escaped + ("..." if len(text) > most else "")


def read_bytes(file: Path, what: str, most: int) -> bytes:
    """The bytes of a file. Raises InputError if it cannot be read or has more than `most` bytes."""
    try:
        return read_limited(file, most)
    except OSError as error:
        fail(file, 0, "", f"expected {what}, got no file that can be read ({error.strerror})")


def parse_yaml(data: bytes, file: Path) -> Place:
    """The only document in `data`. Raises InputError if `data` is not UTF-8 or not YAML, is nested too
    deeply, or has anchors, aliases or tags."""
    try:
        text = data.decode()
    except UnicodeDecodeError as error:
        fail(file, data.count(b"\n", 0, error.start) + 1, "",
             f"expected UTF-8 text, got the byte 0x{data[error.start]:02x}")
    try:
        depth = 0
        for event in yaml.parse(text, Loader=yaml.SafeLoader):
            line = event.start_mark.line + 1
            if isinstance(event, yaml.AliasEvent):
                fail(file, line, "", "expected a value, got a YAML alias (write the value out)")
            if getattr(event, "anchor", None):
                fail(file, line, "", "expected a value, got a YAML anchor (write the value out)")
            getattr(event, "value", "").encode()  # half of a surrogate pair could not be printed
            if getattr(event, "tag", None):
                fail(file, line, "", f"expected a plain value, got the YAML tag {event.tag}")
            depth += isinstance(event, yaml.CollectionStartEvent)
            depth -= isinstance(event, yaml.CollectionEndEvent)
            if depth > MOST_DEPTH:
                fail(file, line, "",
                     f"expected at most {MOST_DEPTH} levels of nesting, got more")
        root = yaml.compose(text, Loader=yaml.SafeLoader)
    except InputError:
        raise
    except (yaml.YAMLError, ValueError, OverflowError) as error:  # PyYAML lets those of an impossible escape through
        mark = getattr(error, "problem_mark", None)
        problem = getattr(error, "problem", None) or getattr(error, "reason", error)
        line = mark.line + 1 if mark else 0
        if not mark and (position := getattr(error, "position", None)) is not None:
            line = text.count("\n", 0, position) + 1
        if isinstance(error, yaml.composer.ComposerError):
            fail(file, line, "", "expected one YAML document, got a second one")
        fail(file, line, "",
             f"expected YAML, got a syntax error: {to_printable(str(problem), 100)}")
    if root is None:
        mark = yaml.Mark(str(file), 0, 0, 0, None, None)
        root = yaml.ScalarNode("", "", mark, mark)
    return Place(file, root)

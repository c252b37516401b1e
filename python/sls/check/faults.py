"""The words of `--under`: faults of docs/faults.md that begin once the flight runs, and what each placement can do."""

import re
from dataclasses import dataclass

from sls.campaign.yaml_nodes import Place
from sls.input_error import InputError

PLACEMENTS = ("in-process", "shm", "udp", "hosts", "worlds")
NETWORK, PROCESSES = ("hosts", "worlds"), ("shm", "udp", "hosts")
# Of each word: least and most of its number, or the programs that it may name; placements.
WORDS: dict[str, tuple[tuple[float, float] | tuple[str, ...], tuple[str, ...]]] = {
    "loss": ((0, 0.9), NETWORK),
    "delay_ms": ((0, 1000), NETWORK),
    "jitter_ms": ((0, 1000), NETWORK),
    "bandwidth_mbit": ((0.1, 10000), NETWORK),
    "partition_s": ((0, 60), NETWORK),
    "kill": (("controller",), (*PROCESSES, "worlds")),
    "stop_s": ((0, 60), (*PROCESSES, "worlds")),
    "busy": ((), ("in-process", *PROCESSES)),
}


@dataclass(frozen=True)
class Fault:
    word: str
    value: float | str = ""

    def __str__(self) -> str:
        return self.word if self.value == "" else f"{self.word}={self.value:g}" if isinstance(
            self.value, float) else f"{self.word}={self.value}"


def parse_fault(text: str) -> Fault:
    """The fault of `loss=0.2`. Raises InputError without a place."""
    word, equals, value = text.partition("=")
    if word not in WORDS:
        raise InputError(f"expected a fault ({', '.join(WORDS)}), got '{text}'")
    expected = WORDS[word][0]
    if not expected:
        if equals:
            raise InputError(f"{word}: expected no value, got '{value}'")
        return Fault(word)
    if isinstance(expected[0], str):
        if value not in expected:
            raise InputError(f"{word}: expected {' or '.join(map(str, expected))}, got '{value}'")
        return Fault(word, value)
    least, most = map(float, expected)
    is_number = re.fullmatch(r"[0-9]*\.?[0-9]+(e-?[0-9]+)?", value)
    if not is_number or not least <= float(value) <= most:
        raise InputError(f"{word}: expected {least:g} to {most:g}, got '{value}'")
    return Fault(word, float(value))


def list_faults(place: Place) -> tuple[Fault, ...]:
    """The faults of the key `under`: a map, or a list of words."""
    if place.is_list:
        pairs = [(item, item.read_text("a fault, such as loss=0.2")) for item in place.list_items()]
    else:
        pairs = [(value, f"{word}={value.node.value}" if not value.is_nothing else word)
                 for word, value in place.read_map("faults, such as { loss: 0.2 }", tuple(WORDS)).items()]
    faults = []
    for item, text in pairs:
        try:
            faults.append(parse_fault(text))
        except InputError as error:
            item.fail(str(error))
    return tuple(faults)


def check_able(faults: tuple[Fault, ...], placement: str) -> None:
    for fault in faults:
        able = WORDS[fault.word][1]
        if placement not in able:
            raise InputError(f"--under {fault}: expected a placement that can do it ({', '.join(able)}), got "
                             f"{placement}")

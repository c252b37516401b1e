"""The controller of a check that is a Python function: `closed_loop` flies it here, `client` over DDS.

    python3 -m sls.check.python_law closed_loop|client FILE.py:NAME SCENARIO …"""

import mmap
import sys
from pathlib import Path
from typing import Any

import sls
from sls.errors import ConfigError, RunError
from sls.launcher.place import escape_controls
from sls.user_module import load_user_module

STEPS = "steps"
"""File beside the recording: how many steps the law has answered, 8 bytes."""


def load_law(named: str) -> Any:
    file, _, name = named.rpartition(":")
    sys.path.insert(0, str(Path(file).parent))
    law = getattr(load_user_module(Path(file), file), name, None)
    if isinstance(law, type):
        law = law()
    if not callable(law):
        raise ConfigError(f"{file}: expected a law '{name}', which can be called, got {'none' if law is None else law}")
    return law


def count_steps(law: Any, file: Path) -> Any:
    """The law, which now writes into `file` how many steps it has answered: a process that hangs cannot say it."""
    file.write_bytes(bytes(8))
    with file.open("r+b") as opened:
        steps = memoryview(mmap.mmap(opened.fileno(), 8)).cast("Q")

    def counted(now: Any) -> Any:
        answer = law(now)
        steps[0] = now.step + 1
        return answer

    counted.__qualname__ = getattr(law, "__qualname__", type(law).__qualname__)
    if hasattr(law, "memory_size"):
        counted.memory_size = law.memory_size  # type: ignore[attr-defined]
    return counted


def main(words: list[str]) -> int:
    try:
        law = load_law(words[1])
        if words[0] == "closed_loop":
            file = Path(words[3]).with_name(STEPS)
            flight = sls.fly(sls.load_scenario(Path(words[2])), count_steps(law, file))
            file.unlink()
            flight.save(words[3])
        else:
            sls.Client(law, sls.load_scenario(Path(words[2])), qos=words[3], domain=int(words[4]), name=words[5],
                       strength=int(words[6])).run()
    except (ConfigError, RunError) as error:
        print(f"controller: {escape_controls(error)}", file=sys.stderr)
        return 2 if isinstance(error, ConfigError) else 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

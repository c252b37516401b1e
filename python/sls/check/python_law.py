"""The controller of a check that is a Python function: `closed_loop` flies it here, `client` over DDS.

    python3 -m sls.check.python_law closed_loop|client FILE.py:NAME SCENARIO …"""

import sys
from pathlib import Path
from typing import Any

import sls
from sls.errors import ConfigError, RunError
from sls.user_module import load_user_module


def load_law(named: str) -> Any:
    file, _, name = named.rpartition(":")
    sys.path.insert(0, str(Path(file).parent))
    law = getattr(load_user_module(Path(file), file), name, None)
    if law is None:
        raise ConfigError(f"{file}: expected a law '{name}', got none")
    return law() if isinstance(law, type) else law


def main(words: list[str]) -> int:
    try:
        law = load_law(words[1])
        if words[0] == "closed_loop":
            sls.fly(sls.load_scenario(Path(words[2])), law).save(words[3])
        else:
            sls.Client(law, sls.load_scenario(Path(words[2])), qos=words[3], domain=int(words[4]), name=words[5],
                       strength=int(words[6])).run()
    except (ConfigError, RunError) as error:
        print(f"controller: {error}", file=sys.stderr)
        return 2 if isinstance(error, ConfigError) else 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

"""Replaces the extension module in tests of chunks and processes. A run takes no time, and its measures are
simple functions of its values.

SLS_FAKE holds words: `kill=17` ends the process in run 17 each time, `kill-once=17:FILE` only if FILE does
not exist yet, `sleep=0.01` makes a run last 0.01 s, `hold=190:FILE` lets no run from 190 on end before FILE
exists, `note=FOLDER` leaves the process's id there, `refuse=17` refuses run 17 when it is flown, `print=1`
prints in each run as a law or a measure may. The number of a run is the value of its last key, `index`."""

import hashlib
import math
import os
import pathlib
import signal
import time

from sls.errors import ConfigError, RunError  # noqa: F401

WORDS = dict(word.split("=", 1) for word in os.environ.get("SLS_FAKE", "").split())


class Runs:
    columns = ["load_error_rms_m", "load_error_max_m"]

    def __init__(self, base_file, paths, measures, period_s=None):
        self.base = pathlib.Path(base_file).read_text()
        self.paths = paths

    def scenario_text(self, values):
        return "".join(f"{path}: {value}\n" for path, value in zip(self.paths, values))

    def check(self, values):
        if values and float(values[0]) < 0:
            raise ConfigError(f"base.yaml:2: {self.paths[0]}: expected > 0, got {values[0]}")

    def fly(self, values, certify):
        self.check(values)
        if "print" in WORDS:
            print("printed")
            os.write(1, b"printed by a library\n")
        if "sleep" in WORDS:
            time.sleep(float(WORDS["sleep"]))
        if "note" in WORDS:
            pathlib.Path(WORDS["note"], str(os.getpid())).touch()
        index = int(values[-1])
        first_held, _, gate = WORDS.get("hold", "inf").partition(":")
        while index >= float(first_held) and not os.path.exists(gate):
            time.sleep(0.01)
        once, _, marker = WORDS.get("kill-once", "").partition(":")
        if WORDS.get("kill") == str(index) or once == str(index) and not os.path.exists(marker):
            if marker:
                pathlib.Path(marker).touch()
            os.kill(os.getpid(), signal.SIGKILL)
        if WORDS.get("refuse") == str(index):
            raise ConfigError(f"base.yaml:2: {self.paths[0]}: expected > 0, got 0")
        mass = float(values[0])
        outcome = "lost" if mass > 0.3 else "finished"
        certificate = hashlib.sha256(self.scenario_text(values).encode()).hexdigest()
        return (outcome, "load more than 1 m, further\nfrom its reference" * (outcome == "lost"),
                [math.sqrt(mass), math.nan if outcome == "lost" else mass],
                certificate if certify else "", 8000)

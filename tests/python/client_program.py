"""A client program, written like a user's: `client_program.py SCENARIO DOMAIN NAME STRENGTH LAW`."""

import sys
import time
from pathlib import Path

import sls
import sls.client

sys.path.append(str(Path(__file__).resolve().parents[2] / "examples/python"))
from pid import Pid  # noqa: E402


class Broken(Pid):
    def __call__(self, now):
        if now.step == 150:
            raise ValueError("no idea")
        return super().__call__(now)


class Sleepy(Pid):
    def __call__(self, now):
        if now.step == 150:
            print("sleeps", flush=True)
            time.sleep(1000)
        return super().__call__(now)


MODEL = sls.load_scenario("figure_eight_pid").controller_model
LAWS = {"pid": Pid(MODEL), "broken": Broken(MODEL), "sleepy": Sleepy(MODEL),
        "counting": Pid(MODEL, (0.6, 1.5, 0.01, 36.0, 12.0))}  # its integral is in its memory


def main():
    scenario, domain, name, strength, law = sys.argv[1:]
    if law == "sleepy":
        sls.client.PATIENCE_S = 1.0
    sls.Client(LAWS[law], scenario, domain=int(domain), name=name, strength=int(strength)).run()


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        print("interrupted", flush=True)
        sys.exit(130)
    except (sls.ConfigError, sls.RunError) as error:
        print(f"{type(error).__name__}: {error}", flush=True)
        sys.exit(2 if isinstance(error, sls.ConfigError) else 1)

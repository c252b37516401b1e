"""The law of pid.py over DDS: this program is the controller of a running server.

    build/bin/sim_server --scenario config/scenarios/figure_eight_pid.yaml &
    build/bin/recorder --out recordings/pid &
    ./sls python examples/python/pid_client.py

A second client with `--name standby --strength -1` waits and takes over when this one is killed
(`sync.wait_for.controllers: 2` in the scenario makes the server wait for both)."""

import argparse

from pid import Pid

import sls


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    options.add_argument("scenario", nargs="?", default="figure_eight_pid",
                         help="name or path, the server's (default: %(default)s)")
    options.add_argument("--domain", type=int, help="DDS domain (default: SLS_DOMAIN, else 0)")
    options.add_argument("--name", default="pid_client", help="in recordings")
    options.add_argument("--strength", type=int, default=0, help="the strongest flies (default: 0)")
    chosen = options.parse_args()
    scenario = sls.load_scenario(chosen.scenario)
    sls.Client(Pid(scenario.controller_model), scenario, name=chosen.name,
               strength=chosen.strength, domain=chosen.domain).run()


if __name__ == "__main__":
    main()

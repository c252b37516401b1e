"""Instructions per step of the programs, counted by callgrind: other work does not change them.

A flight of 2,000 steps is subtracted from one of 4,000, so start and end do not count. The clocks
of the programs are as slow as callgrind makes them (slow_clock.c). Of each program the threads
count that a step wakes; what the others do follows the clock and not the steps.
"""

import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from bench.programs import Programs
from bench.results import LESS, Figure, format_lines
from sls.errors import RunError

STEPS = (2000, 4000)
PERIOD_S = 0.001
PLANTS = {"analytic": "model: analytic", "slung_load": "pendulum: ideal"}
# Threads that a step wakes, without and with recorder. Server: the one that receives the answer
# flies the step; another one writes the batches. Recorder: one receives, one writes the files.
STEP_THREADS = {"sim_server": (1, 2), "control_client": (1, 1), "recorder": (0, 2)}

# Objects that do not count: valgrind's processor lacks the instructions of real ones for SHA-256.
NOT_COUNTED = re.compile(r"^lib(crypto|slow_clock)\.")

# Functions that wait, or prepare it. They depend on how often a message is there before a thread
# waits for it, which other work decides: with them a count varies by 7 %, without by 2 %.
WAITING = re.compile(r"mutex_(timed|clock)lock|mutex_unlock_full|clock_gettime|futex|sem_|cond_"
                     r"|find_if<std::atomic<pthread_mutex_t|gmtime_r")

Function = tuple[str, str]  # name of its object file, name

C_OR_OURS = r"^libc\.|^(sim_server|control_client|recorder)$"  # which replace some of its functions

# Parts of a program, by object file and function; the first that fits counts.
PARTS = (
    ("numbers as text", "", r"^std::to_chars|CsvFile::add\(double\)|write_shortest|^fmt::"),
    ("Simbody", r"^libSimTK", ""),
    ("plant", r"^sim_server$", r"Plant::|Pendulum|^sls::math|^SimTK"),
    ("law and mission", r"^control_client$",
     r"^sls::control::(?!Client|Answerer|AnswerStream)|^sls::math"),
    ("locks", C_OR_OURS,
     r"pthread_(mutex|rwlock|cond)|sem_|futex|^__lll|find_if<std::atomic<pthread_mutex_t"),
    ("calendar time", C_OR_OURS, r"offtime|__tz|gmtime|localtime"),
    ("memory", r"^libc\.|^libstdc",
     r"malloc|free|operator (new|delete)|^unlink_chunk|^tcache|calloc|realloc"),
    ("dynamic casts", r"^libstdc", r"dyncast|dynamic_cast|strcmp"),
    ("Fast DDS", r"^lib(fastrtps|fastdds|fastcdr)", ""),
    ("C and C++ library", r"^(lib|ld-)", ""),
    ("our own", "", ""),
)


def parse_profile(text: Iterator[str]) -> Counter[Function]:
    """The instructions of each function itself, of a file that callgrind wrote."""
    names: dict[tuple[str, str], str] = {}

    def find_name(kind: str, value: str) -> str:
        number, _, name = value.partition(" ")
        if not number.startswith("("):
            return value
        if name:
            names[kind, number] = name
        return names[kind, number]

    counts: Counter[Function] = Counter()
    where = {"ob": "", "fn": ""}
    is_call = False
    for line in text:
        key, equals, value = line.rstrip("\n").partition("=")
        if line[:1].isdigit() or line.startswith(("+", "-", "*")):
            if not is_call:  # else the line has the cost of what was called
                counts[Path(where["ob"]).name, where["fn"]] += int(line.split()[1])
            is_call = False
        elif equals and key in ("ob", "cob", "fn", "cfn"):
            kind = key[-2:]
            name = find_name(kind, value)
            if key == kind:
                where[kind] = name
        elif equals and key == "calls":
            is_call = True
    return counts


def read_threads(profile: Path) -> dict[str, Counter[Function]]:
    """The counts of each thread, by its number."""
    threads = {}
    for file in profile.parent.glob(f"{profile.name}-*"):
        with file.open() as text:
            threads[file.name.removeprefix(profile.name)] = parse_profile(text)
    if not threads:
        raise RunError(f"{profile}: expected profiles of callgrind, got none")
    return threads


def calc_per_step(fewer: Path, more: Path, count: int) -> Counter[Function]:
    """Instructions per step of the `count` threads that a step wakes: those that differ most."""
    before, after = read_threads(fewer), read_threads(more)
    for number, functions in after.items():
        functions.subtract(before.get(number, {}))
    threads = sorted(after.values(), key=lambda functions: functions.total())
    steps = STEPS[1] - STEPS[0]
    found: Counter[Function] = Counter()
    for thread in threads[-count:]:
        for function, instructions in thread.items():
            if not NOT_COUNTED.match(function[0]):
                found[function] += instructions / steps
    return found


def callgrind(programs: Programs, profile: Path, command: list[str]) -> list[str]:
    library = programs.build / "bench/libslow_clock.so"
    return ["env", f"LD_PRELOAD={library}", "valgrind", "--tool=callgrind",
            "--separate-threads=yes", f"--callgrind-out-file={profile}", *command]


def count_flight(programs: Programs, plant: str, is_recorded: bool) -> dict[str, Counter[Function]]:
    """Instructions per step of each function of server, client and, if `is_recorded`, recorder, in
    a figure eight at 1 ms over shared memory."""
    profiles: dict[tuple[str, int], Path] = {}
    commands = {}
    for domain, steps in enumerate(STEPS, programs.domain):
        scenario = programs.figure_eight(steps * PERIOD_S, is_recorded=is_recorded, plant=PLANTS[plant])
        started = programs.make_commands(scenario, programs.make_path("") if is_recorded else None, server=(
            "--period-s", str(PERIOD_S)), domain=domain)
        for name, command in started.items():
            profiles[name, steps] = programs.make_path(".callgrind")
            commands[f"{name} of {steps} steps"] = callgrind(programs, profiles[name, steps], command)
    programs.run_together(commands, may_spin=False)
    return {name: calc_per_step(profiles[name, STEPS[0]], profiles[name, STEPS[1]],
                                STEP_THREADS[name][is_recorded]) for name in started}


def find_part(function: Function) -> str:
    return next(part for part, of_object, of_function in PARTS
                if re.search(of_object, function[0]) and re.search(of_function, function[1]))


def sum_parts(functions: Counter[Function]) -> Counter[str]:
    parts: Counter[str] = Counter()
    for function, instructions in functions.items():
        parts[find_part(function)] += instructions
    return parts


def count_without_waits(functions: Counter[Function]) -> int:
    return round(sum(count for (_, name), count in functions.items() if not WAITING.search(name)))


def format_parts(counted: dict[str, Counter[Function]]) -> list[str]:
    """A line for each part, a column for each program."""
    parts = {name: sum_parts(functions) for name, functions in counted.items()}
    rows = [("instructions per step", *counted)]
    for part, *_ in PARTS:
        rows.append((part, *(f"{parts[name][part]:,.0f}" for name in counted)))
    rows.append(("all", *(f"{functions.total():,.0f}" for functions in counted.values())))
    rows.append(("without waits", *(f"{count_without_waits(functions):,}"
                                    for functions in counted.values())))
    return format_lines(rows, left=(0,))


def format_functions(name: str, functions: Counter[Function], top: int = 25) -> list[str]:
    rows = [(name, "object", "function")]
    for (of_object, function), instructions in functions.most_common(top):
        rows.append((f"{instructions:,.0f}", of_object, function[:80]))
    return format_lines(rows, left=(1, 2))


def measure_instructions(programs: Programs, rounds: int, is_quick: bool) -> list[Figure]:
    figures = []
    for plant in ("analytic",) if is_quick else PLANTS:
        for is_recorded in (False, True):
            title = f"{plant}, {'with' if is_recorded else 'without'} recorder"
            flight = count_flight(programs, plant, is_recorded)
            print(title, *format_parts(flight), "", sep="\n")
            for name, functions in flight.items():
                if is_recorded:
                    print(*format_functions(name, functions), "", sep="\n")
                figures.append(Figure("instructions", f"{name}, {title}", "per step",
                                      [functions.total()], better=LESS))
    return figures

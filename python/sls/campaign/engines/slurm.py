"""Flies a campaign as job arrays of Slurm. See README.md beside this file."""

import getpass
import hashlib
import os
import re
import shlex
import shutil
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

from sls.campaign.engines import EngineError, EngineOptions
from sls.campaign.engines.cluster import describe_rest, find_missing, find_places
from sls.campaign.folder import COLLECT_JOB, CampaignFolder, DamagedChunk
from sls.campaign.progress import Progress
from sls.campaign.whole_files import write_whole
from sls.input_error import InputError
from sls.launcher.place import say

CHUNK_S = 60.0         # work in a chunk, s
TASK_S = 60.0          # least work in a task, s, because Slurm starts only a few tasks per second
MOST_ROUNDS = 3        # submissions of a chunk
LOST_AFTER_S = 60.0    # a controller without an answer for this time is lost
EVERY_S = 0.5          # between two looks at the folder
LAST_POLL_S = 15.0     # between two questions to the controller: long, because it serves the whole site
COMMAND_LIMIT_S = 60.0
WORKER_ERROR = "campaign-worker: error:"
START = "`sinfo` must show the nodes of a running cluster; SLURM_CONF names its slurm.conf"
INSTALL = f"apt-get install slurm-client; {START}"


class ControllerLost(Exception):
    """The error message of a Slurm command."""


def ask(*command: str) -> str:
    """The output of a Slurm command. Raises EngineError if it is not installed, ControllerLost if it
    fails."""
    try:
        # The command gets its own session: Ctrl-C reaches only this process.
        done = subprocess.run(command, capture_output=True, text=True, timeout=COMMAND_LIMIT_S,
                              start_new_session=True)
    except FileNotFoundError:
        raise EngineError(f"slurm: {command[0]}: not found: {INSTALL}") from None
    except subprocess.TimeoutExpired:
        raise ControllerLost(f"{command[0]}: no answer in {COMMAND_LIMIT_S:.0f} s") from None
    if done.returncode != 0:
        raise ControllerLost(to_one_line(done.stderr) or f"{command[0]}: exit code "
                             f"{done.returncode}")
    return done.stdout


def to_one_line(text: str) -> str:
    return "; ".join(line.strip() for line in text.splitlines() if line.strip())


def name_job(folder: CampaignFolder) -> str:
    """The name of the folder's jobs: always the same for a folder, and different for other folders. Slurm
    takes a comma as the end of a name."""
    place = str(folder.folder.resolve())
    campaign = re.sub(r"[^A-Za-z0-9_.-]", "_", folder.plan.campaign)
    return f"sls-{campaign}-{hashlib.sha256(place.encode()).hexdigest()[:8]}"


def name_collect_job(folder: CampaignFolder) -> str:
    return name_job(folder) + "-collect"


@cache
def user() -> str:
    return getpass.getuser()


def list_states(name: str) -> Counter[str]:
    """The number of tasks in each state, for the user's jobs of this name. Raises ControllerLost."""
    lines = ask("squeue", "--noheader", "--array", f"--user={user()}", f"--name={name}",
                "--format=%T %r").splitlines()
    return Counter(line.removesuffix(" None").strip() for line in lines)


def describe(states: Counter[str]) -> str:
    """Counts and states as text: `PENDING Resources` becomes `pending (Resources)`."""
    return ", ".join(f"{count} {name.lower()}" + (f" ({reason})" if reason else "")
                     for state, count in sorted(states.items()) for name, _, reason in [state.partition(" ")])


def describe_status(folder: CampaignFolder) -> list[str]:
    """Lines of `./sls campaign status DIR`."""
    try:
        tasks, collect = list_states(name_job(folder)), list_states(name_collect_job(folder))
    except (EngineError, ControllerLost) as error:
        return [f"slurm     unknown: {error}"]
    lines = [f"slurm     tasks of job {name_job(folder)}: {describe(tasks) or 'none'}"]
    if collect:
        lines.append(f"slurm     job {name_collect_job(folder)}: {describe(collect)}")
    return lines


def cancel(folder: CampaignFolder) -> None:
    """Cancels all jobs of this folder. Raises ControllerLost."""
    for name in (name_collect_job(folder), name_job(folder)):
        ask("scancel", f"--user={user()}", f"--name={name}")


# --- submitting -----------------------------------------------------------------------------------


def measure_run_s(folder: CampaignFolder, missing: Sequence[int]) -> float:
    """The time of a run, s: from chunks in the folder, or, if there are none, from up to three flights."""
    runs = wall_s = 0.0
    for number, first, last in folder.chunks[:20]:
        try:
            wall_s += folder.read_whole_chunk(number).flown["wall_s"]
            runs += last - first + 1
        except DamagedChunk:
            pass
    if wall_s > 0:
        return wall_s / runs
    from sls.campaign.own_measures import load_own_measures
    from sls.campaign.runs import fly_range, make_runs
    flyer, own = make_runs(folder.campaign), load_own_measures(folder.campaign)
    first, last = folder.find_chunk(missing[0])
    begin = time.monotonic()
    count = sum(1 for _ in fly_range(folder.campaign, flyer, first, min(first + 2, last), own))
    return (time.monotonic() - begin) / count


def to_ranges(numbers: Sequence[int]) -> str:
    """Writes numbers as ranges: 3, 4, 5, 9 as `3-5 9`."""
    ranges = list[list[int]]()
    for number in numbers:
        if ranges and number == ranges[-1][1] + 1:
            ranges[-1][1] = number
        else:
            ranges.append([number, number])
    return " ".join(f"{first}-{last}" if first != last else str(first) for first, last in ranges)


def export_environment() -> str:
    """Lines of a script. With them a compute node finds the modules of this process and builds nothing."""
    values = {"PYTHONPATH": os.pathsep.join(find_places()), "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    if build := os.environ.get("SLS_BUILD"):
        values["SLS_BUILD"] = str(Path(build).resolve())
    return "".join(f"export {name}={shlex.quote(value)}\n" for name, value in values.items())


def make_task_script(folder: Path, tasks: Path) -> str:
    """The script of a task, which flies the chunks of one line of the file `tasks`."""
    worker = shlex.join([sys.executable, "-BP", "-m", "sls.campaign.worker", str(folder)])
    return f"""\
#!/bin/sh
{export_environment()}
for chunks in $(sed -n "$((SLURM_ARRAY_TASK_ID + 1))p" {shlex.quote(str(tasks))}); do
  {worker} --chunks "$chunks" || exit
done
"""


def make_collect_script(folder: Path, number: int, options: EngineOptions) -> str:
    again = shlex.join([sys.executable, "-BP", "-m", "sls.campaign.engines.slurm", str(folder),
                        str(number), options.sbatch, str(options.workers or 0),
                        str(options.chunk_runs or 0)])
    return f"#!/bin/sh\n{export_environment()}\nexec {again}\n"


def split_options(sbatch: str) -> list[str]:
    """Splits options as a shell does. Raises InputError if a quote is not closed."""
    try:
        return shlex.split(sbatch)
    except ValueError as error:
        raise InputError(f"--sbatch: expected options as a shell reads them, got '{sbatch}': "
                         f"{error}") from None


def submit(script: Path, name: str, log: Path, sbatch: str, *options: str) -> str:
    """Submits a job and returns its number. Raises InputError if sbatch refuses its options,
    ControllerLost."""
    own = [f"--job-name={name}", f"--output={log}", "--open-mode=append", "--ntasks=1",
           "--cpus-per-task=1"]
    try:
        # The name comes last, because `squeue` finds the folder's jobs by it: --sbatch must not replace it.
        answer = ask("sbatch", "--parsable", *own, *split_options(sbatch), f"--job-name={name}",
                     *options, str(script))
    except ControllerLost as error:
        if sbatch and "contact" not in str(error):
            raise InputError(f"--sbatch '{sbatch}': {error}") from None
        raise
    return answer.strip().partition(";")[0]


def find_largest_array() -> int:
    """The largest number of tasks in a job array of this cluster."""
    for line in ask("scontrol", "show", "config").splitlines():
        name, _, value = line.partition("=")
        if name.strip() == "MaxArraySize" and value.strip().isdecimal():
            return max(1, int(value))
    return 1001


@dataclass
class Round:
    """The job arrays of one submission; `number` counts submissions from 1."""

    number: int
    jobs: list[str] = field(default_factory=list)


def submit_round(folder: CampaignFolder, missing: Sequence[int], number: int,
                 options: EngineOptions) -> Round:
    """Submits chunks as one array, or as several if one would be too large for this cluster, and the
    collect job. Raises InputError, EngineError, ControllerLost."""
    place = folder.folder.resolve()
    own = place / "slurm"
    own.mkdir(exist_ok=True)
    run_s = measure_run_s(folder, missing)
    # With --chunk-runs a task flies one chunk.
    chunks_each = 1 if options.chunk_runs else max(
        1, -(-int(TASK_S / max(run_s, 1e-6)) // folder.plan.chunk_runs))
    tasks = [list(missing[begin:begin + chunks_each]) for begin in range(0, len(missing), chunks_each)]
    largest = find_largest_array()
    at_once = f"%{options.workers}" if options.workers else ""
    done = Round(number)
    for part, begin in enumerate(range(0, len(tasks), largest)):
        here = tasks[begin:begin + largest]
        listed = own / f"tasks-{number}-{part}.txt"
        write_whole(listed, "".join(to_ranges(task) + "\n" for task in here).encode())
        script = own / f"task-{number}-{part}.sh"
        write_whole(script, make_task_script(place, listed).encode())
        # The limit of an array holds for this array alone: with it, one array flies after the other.
        after = [f"--dependency=afterany:{done.jobs[-1]}"] if options.workers and done.jobs else []
        done.jobs.append(submit(script, name_job(folder), own / "task-%A-%a.log", options.sbatch,
                                "--requeue", f"--array=0-{len(here) - 1}{at_once}", *after))
    script = own / f"collect-{number}.sh"
    write_whole(script, make_collect_script(place, number, options).encode())
    submit(script, name_collect_job(folder), own / "collect-%j.log", options.sbatch,
           "--requeue", "--dependency=afterany:" + ":".join(done.jobs))
    say(f"slurm: job {', '.join(done.jobs)}: chunks: {len(missing)}, tasks: {len(tasks)}"
        + (f", submission {number} of {MOST_ROUNDS}" if number > 1 else ""))
    return done


def find_reason(folder: CampaignFolder, jobs: Sequence[str]) -> str:
    """The last message of a failed task of these jobs."""
    logs = [log for job in jobs for log in (folder.folder / "slurm").glob(f"task-{job}-*.log")]
    for log in sorted(logs, key=lambda file: file.stat().st_mtime, reverse=True):
        errors = [line for line in log.read_text(errors="replace").splitlines() if "error" in line]
        if errors:
            return f"{log}: {errors[-1]}"
    return f"logs in {folder.folder / 'slurm'}"


# --- waiting --------------------------------------------------------------------------------------


def count_files(folder: CampaignFolder) -> set[int]:
    """Numbers of the chunks that have a file. `find_missing` checks later if these files are whole."""
    names = os.listdir(folder.folder / "chunks")
    return {int(name[6:-4]) for name in names if name.startswith("chunk-") and name[6:-4].isdecimal()}


def wait(folder: CampaignFolder, missing: Sequence[int], progress: Progress) -> None:
    """Waits until only held tasks are queued, or all chunks have a file. Raises EngineError if the
    controller does not answer for LOST_AFTER_S."""
    missing = set(missing)
    # A damaged chunk also has a file, until a task replaces it.
    damaged = missing & count_files(folder)
    seen, poll_s, answered = set(damaged), EVERY_S, time.monotonic()
    asked = answered - poll_s
    while True:
        new = (count_files(folder) & missing) - seen
        for number in new:
            progress.add(number)
        seen |= new
        progress.draw()
        if seen == missing and not damaged:
            return
        if time.monotonic() >= asked + poll_s:
            poll_s, asked = min(poll_s * 1.2, LAST_POLL_S), time.monotonic()
            try:
                states = list_states(name_job(folder))
                answered = time.monotonic()
                if all(is_held(state) for state in states):
                    cancel(folder)
                    return
            except ControllerLost as error:
                if time.monotonic() - answered > LOST_AFTER_S:
                    raise EngineError(describe_loss(folder, error)) from None
        time.sleep(EVERY_S)


def is_held(state: str) -> bool:
    """True if Slurm holds the task and will not start it by itself, for example after a failed launch."""
    return state.startswith("PENDING") and "held" in state.lower()


def describe_loss(folder: CampaignFolder, error: ControllerLost) -> str:
    return f"slurm: the controller does not answer ({error}); {describe_rest(folder)}"


def check(options: EngineOptions) -> None:
    """Raises InputError or EngineError if this process cannot submit jobs."""
    split_options(options.sbatch)
    file = os.environ.get("SLURM_CONF")
    if shutil.which("sinfo") and file and not os.path.isfile(file):  # Slurm 24 would wait 60 s for it
        raise EngineError(f"slurm: no cluster answers (SLURM_CONF: expected a file, got {file}): "
                          f"{START}")
    try:
        ask("sinfo", "--noheader")
    except ControllerLost as error:
        raise EngineError(f"slurm: no cluster answers ({error}): {START}") from None


def run(folder: CampaignFolder, options: EngineOptions) -> None:
    """Flies the missing chunks. Ctrl-C cancels the jobs. After SIGTERM and SIGHUP they continue, and the
    collect job makes the table. Raises InputError, EngineError."""
    check(options)
    try:
        cancel(folder)  # jobs of an earlier launcher that was killed
        missing = folder.missing()
        with Progress(folder, len(missing), options.progress) as progress:
            for number in range(1, MOST_ROUNDS + 1):
                if not missing:
                    break
                before = len(missing)
                submitted = submit_round(folder, missing, number, options)
                wait(folder, missing, progress)
                missing = find_missing(folder, is_last_try=number == MOST_ROUNDS)
                if len(missing) == before and WORKER_ERROR in find_reason(folder, submitted.jobs):
                    break  # a mistake of the user: another try would fail, too
        cancel(folder)  # ends the collect job, because this process collects
    except ControllerLost as error:
        raise EngineError(describe_loss(folder, error)) from None
    except KeyboardInterrupt as interrupt:
        if type(interrupt) is KeyboardInterrupt:
            try:
                cancel(folder)
            except (EngineError, ControllerLost) as error:
                say(f"slurm: could not cancel job {name_job(folder)}: {error}")
        else:
            say(f"slurm: the jobs go on, and job {name_collect_job(folder)} makes runs.csv")
        raise
    if missing:
        raise EngineError(describe_missing(folder, missing, submitted))


def describe_missing(folder: CampaignFolder, missing: Sequence[int], submitted: Round) -> str:
    first, last = folder.find_chunk(missing[0])
    return (f"slurm: {len(missing)} chunks are missing after {submitted.number} submissions, first "
            f"that of runs {first}-{last}: {find_reason(folder, submitted.jobs)}")


# --- the collect job ------------------------------------------------------------------------------


def collect(folder: CampaignFolder, number: int, options: EngineOptions) -> None:
    """Makes the table, or submits the missing chunks again. Does nothing if a launcher still waits for
    the campaign. Raises InputError, EngineError, ControllerLost."""
    from sls.campaign.collect import collect as collect_folder, describe_broken_measures
    try:
        folder.take_lock(COLLECT_JOB)
    except InputError as error:
        say(f"slurm: nothing to do: {error}")
        return
    missing = find_missing(folder, is_last_try=number >= MOST_ROUNDS)
    if not missing:
        collect_folder(folder, "slurm")
        say(f"slurm: {folder.folder}/runs.csv")
        if broken := describe_broken_measures(folder.manifest):
            say(f"slurm: error: {broken}")
    elif number < MOST_ROUNDS:
        submit_round(folder, missing, number + 1, options)
    else:
        raise EngineError(describe_missing(folder, missing, Round(number)))


def main(arguments: Sequence[str]) -> int:
    """Runs a collect job and returns its exit code."""
    place, number, sbatch, workers, chunk_runs = arguments
    folder = CampaignFolder(place)
    try:
        collect(folder, int(number), EngineOptions(
            workers=int(workers) or None, sbatch=sbatch, chunk_runs=int(chunk_runs) or None))
        return 0
    except (InputError, EngineError, ControllerLost, OSError) as error:
        say(f"slurm: error: {error}")
        return 1
    finally:
        folder.close()


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

"""`./sls fuzz`: runs libFuzzer's targets until one crashes."""

import os
import re
import tempfile
from pathlib import Path

from sls.launcher.arguments import Parser, one_of, whole
from sls.launcher.building import call_script, run, run_logged
from sls.launcher.place import ROOT, Failure, list_choices, say

FUZZERS = ("scenario", "faults", "qos_file", "csv", "recording", "samples", "foxglove", "web")
SEEDS = {"scenario": ("config/scenarios", "tests/common/config/invalid_scenarios.txt"),
         "faults": ("config/faults",),
         "qos_file": ("config/qos", "tests/common/bus/invalid_qos_files.txt")}


def fuzz(words: list[str]) -> int:
    parser = Parser("fuzz", "[--seconds N] [--target NAME]",
                    "Feeds mutated input to every reader of files and samples until one crashes.")
    parser.add_argument("--seconds", metavar="N", type=whole(1, 999999), default="60",
                        help="duration of all targets together (default: 60)")
    parser.add_argument("--target", metavar="NAME", type=one_of(*FUZZERS),
                        help=f"run only this target: {list_choices(FUZZERS)}")
    options, _ = parser.parse(words)
    targets = [options.target] if options.target else FUZZERS
    call_script("@setup", "fuzz_packages", "test_packages")
    folder = ROOT / "build-asan"
    call_script("@tree", "asan", folder, "fuzz_seeds", *(f"{target}_fuzzer" for target in targets))
    for target in targets:
        run_fuzzer(folder, target, -(-int(options.seconds) // len(targets)))
    return 0


def run_fuzzer(folder: Path, target: str, seconds: int) -> None:
    """Keeps new inputs in FOLDER/corpus; fails at a crash. 0 s: only the inputs that are there, as a test does."""
    corpus, crashes, log = folder / "corpus" / target, folder / "crashes" / target, folder / f"{target}.log"
    corpus.mkdir(parents=True, exist_ok=True)
    crashes.mkdir(parents=True, exist_ok=True)
    limit = f"-max_total_time={seconds}" if seconds else "-runs=0"
    seeds = [ROOT / seed for seed in SEEDS.get(target, (f"tests/fuzz/corpus/{target}",))]
    for i, table in enumerate(seeds):
        if table.suffix == ".txt":
            seeds[i] = folder / "seeds" / target
            run(folder / "fuzz/fuzz_seeds", table, seeds[i])
    # A target that crashes does not tidy up. Libraries from packages are not instrumented, so overflow
    # checks of containers would give false errors.
    with tempfile.TemporaryDirectory() as scratch:
        is_sound, text = run_logged(
            log, folder / f"fuzz/{target}_fuzzer", corpus, *seeds, limit, "-timeout=10",
            "-rss_limit_mb=1024", "-max_len=33000", f"-artifact_prefix={crashes}/",
            env={**os.environ, "TMPDIR": scratch, "ASAN_OPTIONS": "detect_container_overflow=0"})
    if not is_sound:
        inputs = re.findall(re.escape(f"{crashes}/") + "[^']+", text)
        raise Failure(f"{target}: crashed (log: {log}) with the input {inputs[-1] if inputs else ''}")
    say(f"{target}: {(text.splitlines() or [''])[-1]}")

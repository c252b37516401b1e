"""The progress bar: one line, on a terminal only."""

import sys
import time

from sls.campaign.folder import CampaignFolder

EVERY_S = 0.5
WIDTH = 30


def format_time(seconds: float) -> str:
    seconds = round(seconds)
    if seconds >= 3600:
        return f"{seconds // 3600} h {seconds % 3600 // 60:02d} min"
    return f"{seconds // 60} min {seconds % 60:02d} s" if seconds >= 60 else f"{seconds} s"


class Progress:
    """Runs, rate and time left. Counts whole chunks."""

    def __init__(self, folder: CampaignFolder, missing_chunks: int, is_wanted: bool):
        self.folder = folder
        self.missing = missing_chunks
        plan = folder.plan
        self.all = plan.last - plan.first + 1
        self.done = max(0, self.all - missing_chunks * plan.chunk_runs)
        self.at_begin = self.done
        self.is_drawn = is_wanted and sys.stderr.isatty()
        self.begin = self.drawn = time.monotonic()

    def __enter__(self) -> "Progress":
        return self

    def add(self, chunk: int) -> None:
        first, last = self.folder.find_chunk(chunk)
        self.done = min(self.all, self.done + last - first + 1)

    def until_next_s(self) -> float | None:
        return EVERY_S if self.is_drawn else None

    def draw(self) -> None:
        now = time.monotonic()
        if self.is_drawn and now - self.drawn >= EVERY_S:
            self.drawn = now
            print(f"\r{self.describe(now - self.begin)}\x1b[K", end="", file=sys.stderr, flush=True)

    def describe(self, wall_s: float) -> str:
        bar = "#" * (WIDTH * self.done // self.all)
        rate = (self.done - self.at_begin) / wall_s
        left = f"{format_time((self.all - self.done) / rate)} left" if rate > 0 else ""
        return f"[{bar:<{WIDTH}}] {self.done} of {self.all} runs, {rate:.0f}/s, {left}"

    def __exit__(self, *_: object) -> None:
        if self.is_drawn:
            print("\r\x1b[K", end="", file=sys.stderr, flush=True)

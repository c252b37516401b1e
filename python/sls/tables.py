"""Numbers and tables as text, for pages and for Markdown."""

import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path

from sls.metrics import StageMetrics

AXES = "xyz"


def format_error(metres: float) -> str:
    """A length with three digits: 0.211, 0.0253, 4.10e-04. Lengths below a tenth of a nanometre are not
    printed, because they depend on the rounding of the processor."""
    size = abs(metres)
    if math.isnan(metres):
        return "–"
    if size < 1e-10:
        return "< 1e-10" if size else "0"
    return f"{metres:.2e}" if size < 0.01 else f"{metres:.4f}" if size < 0.1 else f"{metres:.3f}"


def format_settling_time(seconds: float) -> str:
    if math.isnan(seconds):
        return "–"
    return "not settled" if math.isinf(seconds) else f"{seconds:.2f}"


def format_share(share: float) -> str:
    """A share in percent."""
    return "–" if math.isnan(share) else f"{100.0 * share:.2f}"


def list_step_cells(metrics: StageMetrics) -> list[str]:
    """Settling time, overshoot and steady-state error, each for x, y and z."""
    if metrics.step is None:
        return ["–"] * 9
    return [*map(format_settling_time, metrics.step.settling_time_s),
            *map(format_share, metrics.step.overshoot),
            *map(format_error, metrics.step.steady_state_error_m)]


def list_error_cells(metrics: StageMetrics) -> list[str]:
    """rms and max, each for x, y and z."""
    return [*map(format_error, metrics.rms_m), *map(format_error, metrics.max_m)]


def make_markdown_table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [header, ["---"] * len(header), *rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def fill_page(page: Path, values: Mapping[str, str]) -> str:
    """The text of a page with that of `values` after its markers: <!--name-->value<!--/-->, or <!--name--> in the line
    above a table."""
    return re.sub(r"(<!--(\w+)-->\n?)((?<=\n)(?:\|.*\n)*|.*?(?=<!--/-->))", lambda found: found[1] + values[found[2]],
                  page.read_text())

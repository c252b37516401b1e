"""Small pictures as SVG text. The page must stay small, and be equal for equal numbers.

A picture has a size in pixels and, as always in SVG, a y axis that points down. `Scale` converts
values to pixels. Coordinates are written to a tenth of a pixel."""

import html
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

OUTCOME_COLOURS = {"finished": "#0072b2", "lost": "#d55e00", "failed": "#7f7f7f"}
# Colours of the map viridis: equal steps in brightness, distinct with any colour vision; dark means low values.
HEAT = np.array([[68, 1, 84], [71, 44, 122], [59, 81, 139], [44, 113, 142], [33, 144, 141],
                 [39, 173, 129], [92, 200, 99], [170, 220, 50], [253, 231, 37]], dtype=float)
MISSING_COLOUR = "#e4e7eb"


@dataclass(frozen=True)
class Scale:
    """Maps values [low, high] to pixels [first, last], linear or logarithmic."""

    low: float
    high: float
    first: float
    last: float
    is_log: bool = False

    def place(self, value: float) -> float:
        low, high, value = ((math.log10(max(x, 1e-300)) for x in (self.low, self.high, value))
                            if self.is_log else (self.low, self.high, value))
        return self.first + (self.last - self.first) * (value - low) / (high - low)

    def list_ticks(self, most: int = 5) -> list[float]:
        """About `most` round values within the range, or fewer."""
        if self.is_log:
            first, last = math.ceil(math.log10(self.low) - 1e-9), math.floor(
                math.log10(self.high) + 1e-9)
            step = max(1, math.ceil((last - first + 1) / most))
            if last - first >= 1:
                return [10.0**power for power in range(first, last + 1, step)]
        rough = (self.high - self.low) / most
        unit = 10.0 ** math.floor(math.log10(rough))
        step = next(unit * factor for factor in (1, 2, 5, 10) if unit * factor >= rough * 0.999)
        first = math.ceil(self.low / step - 1e-9)
        last = math.floor(self.high / step + 1e-9)
        return [index * step for index in range(first, last + 1)]


def make_scale(values: np.ndarray, first: float, last: float, is_log: bool = False) -> Scale:
    """A scale over all `values`, which are finite. Equal values get some room on both sides."""
    low, high = float(np.min(values)), float(np.max(values))
    if not high > low:
        room = abs(low) * 0.05 or 1.0
        low, high = (low / 1.1, high * 1.1) if is_log else (low - room, high + room)
    return Scale(low, high, first, last, is_log)


def deserves_log(values: np.ndarray) -> bool:
    """True if the values are positive, span more than two decades, and have a median below a fifth of the
    maximum. The median excludes evenly spread numbers that begin near 0."""
    low, middle, high = np.min(values), np.median(values), np.max(values)
    return bool(low > 0.0 and high > 100.0 * low and high > 5.0 * middle)


def px(value: float) -> str:
    text = f"{value:.1f}".removesuffix(".0")
    return "0" if text == "-0" else text


def format_number(value: float) -> str:
    """Four digits; whole numbers below 10^6 in full, with an exponent only if necessary."""
    if value is None or math.isnan(value):
        return "–"
    if math.isinf(value):
        return "∞" if value > 0 else "−∞"
    if value == round(value) and abs(value) < 1e6:
        return f"{value:.0f}".replace("-", "−")
    text = f"{value:.4g}"
    if "e" in text:
        mantissa, power = text.split("e")
        text = f"{mantissa}e{int(power)}"
    return text.replace("-", "−")


def format_share(share: float) -> str:
    """A share in percent."""
    return f"{100.0 * share:.3g} %" if share < 0.9995 else "100 %"


def text(x: float, y: float, content: str, anchor: str = "start", size: float = 11,
         colour: str = "#3c4650", more: str = "") -> str:
    return (f"<text x=\"{px(x)}\" y=\"{px(y)}\" text-anchor=\"{anchor}\" font-size=\"{size:g}\" "
            f"fill=\"{colour}\"{more}>{html.escape(content)}</text>")


def line(x1: float, y1: float, x2: float, y2: float, colour: str = "#b6bec7",
         width: float = 1) -> str:
    return (f"<line x1=\"{px(x1)}\" y1=\"{px(y1)}\" x2=\"{px(x2)}\" y2=\"{px(y2)}\" "
            f"stroke=\"{colour}\" stroke-width=\"{width:g}\"/>")


def box(x: float, y: float, width: float, height: float, colour: str, title: str = "") -> str:
    start = (f"<rect x=\"{px(x)}\" y=\"{px(y)}\" width=\"{px(width)}\" height=\"{px(height)}\" "
             f"fill=\"{colour}\"")
    return f"{start}><title>{html.escape(title)}</title></rect>" if title else f"{start}/>"


def path(points: Sequence[tuple[float, float]], colour: str, width: float = 1.4,
         more: str = "") -> str:
    steps = "L".join(f"{px(x)} {px(y)}" for x, y in points)
    return (f"<path d=\"M{steps}\" fill=\"none\" stroke=\"{colour}\" "
            f"stroke-width=\"{width:g}\"{more}/>")


def wrap(width: float, height: float, parts: Sequence[str], label: str) -> str:
    return (f"<svg viewBox=\"0 0 {px(width)} {px(height)}\" role=\"img\" "
            f"aria-label=\"{html.escape(label)}\" style=\"max-width:{px(width)}px\" "
            f"font-family=\"DejaVu Sans, Helvetica, Arial, sans-serif\">{''.join(parts)}</svg>")


def colour_of_heat(share: float) -> str:
    """The colour at a share, 0 to 1, of the scale."""
    place = min(max(share, 0.0), 1.0) * (len(HEAT) - 1)
    low = min(int(place), len(HEAT) - 2)
    red, green, blue = HEAT[low] + (place - low) * (HEAT[low + 1] - HEAT[low])
    return f"#{round(red):02x}{round(green):02x}{round(blue):02x}"


def draw_x_axis(scale: Scale, bottom: float, label: str, top: float | None = None) -> list[str]:
    parts = [line(scale.first, bottom, scale.last, bottom)]
    for tick in scale.list_ticks():
        x = scale.place(tick)
        if top is not None:
            parts.append(line(x, top, x, bottom, "#eceff2"))
        parts += [line(x, bottom, x, bottom + 4),
                  text(x, bottom + 16, format_number(tick), "middle", 10.5)]
    parts.append(text((scale.first + scale.last) / 2, bottom + 32, label, "middle"))
    return parts


def draw_y_axis(scale: Scale, left: float, label: str, right: float | None = None,
                ticks: Sequence[tuple[float, str]] | None = None) -> list[str]:
    """Draws a y axis. `first` of the scale is the lower end of the axis."""
    parts = [line(left, scale.first, left, scale.last)]
    for tick, name in ticks or [(tick, format_number(tick)) for tick in scale.list_ticks(4)]:
        y = scale.place(tick)
        if right is not None:
            parts.append(line(left, y, right, y, "#eceff2"))
        parts.append(text(left - 5, y + 3.5, name, "end", 10.5))
    middle = (scale.first + scale.last) / 2
    parts.append(text(12, middle, label, "middle",
                      more=f" transform=\"rotate(-90 12 {px(middle)})\""))
    return parts


def draw_distribution(values: np.ndarray, label: str) -> str:
    """A histogram of finite values, and beside it their empirical distribution with at most 400 points."""
    width, height, top, bottom = 760.0, 190.0, 12.0, 150.0
    is_log = deserves_log(values)
    left = make_scale(values, 52, 372, is_log)
    count = int(min(40, max(5, round(2 * len(values) ** (1 / 3)))))  # Rice's rule
    edges = (np.geomspace if is_log else np.linspace)(left.low, left.high, count + 1)
    heights = np.histogram(np.clip(values, left.low, left.high), edges)[0]
    y = Scale(0, max(1, int(heights.max())), bottom, top)
    parts = draw_y_axis(y, 52, "runs", 372) + draw_x_axis(left, bottom, label)
    for low, high, size in zip(edges, edges[1:], heights):
        if size:
            x1, x2 = left.place(low), left.place(high)
            parts.append(box(x1 + 0.4, y.place(size), max(0.6, x2 - x1 - 0.8),
                             bottom - y.place(size), OUTCOME_COLOURS["finished"],
                             f"{format_number(low)} to {format_number(high)}: {size}"))
    right = make_scale(values, 452, 745, is_log)
    share = Scale(0, 1, bottom, top)
    parts += draw_y_axis(share, 452, "", 745, [(i / 4, f"{25 * i} %") for i in range(5)])
    parts += draw_x_axis(right, bottom, label, top)
    ordered = np.sort(values)
    ranks = np.unique(np.linspace(0, len(ordered) - 1, min(len(ordered), 400)).round().astype(int))
    points = [(right.place(float(ordered[0])), share.place(0.0))]
    for rank in ranks:
        x = right.place(float(ordered[rank]))
        points += [(x, points[-1][1]), (x, share.place((rank + 1) / len(ordered)))]
    parts.append(path(points, OUTCOME_COLOURS["finished"]))
    return wrap(width, height, parts, f"distribution of {label}")


def draw_shares(rows: Sequence[tuple[str, float, float, float, str]], label: str) -> str:
    """The share lost, with its interval, over the bins of one key. A row: name, share, low, high, title."""
    width, height, top, bottom = 372.0, 200.0, 12.0, 150.0
    y = Scale(0, 1, bottom, top)
    parts = draw_y_axis(y, 52, "share lost", 362, [(i / 4, f"{25 * i} %") for i in range(5)])
    parts.append(line(52, bottom, 362, bottom))
    step = 310 / len(rows)
    every = math.ceil(max(len(name) for name, *_ in rows) * 6.5 * len(rows) / 310)
    for index, (name, share, low, high, title) in enumerate(rows):
        x = 52 + (index + 0.5) * step
        parts += [line(x, y.place(low), x, y.place(high), "#d55e00"),
                  f"<circle cx=\"{px(x)}\" cy=\"{px(y.place(share))}\" r=\"3\" fill=\"#d55e00\">"
                  f"<title>{html.escape(title)}</title></circle>"]
        if index % every == 0:
            parts.append(text(x, bottom + 16, name, "middle", 10.5))
    parts.append(text(207, bottom + 34, label, "middle"))
    return wrap(width, height, parts, f"share lost over {label}")


def draw_heat(values: np.ndarray, counts: np.ndarray, names: tuple[Sequence[str], Sequence[str]],
              labels: tuple[str, str], title: str, scale: tuple[float, float] | None = None) -> str:
    """A heat map of `values` (rows, columns), NaN if there is none; row 0 is at the bottom. `names` and
    `labels` are those of the columns, then of the rows; `counts` has the number of runs of each field."""
    rows, columns = values.shape
    width, left, right, top, bottom = 440.0, 74.0, 360.0, 28.0, 268.0
    finite = values[np.isfinite(values)]
    is_log = scale is None and len(finite) > 0 and deserves_log(finite)
    if scale is not None:
        bar = Scale(*scale, bottom, top)
    else:
        bar = make_scale(finite if len(finite) else np.array([0.0]), bottom, top, is_log)
    parts = [text(left, 16, title, size=11.5, more=" font-weight=\"600\"")]
    wide, high = (right - left) / columns, (bottom - top) / rows
    for row in range(rows):
        for column in range(columns):
            value = float(values[row, column])
            y = bottom - (row + 1) * high
            colour = (MISSING_COLOUR if not math.isfinite(value)
                      else colour_of_heat((bar.place(value) - bottom) / (top - bottom)))
            parts.append(box(left + column * wide, y, wide + 0.3, high + 0.3, colour,
                             f"{names[0][column]}, {names[1][row]}: {format_number(value)} "
                             f"({counts[row, column]})" if rows * columns <= 900 else ""))
    every = math.ceil(max(map(len, names[0])) * 6.8 * columns / (right - left))
    for column in range(0, columns, every):
        parts.append(text(left + (column + 0.5) * wide, bottom + 15, names[0][column], "middle",
                          10.5))
    for row in range(0, rows, math.ceil(rows * 14 / (bottom - top))):
        parts.append(text(left - 5, bottom - (row + 0.5) * high + 3.5, names[1][row], "end", 10.5))
    parts.append(text((left + right) / 2, bottom + 32, labels[0], "middle"))
    middle = (top + bottom) / 2
    parts.append(text(12, middle, labels[1], "middle",
                      more=f" transform=\"rotate(-90 12 {px(middle)})\""))
    for index in range(32):
        parts.append(box(374, bottom - (index + 1) * (bottom - top) / 32, 14,
                         (bottom - top) / 32 + 0.3, colour_of_heat((index + 0.5) / 32)))
    parts += [text(392, bar.place(tick) + 3.5, format_number(tick), size=10.5)
              for tick in bar.list_ticks()]
    return wrap(width, 310, parts, title)


def draw_parallel(axes: Sequence[tuple[str, np.ndarray, Sequence[str] | None]],
                  colours: Sequence[str]) -> str:
    """Parallel coordinates: one line per run. An axis: label, values, names of the values 0, 1, … or
    None. A line is broken at values that are not finite."""
    top, bottom, step = 44.0, 280.0, max(110.0, min(190.0, 1000.0 / max(1, len(axes) - 1)))
    width = 140 + step * (len(axes) - 1)
    places = []
    parts, marks = [], []
    for index, (label, values, names) in enumerate(axes):
        x = 70 + index * step
        finite = values[np.isfinite(values)]
        if not len(finite):
            finite = np.array([0.0])
        is_log = names is None and deserves_log(finite)
        scale = (Scale(-0.5, len(names) - 0.5, bottom, top) if names
                 else make_scale(finite, bottom, top, is_log))
        places.append([(x, scale.place(value)) if math.isfinite(value) else None
                       for value in map(float, values)])
        marks.append(line(x, top, x, bottom, "#3c4650"))
        ticks = (list(enumerate(names))[:12] if names
                 else [(tick, format_number(tick)) for tick in scale.list_ticks()])
        marks += [text(x + 4, scale.place(tick) + 3.5, name[:18], size=10,
                       more=" stroke=\"#fff\" stroke-width=\"3\" paint-order=\"stroke\"")
                  for tick, name in ticks]
        marks += [text(x, 16 + 12 * (row + 2 - len(words)), word, "middle", 10.5)
                  for words in [split_label(label)] for row, word in enumerate(words)]
    for run, colour in enumerate(colours):
        points: list[tuple[float, float]] = []
        for axis in [*places, None]:
            point = axis[run] if axis is not None else None
            if point is not None:
                points.append(point)
            elif points:
                if len(points) > 1:
                    parts.append(path(points, colour, 0.9, " opacity=\"0.35\""))
                points = []
    return wrap(width, 296, parts + marks, "parallel coordinates")


def split_label(label: str, most: int = 19) -> list[str]:
    """Splits a path or column name into at most two lines."""
    if len(label) <= most:
        return [label]
    cut = max((label.rfind(mark, 0, most) for mark in "._"), default=-1)
    cut = cut + 1 if cut > 0 else most
    rest = label[cut:]
    return [label[:cut], rest if len(rest) <= most + 3 else f"…{rest[-most - 2:]}"]

"""Small pictures as SVG text. The page must stay small, and be equal for equal numbers.

A picture has a size in pixels and, as always in SVG, a y axis that points down. `Scale` converts
values to pixels. Coordinates are written to a tenth of a pixel. Colours in var() are from the page's style sheet."""

import html
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

OUTCOME_COLOURS = {"finished": "#0072b2", "lost": "#d55e00", "failed": "#7f7f7f"}
# Colours of the map viridis: equal steps in brightness, distinct with any colour vision; dark means low values.
HEAT = np.array([[68, 1, 84], [71, 44, 122], [59, 81, 139], [44, 113, 142], [33, 144, 141],
                 [39, 173, 129], [92, 200, 99], [170, 220, 50], [253, 231, 37]], dtype=float)
MISSING_COLOUR, UNFINISHED_COLOUR = "var(--missing)", "var(--axis)"
UNITS = {"_m": "m", "_s": "s", "_n": "N", "_rad": "rad", "_kg": "kg", "_w": "W", "_hz": "Hz", "_m_s": "m/s",
         "_rad_s": "rad/s", "_m_s2": "m/s²"}


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
    if math.isnan(share):
        return "–"
    return f"{100.0 * share:.3g} %" if share < 0.9995 else "100 %"


def name_unit(name: str) -> str:
    """The name of a key or a measure, with the unit that its end tells."""
    ends = [end for end in UNITS if name.endswith(end)]
    return f"{name} ({UNITS[max(ends, key=len)]})" if ends else name


def text(x: float, y: float, content: str, anchor: str = "start", size: float = 11,
         colour: str = "var(--strong)", more: str = "") -> str:
    return (f"<text x=\"{px(x)}\" y=\"{px(y)}\" text-anchor=\"{anchor}\" font-size=\"{size:g}\" "
            f"fill=\"{colour}\"{more}>{html.escape(content)}</text>")


def label_of(x: float, y: float, label: str, room: float, is_upright: bool = False) -> list[str]:
    """The label of an axis, in as many lines as `room` pixels need; upright ones are read from the right."""
    lines = split_label(label, int(room / 6.6))
    return [text(x, y + 12 * (row - is_upright * (len(lines) - 1) / 2), line, "middle",
                 more=f" transform=\"rotate(-90 {px(x)} {px(y)})\"" if is_upright else "")
            for row, line in enumerate(lines)]


def line(x1: float, y1: float, x2: float, y2: float, colour: str = "var(--axis)",
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
            parts.append(line(x, top, x, bottom, "var(--rule)"))
        parts += [line(x, bottom, x, bottom + 4),
                  text(x, bottom + 16, format_number(tick), "middle", 10.5)]
    return parts + label_of((scale.first + scale.last) / 2, bottom + 32, label, scale.last - scale.first)


def draw_y_axis(scale: Scale, left: float, label: str, right: float | None = None,
                ticks: Sequence[tuple[float, str]] | None = None) -> list[str]:
    """Draws a y axis. `first` of the scale is the lower end of the axis."""
    parts = [line(left, scale.first, left, scale.last)]
    for tick, name in ticks or [(tick, format_number(tick)) for tick in scale.list_ticks(4)]:
        y = scale.place(tick)
        if right is not None:
            parts.append(line(left, y, right, y, "var(--rule)"))
        parts.append(text(left - 5, y + 3.5, name, "end", 10.5))
    return parts + label_of(left - 40, (scale.first + scale.last) / 2, label, scale.first - scale.last, True)


def draw_distribution(values: np.ndarray, label: str) -> str:
    """A histogram of finite values, and beside it their empirical distribution with at most 400 points."""
    width, height, top, bottom = 760.0, 204.0, 12.0, 150.0
    is_log = deserves_log(values)
    left = make_scale(values, 52, 372, is_log)
    count = int(min(40, max(5, round(2 * len(values) ** (1 / 3)))))  # Rice's rule
    edges = (np.geomspace if is_log else np.linspace)(left.low, left.high, count + 1)
    heights = np.histogram(np.clip(values, left.low, left.high), edges)[0]
    y = Scale(0, max(1, int(heights.max())), bottom, top)
    whole = [(tick, f"{tick:.0f}") for tick in y.list_ticks(4) if tick == round(tick)]
    parts = draw_y_axis(y, 52, "runs", 372, whole) + draw_x_axis(left, bottom, label)
    for low, high, size in zip(edges, edges[1:], heights):
        if size:
            x1, x2 = left.place(low), left.place(high)
            parts.append(box(x1 + 0.4, y.place(size), max(0.6, x2 - x1 - 0.8),
                             bottom - y.place(size), OUTCOME_COLOURS["finished"],
                             f"{format_number(low)} to {format_number(high)}: {size}"))
    right = make_scale(values, 452, 745, is_log)
    share = Scale(0, 1, bottom, top)
    parts += draw_y_axis(share, 452, "runs up to here", 745, [(i / 4, f"{25 * i} %") for i in range(5)])
    parts += draw_x_axis(right, bottom, label, top)
    ordered = np.sort(values)
    ranks = np.unique(np.linspace(0, len(ordered) - 1, min(len(ordered), 400)).round().astype(int))
    points = [(right.place(float(ordered[0])), share.place(0.0))]
    for rank in ranks:
        x = right.place(float(ordered[rank]))
        points += [(x, points[-1][1]), (x, share.place((rank + 1) / len(ordered)))]
    parts.append(path(points, OUTCOME_COLOURS["finished"]))
    return wrap(width, height, parts, f"distribution of {label}")


def list_class_ticks(names: Sequence[str], scale: Scale | None, first: float, last: float,
                     letter: float = 0.0) -> list[tuple[float, str]]:
    """Place and text of the ticks of classes between the pixels `first` and `last`: round values of the `scale` that
    the classes divide, or else their names: a few shortened, of more as many as fit. `letter`: width of a letter along the
    axis; 0: names stand across the axis."""
    if scale is not None:
        scale = replace(scale, first=first, last=last)
        return [(scale.place(tick), format_number(tick)) for tick in scale.list_ticks()]
    step = (last - first) / len(names)
    most = int(abs(step) / letter) if letter else 99
    every = 1 if len(names) <= 12 else math.ceil(max(14.0, letter * max(map(len, names))) / abs(step))
    return [(first + (index + 0.5) * step, name if every > 1 or len(name) <= most else f"{name[:most - 1]}…")
            for index, name in enumerate(names) if index % every == 0]


def draw_shares(rows: Sequence[tuple[int, float, float, float, str]], names: Sequence[str], scale: Scale | None,
                label: str) -> str:
    """The share lost, with its interval, over the classes of one key. A row: class, share, low, high, title."""
    width, height, top, bottom = 372.0, 212.0, 12.0, 150.0
    y = Scale(0, 1, bottom, top)
    parts = draw_y_axis(y, 52, "share lost", 362, [(i / 4, f"{25 * i} %") for i in range(5)])
    parts.append(line(52, bottom, 362, bottom))
    for place, share, low, high, title in rows:
        x = 52 + (place + 0.5) * 310 / len(names)
        parts += [line(x, y.place(low), x, y.place(high), "#d55e00"),
                  f"<circle cx=\"{px(x)}\" cy=\"{px(y.place(share))}\" r=\"3\" fill=\"#d55e00\">"
                  f"<title>{html.escape(title)}</title></circle>"]
    parts += [text(x, bottom + 16, name, "middle", 10.5)
              for x, name in list_class_ticks(names, scale, 52, 362, 6.5)]
    parts += label_of(207, bottom + 34, label, 310)
    return wrap(width, height, parts, f"share lost over {label}")


def draw_heat(values: np.ndarray, told: Sequence[Sequence[str]], names: tuple[Sequence[str], Sequence[str]],
              scales: tuple[Scale | None, Scale | None], labels: tuple[str, str], title: str, bar_title: str,
              is_share: bool = False) -> str:
    """A heat map of `values` (rows, columns), some of them finite, NaN if there is none; row 0 is at the bottom.
    `names`, `scales` and `labels` are those of the columns, then of the rows; `told` has the outcomes of each field's
    runs as text, "" without runs."""
    rows, columns = values.shape
    width, right, top, bottom = 456.0, 360.0, 28.0, 268.0
    row_ticks = list_class_ticks(names[1], scales[1], bottom, top)
    left = max(74.0, 34 + 6.8 * max(len(name) for _, name in row_ticks))
    finite = values[np.isfinite(values)]
    bar = Scale(0, 1, bottom, top) if is_share else make_scale(finite, bottom, top, deserves_log(finite))
    format_value = format_share if is_share else format_number
    parts = [text(left, 16, title, size=11.5, more=" font-weight=\"600\"")]
    wide, high = (right - left) / columns, (bottom - top) / rows
    for row in range(rows):
        for column in range(columns):
            value = float(values[row, column])
            y = bottom - (row + 1) * high
            runs = told[row][column]
            colour = (MISSING_COLOUR if not runs else UNFINISHED_COLOUR if not math.isfinite(value)
                      else colour_of_heat((bar.place(value) - bottom) / (top - bottom)))
            parts.append(box(left + column * wide, y, wide + 0.3, high + 0.3, colour,
                             f"{names[0][column]}, {names[1][row]}: {format_value(value)} "
                             f"({runs or 'no run'})" if rows * columns <= 900 else ""))
    parts += [text(x, bottom + 15, name, "middle", 10.5)
              for x, name in list_class_ticks(names[0], scales[0], left, right, 6.8)]
    parts += [text(left - 5, y + 3.5, name, "end", 10.5) for y, name in row_ticks]
    below = label_of((left + right) / 2, bottom + 32, labels[0], right - left)
    parts += below + label_of(14, (top + bottom) / 2, labels[1], bottom - top, True)
    parts += label_of(444, (top + bottom) / 2, bar_title, bottom - top, True)
    for index in range(32):
        parts.append(box(374, bottom - (index + 1) * (bottom - top) / 32, 14,
                         (bottom - top) / 32 + 0.3, colour_of_heat((index + 0.5) / 32)))
    parts += [text(392, bar.place(tick) + 3.5, format_value(tick), size=10.5)
              for tick in bar.list_ticks()]
    return wrap(width, 298 + 12 * len(below), parts, title)


def draw_parallel(axes: Sequence[tuple[str, np.ndarray, Sequence[str] | None]],
                  colours: Sequence[str]) -> str:
    """Parallel coordinates: one line per run. An axis: label, values, names of the values 0, 1, … or
    None. A line is broken at values that are not finite; an axis without any is left out."""
    axes = [axis for axis in axes if np.any(np.isfinite(axis[1]))]
    words = [split_label(label) for label, *_ in axes]
    top = 20.0 + 12 * max(map(len, words))
    bottom, step = top + 236.0, max(110.0, min(190.0, 1000.0 / max(1, len(axes) - 1)))
    width = 140 + step * (len(axes) - 1)
    places = []
    parts, marks = [], []
    for index, (_, values, names) in enumerate(axes):
        x = 70 + index * step
        finite = values[np.isfinite(values)]
        is_log = names is None and deserves_log(finite)
        scale = (Scale(-0.5, len(names) - 0.5, bottom, top) if names
                 else make_scale(finite, bottom, top, is_log))
        places.append([(x, scale.place(value)) if math.isfinite(value) else None
                       for value in map(float, values)])
        marks.append(line(x, top, x, bottom, "var(--strong)"))
        ticks = (list(enumerate(names))[:12] if names
                 else [(tick, format_number(tick)) for tick in scale.list_ticks()])
        marks += [text(x + 4, scale.place(tick) + 3.5, name[:18], size=10,
                       more=" stroke=\"var(--panel)\" stroke-width=\"3\" paint-order=\"stroke\"")
                  for tick, name in ticks]
        marks += [text(x, top - 16 + 12 * (row + 1 - len(words[index])), word, "middle", 10.5)
                  for row, word in enumerate(words[index])]
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
    return wrap(width, bottom + 16, parts + marks, "parallel coordinates")


def split_label(label: str, most: int = 19) -> list[str]:
    """Lines of at most `most` characters; a path or column name is split after a mark, if it has one."""
    lines = []
    while len(label) > most:
        cut = max(label.rfind(mark, 0, most) for mark in "._ ") + 1 or most
        lines.append(label[:cut])
        label = label[cut:]
    return [*lines, label]

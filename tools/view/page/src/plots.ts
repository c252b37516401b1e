/** Plots quantities of one vehicle over time. Plots that are folded or out of view are not drawn. */
import uPlot from "uplot";
import { onThemeChange, readTheme, type Theme } from "./colours";
import { make, setText } from "./dom";
import { Samples, thin, thinToGrid } from "./samples";
import { describePlots, type PlotDescription } from "./series";
import type { Mark, Rows, Run, RunIndex } from "./types";

const kPlotHeight = 128;
const kDashes = [[], [7, 3], [2, 2], [9, 3, 2, 3], [], [7, 3], [2, 2], [9, 3, 2, 3]];

interface Panel {
  description: PlotDescription;
  /** Index of its first series in Samples. */
  place: number;
  root: HTMLDetailsElement;
  body: HTMLElement;
  readouts: HTMLElement[];
  plot: uPlot | null;
  isVisible: boolean;
  isStale: boolean;
}

export class Plots {
  private panels: Panel[] = [];
  private samples: [Samples, Samples] = [new Samples([]), new Samples([])];
  private window: number | null = 30;
  private cursor: number | null = null;
  private marks: readonly Mark[] = [];
  private theme: Theme = readTheme();
  private timer = 0;
  private lastDraw = 0;
  private seek: (time: number) => void = () => {};
  private readonly sync = uPlot.sync("time");
  private readonly folded = new Set(["speed"]);
  private readonly watcher = new IntersectionObserver((entries) => this.noteVisible(entries), { rootMargin: "40px" });

  /** `redrawTime`: least time between redraws, ms. */
  constructor(private readonly element: HTMLElement, private readonly redrawTime: number) {
    new ResizeObserver(() => this.resize()).observe(element);
    onThemeChange(() => this.rebuild());
    document.addEventListener("visibilitychange", () => this.schedule());
  }

  setRun(run: Run): void {
    const descriptions = describePlots(run);
    this.samples = [new Samples(descriptions), new Samples(descriptions)];
    this.marks = [];
    for (const { root, plot } of this.panels) {
      this.watcher.unobserve(root);
      plot?.destroy();
    }
    let place = 0;
    this.panels = descriptions.map((description) => {
      const panel = this.makePanel(description, place);
      place += description.series.length;
      return panel;
    });
    this.element.replaceChildren(...this.panels.map(({ root }) => root));
    for (const { root } of this.panels) this.watcher.observe(root);
    this.schedule();
  }

  append(rows: Rows): void {
    this.samples[0].append(rows);
    this.touch();
  }

  /** Sets all rows of a recording at once. */
  replace(rows: Rows, index: RunIndex = 0): void {
    this.samples[index].count = 0;
    this.samples[index].append(rows);
    if (index === 1) this.rebuild(); // now the lines of the second recording are drawn, too
    this.touch();
  }

  /** Of the samples, s. */
  times = (): number[] => Array.from(this.samples[0].time.subarray(0, this.samples[0].count));

  /** Sets the time that the scene shows; null: the newest. */
  setCursor(time: number | null): void {
    this.cursor = time;
    this.touch();
  }

  /** Sets the window in seconds; null: all data. */
  setWindow(seconds: number | null): void {
    this.window = seconds;
    this.touch();
  }

  setMarks(marks: readonly Mark[]): void {
    this.marks = marks;
    this.touch();
  }

  /** `act` is called with the time that was clicked. */
  onSeek(act: (time: number) => void): void {
    this.seek = act;
  }

  private touch(): void {
    for (const panel of this.panels) panel.isStale = true;
    this.schedule();
  }

  private schedule(): void {
    if (this.timer !== 0 || document.hidden) return;
    const wait = Math.max(0, this.lastDraw + this.redrawTime - performance.now());
    this.timer = window.setTimeout(() => {
      this.timer = 0;
      this.lastDraw = performance.now();
      this.redraw();
    }, wait);
  }

  private redraw(): void {
    const [from, to] = this.calcWindow();
    const isEmpty = this.samples.every(({ count }) => count < 2); // a single sample makes no line
    for (const panel of this.panels) {
      if (!panel.isVisible || !panel.root.open || !panel.isStale) continue;
      panel.body.classList.toggle("empty", isEmpty);
      if (isEmpty) {
        this.showReadouts(panel, null);
        continue;
      }
      panel.plot ??= this.makePlot(panel);
      panel.isStale = false;
      panel.plot.batch(() => {
        panel.plot!.setData(this.calcData(panel, from, to), false);
        panel.plot!.setScale("x", { min: from, max: to });
      });
      this.showReadouts(panel, panel.plot.cursor.idx ?? null);
    }
  }

  /** In a recording the window is around the cursor; in a live flight it ends with the newest sample. */
  private calcWindow(): [number, number] {
    const filled = this.samples.filter(({ count }) => count > 0);
    const first = Math.min(...filled.map(({ time }) => time[0]!));
    const last = Math.max(...filled.map(({ time, count }) => time[count - 1]!));
    if (filled.length === 0) return [0, this.window ?? 30];
    if (this.window === null) return [first, Math.max(last, first + 1)];
    if (this.cursor === null) return last - first < this.window ? [first, first + this.window] : [last - this.window, last];
    const from = Math.max(first, Math.min(this.cursor - this.window / 2, last - this.window));
    return [from, from + this.window];
  }

  private calcData(panel: Panel, from: number, to: number): uPlot.AlignedData {
    const count = panel.description.series.length;
    const buckets = Math.max(100, Math.round(panel.body.clientWidth * 0.75));
    if (this.samples[1].count === 0)
      return thin(this.samples[0], panel.place, count, from, to, buckets) as unknown as uPlot.AlignedData;
    const [one, two] = this.samples.map((samples) => {
      const arrays = samples.values.slice(panel.place, panel.place + count);
      return thinToGrid(samples.time, arrays, samples.find(from), samples.find(to), from, to, buckets);
    });
    return [...one!, ...two!.slice(1)] as uPlot.AlignedData;
  }

  private makePanel(description: PlotDescription, place: number): Panel {
    const { key, title, unit, series } = description;
    const readouts = series.map(() => make("span", { class: "legend-value" }));
    const legend = make("span", { class: "legend" }, ...series.map(({ label }, index) =>
      make("span", { class: `legend-item series-${index + 1}` },
        make("i", { class: `key dash-${index % 4}` }), label, readouts[index]!)));
    const summary = make("summary", {},
      make("span", { class: "plot-title" }, title), make("span", { class: "plot-unit" }, unit), legend);
    const body = make("div", { class: "plot-body", role: "img", "aria-label": `${title} by simulated time, in ${unit}` });
    const root = make("details", { class: "plot" }, summary, body);
    root.open = !this.folded.has(key);
    const panel: Panel = { description, place, root, body, readouts, plot: null, isVisible: false, isStale: true };
    root.addEventListener("toggle", () => {
      if (root.open) this.folded.delete(key);
      else this.folded.add(key);
      panel.isStale = true;
      this.schedule();
    });
    return panel;
  }

  private makePlot(panel: Panel): uPlot {
    const { theme } = this;
    const { series } = panel.description;
    const line = (index: number, isSecond: boolean): uPlot.Series => ({
      label: series[index]!.label,
      stroke: theme.series[index] ?? theme.text,
      width: isSecond ? 1 : 1.6,
      alpha: isSecond ? 0.45 : 1,
      dash: kDashes[index] ?? [],
      spanGaps: true,
      points: { show: false },
    });
    const axis = (size: number): uPlot.Axis => ({
      stroke: theme.muted,
      font: "10px system-ui, sans-serif",
      size,
      gap: 3,
      grid: { stroke: theme.plotGrid, width: 1 },
      ticks: { show: false },
    });
    const indices = series.map((_, index) => index);
    const hasSecond = this.samples[1].count > 0;
    return new uPlot(
      {
        width: Math.max(120, panel.body.clientWidth),
        height: kPlotHeight,
        padding: [6, 8, 0, 0],
        legend: { show: false },
        cursor: { sync: { key: this.sync.key, setSeries: false }, drag: { x: false, y: false }, points: { size: 5 }, y: false },
        scales: { x: { time: false, auto: false }, y: { range: calcRange } },
        axes: [{ ...axis(20), values: (_, splits) => splits.map((time) => `${time} s`) }, axis(44)],
        series: [{}, ...indices.map((index) => line(index, false)), ...(hasSecond ? indices.map((index) => line(index, true)) : [])],
        hooks: {
          draw: [(drawn) => this.drawMarks(drawn)],
          setCursor: [(moved) => this.showReadouts(panel, moved.cursor.idx ?? null)],
          ready: [(made) => made.over.addEventListener("click", () => this.seekAt(made))],
        },
      },
      [[], ...indices.map(() => []), ...(hasSecond ? indices.map(() => []) : [])] as unknown as uPlot.AlignedData,
      panel.body,
    );
  }

  private seekAt(plot: uPlot): void {
    const left = plot.cursor.left ?? -1;
    if (left >= 0) this.seek(plot.posToVal(left, "x"));
  }

  /** Shows the values under the pointer, otherwise those at the time shown, or the newest. */
  private showReadouts(panel: Panel, index: number | null): void {
    const { plot } = panel;
    const [samples] = this.samples;
    panel.readouts.forEach((readout, series) => {
      let value: number | null | undefined;
      if (index !== null && plot) value = plot.data[series + 1]?.[index];
      else if (samples.count > 0) {
        const at = this.cursor === null ? samples.count - 1 : Math.min(samples.count - 1, samples.find(this.cursor));
        value = samples.values[panel.place + series]![at];
      }
      setText(readout, value === null || value === undefined || !Number.isFinite(value) ? "–" : format(value));
    });
  }

  private drawMarks(plot: uPlot): void {
    const { ctx: context, bbox } = plot;
    const ratio = devicePixelRatio;
    const line = (time: number, colour: string, dash: number[]) => {
      const x = plot.valToPos(time, "x", true);
      if (x < bbox.left || x > bbox.left + bbox.width) return;
      context.strokeStyle = colour;
      context.setLineDash(dash);
      context.beginPath();
      context.moveTo(x, bbox.top);
      context.lineTo(x, bbox.top + bbox.height);
      context.stroke();
    };
    context.save();
    context.lineWidth = ratio;
    for (const mark of this.marks)
      line(mark.time, mark.kind === "fault" ? this.theme.bad : this.theme.muted, mark.kind === "fault" ? [] : [3 * ratio, 3 * ratio]);
    context.lineWidth = 1.5 * ratio;
    if (this.cursor !== null) line(this.cursor, this.theme.accent, []);
    context.restore();
  }

  private noteVisible(entries: IntersectionObserverEntry[]): void {
    for (const entry of entries) {
      const panel = this.panels.find(({ root }) => root === entry.target);
      if (panel) panel.isVisible = entry.isIntersecting;
    }
    this.schedule();
  }

  private resize(): void {
    for (const panel of this.panels) {
      const width = panel.body.clientWidth;
      if (!panel.plot || width === 0 || width === panel.plot.width) continue;
      panel.plot.setSize({ width, height: kPlotHeight });
      panel.isStale = true;
    }
    this.schedule();
  }

  /** Makes the plots again, because their colours cannot be changed. */
  private rebuild(): void {
    this.theme = readTheme();
    for (const panel of this.panels) {
      panel.plot?.destroy();
      panel.plot = null;
      panel.isStale = true;
    }
    this.schedule();
  }
}

/** Range of an axis: some room around the values. A least size keeps it steady for a nearly constant value. */
function calcRange(_: uPlot, least: number | null, greatest: number | null): uPlot.Range.MinMax {
  if (least === null || greatest === null) return [-1, 1];
  const size = Math.max(greatest - least, 1e-3 * Math.max(Math.abs(least), Math.abs(greatest)), 1e-6);
  return [least - 0.08 * size, greatest + 0.08 * size];
}

function format(value: number): string {
  const size = Math.abs(value);
  const digits = size >= 100 ? 1 : size >= 10 ? 2 : size >= 0.0005 || size === 0 ? 3 : 4;
  return value.toFixed(digits).replace("-", "−");
}

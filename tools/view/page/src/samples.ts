/** The plotted data of one vehicle: numbers over time, in bounded memory. */
import type { PlotDescription } from "./series";
import type { Rows } from "./types";

const kMostSamples = 60_000;

export class Samples {
  time = new Float64Array(1024);
  /** One array for every series of every plot, in their order. */
  values: Float32Array[];
  count = 0;
  private readonly calc: ((row: Float32Array) => number)[];

  constructor(plots: readonly PlotDescription[]) {
    this.calc = plots.flatMap(({ series }) => series.map(({ calc }) => calc));
    this.values = this.calc.map(() => new Float32Array(1024));
  }

  /** Appends rows. If a row is not later than the last one (a reset), discards the samples from its time on. */
  append(rows: Rows): void {
    for (let i = 0; i < rows.time.length; ++i) {
      const time = rows.time[i]!;
      if (this.count > 0 && time <= this.time[this.count - 1]!) this.count = this.find(time);
      if (this.count === this.time.length) this.makeRoom();
      const row = rows.values.subarray(i * rows.columns, (i + 1) * rows.columns);
      this.time[this.count] = time;
      for (let s = 0; s < this.calc.length; ++s) this.values[s]![this.count] = this.calc[s]!(row);
      ++this.count;
    }
  }

  /** Index of the first sample at or after `time`. */
  find(time: number): number {
    return findFirst(this.time, this.count, time);
  }

  /** Grows the memory. At the limit, drops every second sample of the older half. */
  private makeRoom(): void {
    if (this.time.length < kMostSamples) {
      const size = Math.min(kMostSamples, 2 * this.time.length);
      const grow = <A extends Float32Array | Float64Array>(old: A, fresh: A): A => (fresh.set(old), fresh);
      this.time = grow(this.time, new Float64Array(size));
      this.values = this.values.map((old) => grow(old, new Float32Array(size)));
      return;
    }
    const half = this.count >> 1;
    for (const array of [this.time, ...this.values]) {
      let kept = 0;
      for (let i = 0; i < half; i += 2) array[kept++] = array[i]!;
      array.copyWithin(kept, half, this.count);
    }
    this.count -= half >> 1;
  }
}

/** Index of the first of `count` ascending times at or after `time`; `count` if there is none. */
export function findFirst(times: Float64Array, count: number, time: number): number {
  let [low, high] = [0, count];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (times[middle]! < time) low = middle + 1;
    else high = middle;
  }
  return low;
}

/** A window of samples with at most two per bucket (pixel): its least and its greatest value. */
export function thin(samples: Samples, place: number, series: number, from: number, to: number, buckets: number) {
  const first = Math.max(0, samples.find(from) - 1);
  const end = Math.min(samples.count, samples.find(to) + 1);
  const arrays = samples.values.slice(place, place + series);
  if (end - first <= 2 * buckets)
    return [samples.time.subarray(first, end), ...arrays.map((values) => values.subarray(first, end))];
  return thinToGrid(samples.time, arrays, first, end, from, to, buckets);
}

/** Thins onto a time grid that depends on the window only, so that two recordings share it; null: empty bucket. */
export function thinToGrid(
  time: Float64Array, arrays: Float32Array[], first: number, end: number, from: number, to: number, buckets: number,
): [number[], ...(number | null)[][]] {
  const width = (to - from) / buckets;
  // The grid stands still while the window moves: otherwise the picture would flicker.
  const start = Math.floor(from / width);
  const times: number[] = [];
  for (let bucket = 0; bucket <= buckets; ++bucket) times.push((start + bucket) * width, (start + bucket + 0.5) * width);
  const columns = arrays.map((values) => {
    const result: (number | null)[] = new Array(times.length).fill(null);
    let index = first;
    for (let bucket = 0; bucket <= buckets && index < end; ++bucket) {
      const limit = (start + bucket + 1) * width;
      let [least, greatest, leastAt, greatestAt] = [Infinity, -Infinity, -1, -1];
      for (; index < end && time[index]! < limit; ++index) {
        const value = values[index]!;
        if (value < least) [least, leastAt] = [value, index];
        if (value > greatest) [greatest, greatestAt] = [value, index];
      }
      if (leastAt < 0) continue;
      result[2 * bucket] = leastAt <= greatestAt ? least : greatest;
      result[2 * bucket + 1] = leastAt <= greatestAt ? greatest : least;
    }
    return result;
  });
  return [times, ...columns];
}

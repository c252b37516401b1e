/** What a live page has received of a run, so that it can show the flight again once that has ended. */
import { Recording } from "./replay/recording";
import { Columns, type FlightEvent, type Pose, type Rows, type Run, type Status } from "./types";

const kMostNumbers = 8_000_000; // 32 MB

interface Track {
  time: number[];
  rows: Float32Array[];
}

export class History {
  private readonly tracks = new Map<number, Track>();
  private readonly columns: Columns;
  readonly events: FlightEvent[] = [];
  private stages: { vehicle: number; sim_time_s: number; name: string }[] = [];
  private count = 0;

  constructor(readonly run: Run) {
    this.columns = new Columns(run.columns);
  }

  addStage({ stage, sim_time_s }: Status): void {
    if (!stage || stage === this.stages[this.stages.length - 1]?.name) return;
    for (const { id } of this.run.vehicles) this.stages.push({ vehicle: id, sim_time_s, name: stage });
  }

  /** Rows have every column. */
  addRows({ vehicleId, time, values, columns }: Rows): void {
    time.forEach((at, row) => this.add(vehicleId, at, values.slice(row * columns, (row + 1) * columns)));
  }

  /** Poses of the vehicles that are not selected: no rows of these come. */
  addPoses(time: number, poses: readonly Pose[], selected: number): void {
    for (const { vehicleId, quad, attitude, load, reference, cable } of poses) {
      if (vehicleId === selected) continue;
      const row = new Float32Array(this.columns.count).fill(NaN);
      const parts: Record<string, ArrayLike<number>> = { quad_x_m: quad, att_w: attitude, load_x_m: load, ref_x_m: reference };
      if (cable)
        Object.assign(parts, {
          cable_tension_n: [cable.tension], cable_length_m: [cable.length], cable_taut: [Number(cable.isTaut)],
          cable_released: [Number(cable.isReleased)], load_att_w: cable.attitude });
      for (const [name, numbers] of Object.entries(parts))
        if (this.columns.find(name) >= 0) row.set(numbers, this.columns.find(name));
      this.add(vehicleId, time, row);
    }
  }

  /** Adds the rows of the run's recording. The end of a file that is being written may lack answers. */
  addPast(past: Recording): void {
    const isAnswered = (row: Float32Array) => Number.isFinite(row[this.columns.find("ref_x_m")]);
    const toStep = (time: number) => Math.round(time / this.run.period_s);
    for (const { id } of this.run.vehicles) {
      const { time: times = [], rows = [] } = this.tracks.get(id) ?? {};
      const steps = new Map(times.map((time, index) => [toStep(time), { time, row: rows[index]! }]));
      const { time = [], values, columns = 0 } = past.rowsAs(this.columns, id) ?? {};
      time.forEach((at, index) => {
        const row = values!.subarray(index * columns, (index + 1) * columns);
        const received = steps.get(toStep(at))?.row;
        if (!received || isAnswered(row) || !isAnswered(received)) steps.set(toStep(at), { time: at, row });
      });
      const all = [...steps.values()].sort((a, b) => a.time - b.time);
      this.tracks.set(id, { time: all.map(({ time: at }) => at), rows: all.map(({ row }) => row) });
      this.count += (all.length - times.length) * this.columns.count;
    }
    while (this.count > kMostNumbers) this.thin();
    this.stages = [...past.head.stage_starts, ...this.stages.filter(({ sim_time_s }) => sim_time_s > past.to)];
  }

  /** Null if nothing has been received. */
  toRecording(outcome: string, lastStep: number): Recording | null {
    const rows = new Map<number, Rows>();
    let every = 1;
    for (const [vehicleId, track] of this.tracks) {
      const count = Math.max(1, track.time.length - 1);
      every = Math.max(every, Math.round((track.time[count]! - track.time[0]!) / count / this.run.period_s) || 1);
      const values = new Float32Array(track.rows.length * this.columns.count);
      track.rows.forEach((row, index) => values.set(row, index * this.columns.count));
      rows.set(vehicleId, { vehicleId, time: Float64Array.from(track.time), values, columns: this.columns.count });
    }
    if (rows.size === 0) return null;
    const { run, events, stages: stage_starts } = this;
    return new Recording({
      run, events, stage_starts, outcome, every, name: "received", complete: true, faults: [], vehicles: [],
      steps_total: lastStep,
    }, rows);
  }

  private add(vehicleId: number, time: number, row: Float32Array): void {
    const track = this.tracks.get(vehicleId) ?? { time: [], rows: [] };
    this.tracks.set(vehicleId, track);
    if (!(time > (track.time[track.time.length - 1] ?? -1))) return;
    track.time.push(time);
    track.rows.push(row);
    this.count += row.length;
    if (this.count > kMostNumbers) this.thin();
  }

  /** Drops every second row. */
  private thin(): void {
    this.count = 0;
    for (const track of this.tracks.values()) {
      const keep = <Item>(list: Item[]) => list.filter((_, index) => index % 2 === 0);
      [track.time, track.rows] = [keep(track.time), keep(track.rows)];
      this.count += track.rows.length * this.columns.count;
    }
  }
}

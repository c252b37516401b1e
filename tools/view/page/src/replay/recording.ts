/** A recording as sls_view packs it (tools/view/replay/README.md): checks its bytes, gives poses at any time. */
import { Quaternion } from "three";
import { findFirst } from "../samples";
import { Columns, type Cable, type FlightEvent, type Pose, type Rows, type Run } from "../types";

export interface RecordedFault {
  from_s: number;
  to_s: number;
  kind: string;
  /** state or command; empty if it is no fault of the scenario. */
  on: string;
  vehicle: number;
}

export interface RecordedStage {
  vehicle: number;
  sim_time_s: number;
  name: string;
}

export interface Head {
  run: Run;
  name: string;
  complete: boolean;
  outcome: string;
  every: number;
  steps_total: number;
  events: Omit<FlightEvent, "run_id">[];
  faults: RecordedFault[];
  stage_starts: RecordedStage[];
  vehicles: { id: number; rows: number }[];
}

const kMagic = "SLSVIEW1";
const kMostColumns = 256;
const kMostVehicles = 256;

function expect(condition: boolean, what: string): asserts condition {
  if (!condition) throw new Error(`expected ${what}`);
}

const isNumber = (value: unknown): value is number => typeof value === "number" && Number.isFinite(value);
const isCount = (value: unknown): value is number => isNumber(value) && Number.isInteger(value) && value >= 0;

function checkHead(value: unknown): Head {
  expect(typeof value === "object" && value !== null, "a JSON object at the beginning");
  const head = value as Head;
  const { run } = head;
  expect(typeof run === "object" && run !== null, "'run'");
  expect(Array.isArray(run.columns) && run.columns.length <= kMostColumns, `at most ${kMostColumns} columns`);
  expect(run.columns.every((column) => typeof column?.name === "string"), "columns with names");
  expect(Array.isArray(run.vehicles) && Array.isArray(run.stages) && Array.isArray(run.path_m), "a run with vehicles");
  expect(isNumber(run.period_s) && run.period_s > 0, "a period above 0");
  expect(isCount(head.every) && head.every > 0, "'every' above 0");
  expect(Array.isArray(head.vehicles) && head.vehicles.length <= kMostVehicles, `at most ${kMostVehicles} vehicles`);
  expect(head.vehicles.every((vehicle) => isCount(vehicle?.id) && isCount(vehicle?.rows)), "vehicles with rows");
  return {
    ...head,
    name: String(head.name ?? "recording"),
    outcome: String(head.outcome ?? ""),
    complete: head.complete === true,
    events: keepGood(head.events, (event) => isNumber(event.sim_time_s) && typeof event.text === "string"),
    faults: keepGood(head.faults, (fault) => isNumber(fault.from_s) && isNumber(fault.to_s)),
    stage_starts: keepGood(head.stage_starts, (stage) => isNumber(stage.sim_time_s)),
  };
}

function keepGood<Item extends object>(list: Item[] | undefined, isGood: (item: Item) => boolean): Item[] {
  return Array.isArray(list) ? list.filter((item) => typeof item === "object" && item !== null && isGood(item)) : [];
}

/** @throws Error that names the defect of the bytes. */
export function parseRecording(bytes: ArrayBuffer): Recording {
  expect(bytes.byteLength >= 12, `a recording, got ${bytes.byteLength} bytes`);
  const text = new TextDecoder();
  const magic = text.decode(new Uint8Array(bytes, 0, 8));
  expect(magic === kMagic, `the first bytes ${kMagic}, got another format`);
  const length = new DataView(bytes).getUint32(8, true);
  expect(12 + length <= bytes.byteLength, `${length} bytes of JSON, got ${bytes.byteLength - 12}`);
  const head = checkHead(JSON.parse(text.decode(new Uint8Array(bytes, 12, length))));
  const columns = head.run.columns.length;
  const rows = new Map<number, Rows>();
  let at = 12 + length;
  for (const { id, rows: count } of head.vehicles) {
    const size = count * (8 + 4 * columns);
    expect(at + size <= bytes.byteLength, `${size} bytes of vehicle ${id}, got ${bytes.byteLength - at}`);
    // Copied, because the times of a second vehicle may begin at any multiple of 4 bytes.
    const time = new Float64Array(bytes.slice(at, at + 8 * count));
    const values = new Float32Array(bytes.slice(at + 8 * count, at + size));
    expect(time.every((at, row) => at > (row ? time[row - 1]! : -1)), `ascending times of vehicle ${id}`);
    rows.set(id, { vehicleId: id, time, values, columns });
    at += size;
  }
  expect(at === bytes.byteLength, `${at} bytes, got ${bytes.byteLength}`);
  return new Recording(head, rows);
}

export class Recording {
  readonly run: Run;
  readonly columns: Columns;
  readonly vehicleIds: number[];
  /** Simulated time of the first and last row, s. */
  readonly from: number;
  readonly to: number;
  /** Time between two kept rows, s. */
  readonly spacing: number;
  private readonly places: Record<"quad" | "quadV" | "load" | "loadV" | "attitude" | "reference", number>;
  private readonly rotors: number[];
  /** Places of the columns of a cable; those that there are not have -1. */
  private readonly cable: Record<"tension" | "length" | "taut" | "attitude" | "released", number> | null;

  constructor(
    readonly head: Head,
    private readonly rows: ReadonlyMap<number, Rows>,
  ) {
    this.run = head.run;
    this.columns = new Columns(head.run.columns);
    this.vehicleIds = [...rows.keys()].filter((id) => rows.get(id)!.time.length > 0);
    expect(this.vehicleIds.length > 0, "rows of at least one vehicle");
    const all = this.vehicleIds.map((id) => rows.get(id)!.time);
    this.from = Math.min(...all.map((time) => time[0]!));
    this.to = Math.max(...all.map((time) => time[time.length - 1]!));
    this.spacing = head.every * head.run.period_s;
    const find = (name: string) => {
      const place = this.columns.find(name);
      expect(place >= 0, `a column ${name}`);
      return place;
    };
    this.places = {
      quad: find("quad_x_m"),
      quadV: find("quad_vx_m_s"),
      load: find("load_x_m"),
      loadV: find("load_vx_m_s"),
      attitude: find("att_w"),
      reference: find("ref_x_m"),
    };
    const [tension, length, taut, attitude, released] = ["cable_tension_n", "cable_length_m", "cable_taut", "load_att_w",
      "cable_released"].map((name) => this.columns.find(name)) as [number, number, number, number, number];
    this.cable = head.run.load ? { tension, length, taut, attitude, released } : null;
    this.rotors = head.run.columns.flatMap(({ name }, place) => (/^rotor_\d+_rad_s$/.test(name) ? [place] : []));
  }

  rowsOf(vehicleId: number): Rows | undefined {
    return this.rows.get(vehicleId);
  }

  /** The rows of a vehicle with the columns of another recording; NaN in columns that this one does not have. */
  rowsAs(columns: Columns, vehicleId: number): Rows | undefined {
    const rows = this.rows.get(vehicleId);
    const isSame = columns.count === this.columns.count &&
      columns.list.every(({ name }, place) => this.columns.find(name) === place);
    if (!rows || isSame) return rows;
    const places = columns.list.map(({ name }) => this.columns.find(name));
    const values = new Float32Array(rows.time.length * columns.count).fill(NaN);
    for (let row = 0; row < rows.time.length; ++row)
      places.forEach((place, column) => {
        if (place >= 0) values[row * columns.count + column] = rows.values[row * rows.columns + place]!;
      });
    return { vehicleId, time: rows.time, values, columns: columns.count };
  }

  /** Poses of all vehicles at `time`; before the first and after the last row of a vehicle, the pose of that row. */
  posesAt(time: number): Pose[] {
    return this.vehicleIds.map((id) => this.poseAt(id, time));
  }

  poseAt(vehicleId: number, time: number): Pose {
    const rows = this.rows.get(vehicleId)!;
    const before = findRow(rows.time, time);
    const after = Math.min(before + 1, rows.time.length - 1);
    const span = rows.time[after]! - rows.time[before]!;
    // A larger distance between two rows shows missing rows: the vehicle then stays at its last position.
    const isGap = span > 1.5 * this.spacing + 1e-9;
    const u = span > 0 && !isGap ? Math.min(1, Math.max(0, (time - rows.time[before]!) / span)) : 0;
    const [a, b] = [before * rows.columns, after * rows.columns];
    const { quad, quadV, load, loadV, attitude, reference } = this.places;
    const { values } = rows;
    return {
      vehicleId,
      quad: calcBetween(values, a, b, quad, quadV, u, span),
      load: calcBetween(values, a, b, load, loadV, u, span),
      cable: this.findCable(values, a, b, u),
      attitude: calcAttitude(values, a + attitude, b + attitude, u),
      reference: [0, 1, 2].map((axis) => mix(values[a + reference + axis]!, values[b + reference + axis]!, u)),
      rotorRate: this.calcRotorRate(values, a),
    };
  }

  /** Name of the stage that the vehicle flies at `time`. */
  stageAt(vehicleId: number, time: number): string {
    let name = "";
    for (const stage of this.head.stage_starts)
      if (stage.vehicle === vehicleId && stage.sim_time_s <= time + 1e-9) name = stage.name;
    return name;
  }

  private findCable(values: Float32Array, a: number, b: number, u: number): Cable | null {
    if (!this.cable || this.cable.tension < 0) return null;
    const { tension, length, taut, attitude, released } = this.cable;
    return {
      tension: mix(values[a + tension]!, values[b + tension]!, u),
      length: mix(values[a + length]!, values[b + length]!, u),
      isTaut: values[a + taut] === 1,
      isReleased: released >= 0 && values[a + released] === 1,
      attitude: calcAttitude(values, a + attitude, b + attitude, u),
    };
  }

  private calcRotorRate(values: Float32Array, row: number): number {
    if (this.rotors.length === 0) return NaN;
    return this.rotors.reduce((sum, place) => sum + values[row + place]!, 0) / this.rotors.length;
  }
}

/** Index of the last row at or before `time`; 0 if there is none. */
export function findRow(times: Float64Array, time: number): number {
  return Math.max(0, findFirst(times, times.length, time + 1e-9) - 1);
}

export function distance(a: ArrayLike<number>, b: ArrayLike<number>): number {
  return Math.hypot(a[0]! - b[0]!, a[1]! - b[1]!, a[2]! - b[2]!);
}

const mix = (a: number, b: number, u: number) => (u === 0 || !Number.isFinite(b) ? a : a + (b - a) * u);

/** Position between two kept steps: the cubic with both positions and both velocities. */
function calcBetween(
  values: Float32Array, a: number, b: number, position: number, velocity: number, u: number, span: number,
): number[] {
  return [0, 1, 2].map((axis) => {
    const [p, q] = [values[a + position + axis]!, values[b + position + axis]!];
    const [v, w] = [values[a + velocity + axis]! * span, values[b + velocity + axis]! * span];
    if (u === 0) return p;
    if (!Number.isFinite(v + w)) return mix(p, q, u);
    const r = 1 - u;
    return p * r * r * (1 + 2 * u) + v * u * r * r + q * u * u * (3 - 2 * u) - w * u * u * r;
  });
}

/** Attitude between two attitudes w, x, y, z along the shorter way; level if there is none. */
function calcAttitude(values: Float32Array, a: number, b: number, u: number): number[] {
  const [from, to] = [values.subarray(a, a + 4), values.subarray(b, b + 4)];
  if (!from.every(Number.isFinite)) return [1, 0, 0, 0];
  if (u === 0 || !to.every(Number.isFinite)) return [...from];
  const [one, other] = [from, to].map(([w, x, y, z]) => new Quaternion(x, y, z, w));
  const { w, x, y, z } = one!.slerp(other!, u);
  return [w, x, y, z];
}

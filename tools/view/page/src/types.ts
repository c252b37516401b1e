/** The page's data. Everything is in frame W (z down), SI units and radians, until frames.ts turns it for drawing. */

export type Vector3 = readonly [number, number, number];

export interface Rotor {
  /** In the body frame (z down), from the centre of mass. */
  position_m: Vector3;
  /** +1 or −1: sense of rotation. */
  spin: number;
}

export interface Vehicle {
  id: number;
  load_mass_kg: number;
  rod_length_m: number;
  /** Attachment of the rod, in the body frame. */
  attachment_m: Vector3;
  rotors: Rotor[];
}

export interface Column {
  name: string;
  unit: string;
}

/** One load that all vehicles carry by cables; scene::LoadScene. Vectors in the load, z down. */
export interface SharedLoad {
  /** Of each vehicle's cable, by id. */
  attachments_m: Record<string, Vector3>;
  /** Corners of a rigid load, in turn around it; none: a point. */
  outline_m: Vector3[];
  /** From this tension on a cable has the colour `high`. */
  full_tension_n: number;
  ground_z_m: number | null;
  /** Red, green, blue, 0 to 1; `low`: taut without tension. */
  colours: Record<"slack" | "low" | "high", Vector3>;
}

/** Description of the run: describe_run of tools/view/run_description.hpp. */
export interface Run {
  /** 16 hex digits. */
  run_id: string;
  scenario: string;
  mode: string;
  period_s: number;
  /** Target; 0 in lockstep. */
  real_time_factor: number;
  has_attitude: boolean;
  vehicles: Vehicle[];
  /** kColumns, then the plant's signals. */
  columns: Column[];
  stages: string[];
  /** Missing or null: each vehicle has its own load on a rod. */
  load?: SharedLoad | null;
  /** Planned path of the one load, or of the load of vehicle 0. */
  path_m: Vector3[];
}

/** Indices of the columns of rows. */
export class Columns {
  readonly count: number;
  private readonly places = new Map<string, number>();

  constructor(readonly list: readonly Column[]) {
    this.count = list.length;
    list.forEach((column, index) => this.places.set(column.name, index));
  }

  /** Index of the column, or −1. */
  find(name: string): number {
    return this.places.get(name) ?? -1;
  }
}

/** The cable of one vehicle at one step, and the load at its end. */
export interface Cable {
  tension: number;
  length: number;
  isTaut: boolean;
  isReleased: boolean;
  /** Of the load: w, x, y, z. */
  attitude: ArrayLike<number>;
}

/** One vehicle at one step. Copy it to keep it: the arrays may be reused for the next step. */
export interface Pose {
  vehicleId: number;
  /** Position of the quadrotor, m. */
  quad: ArrayLike<number>;
  /** w, x, y, z. */
  attitude: ArrayLike<number>;
  /** Of the load; with a cable that of the cable's end. */
  load: ArrayLike<number>;
  /** Null: a rod. */
  cable: Cable | null;
  /** Desired position of the load; NaN if there is none. */
  reference: ArrayLike<number>;
  /** Mean, rad/s; NaN if there is none. */
  rotorRate: number;
}

/** Past positions of a vehicle: x, y, z of each point one after another; both arrays have the same length. */
export interface Trail {
  quad: ArrayLike<number>;
  load: ArrayLike<number>;
}

/** Consecutive rows of one vehicle; `values` holds `time.length` × `columns` numbers, row by row. */
export interface Rows {
  vehicleId: number;
  /** Simulated time, s, ascending. */
  time: Float64Array;
  values: Float32Array;
  columns: number;
}

export interface Participant {
  role: string;
  name: string;
  host: string;
  ready: boolean;
  done: boolean;
  /** Recorder: it has all rows up to this step; −1: none. */
  last_complete_step: number;
}

/** Message "status" of the protocol. */
export interface Status {
  run_id: string;
  /** waiting, running, paused, finished, failed, reset */
  phase: string;
  reason: string;
  step: number;
  sim_time_s: number;
  controller: string;
  real_time_factor: number;
  round_trip_p50_us: number;
  round_trip_p99_us: number;
  timing: string;
  problem: string;
  counters: Record<string, number>;
  is_silent: boolean;
  silence_s: number;
  waiting_for: string | string[];
  participants: Participant[];
  /** Stage that the vehicle of the lowest id flies; empty before the first answer. */
  stage: string;
}

export interface FlightEvent {
  run_id: string;
  step: number;
  sim_time_s: number;
  text: string;
}

/** A mark at a time, shown by plots and slider. */
export interface Mark {
  time: number;
  text: string;
  kind: "event" | "fault" | "stage";
}

export interface Hello {
  may_operate: boolean;
  why_not: string;
  needs_token: boolean;
}

export interface Reply {
  id: number;
  action: string;
  accepted: boolean;
  reason: string;
  step: number;
}

export interface NoRun {
  text: string;
  command: string;
}

export type Action = "start" | "pause" | "step" | "resume" | "reset" | "stop";

/** `free`: the camera stays where it was put; `follow`: goes with the selected vehicle. */
export type CameraMode = "free" | "follow" | "top" | "side";

/** 0: the flight or recording; 1: a second recording laid over it, drawn translucent. */
export type RunIndex = 0 | 1;

/** The data block `sls-mode` of the page: it selects what the page shows. */
export interface PageMode {
  mode: "live" | "replay" | "embedded";
  /** Addresses, or `#id` of data blocks. */
  recordings?: string[];
}

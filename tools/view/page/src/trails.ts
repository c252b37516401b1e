/** Trails of quadrotors and loads: one buffer of line segments for all vehicles, of bounded length. */
import { BufferAttribute, BufferGeometry, Color, DynamicDrawUsage, LineBasicMaterial, LineSegments, Vector3 } from "three";
import { findLoad, hasLoad } from "./cables";
import { kLoadColour, kQuadColour } from "./colours";
import { toScene } from "./frames";
import type { Pose, Run, RunIndex, Trail } from "./types";

const kMostSegments = 12_000; // of all vehicles and both trails: software then draws 20 frames a second
const kMostSlots = 1_500; // of one vehicle
const kFloats = 12; // of one vehicle in one slot: two trails × two ends × xyz

export class Trails {
  readonly lines: LineSegments;
  private readonly positions: BufferAttribute;
  private readonly slots: number;
  private readonly places = new Map<number, number>();
  private readonly last: Float32Array; // quad xyz, load xyz of each vehicle
  private readonly spacing: number;
  private next = 0;
  private filled = 0; // slots that have ever been written
  private lastTime = NaN;

  constructor(
    private readonly run: Run,
    index: RunIndex,
  ) {
    const count = Math.max(1, run.vehicles.length);
    run.vehicles.forEach(({ id }, place) => this.places.set(id, place));
    this.slots = Math.min(kMostSlots, Math.max(60, Math.floor(kMostSegments / 2 / count)));
    this.spacing = count > 10 ? 0.1 : 0.04;
    this.last = new Float32Array(6 * count);
    const geometry = new BufferGeometry();
    this.positions = new BufferAttribute(new Float32Array(this.slots * count * kFloats), 3);
    this.positions.setUsage(DynamicDrawUsage);
    geometry.setAttribute("position", this.positions);
    geometry.setAttribute("color", this.makeColours(count));
    const opacity = index === 1 ? 0.3 : 0.75;
    const material = new LineBasicMaterial({ vertexColors: true, transparent: true, opacity, toneMapped: false });
    this.lines = new LineSegments(geometry, material);
    this.lines.frustumCulled = false;
    this.lines.renderOrder = 2;
  }

  /** Adds a segment to every trail once enough simulated time has passed. */
  extend(simTime: number, poses: readonly Pose[]): void {
    const passed = simTime - this.lastTime;
    if (passed >= 0 && passed < this.spacing) return;
    const isJump = !(passed >= 0 && passed < Math.max(1, 20 * this.spacing));
    this.lastTime = simTime;
    const count = this.places.size;
    const start = this.next * count * kFloats;
    const values = this.positions.array as Float32Array;
    values.fill(0, start, start + count * kFloats);
    for (const pose of poses) {
      const place = this.places.get(pose.vehicleId);
      if (place === undefined) continue;
      const end = this.last.subarray(6 * place, 6 * place + 6);
      const at = start + place * kFloats;
      toScene(pose.quad, point);
      write(values, at, end, 0, isJump || this.next % 2 === 1); // the quadrotor's trail is dotted
      toScene(findLoad(pose, this.run), point);
      write(values, at + 6, end, 3, isJump || !hasLoad(this.run, place));
    }
    this.filled = Math.max(this.filled, this.next + 1);
    this.lines.geometry.setDrawRange(0, (this.filled * count * kFloats) / 3);
    this.next = (this.next + 1) % this.slots;
    this.positions.addUpdateRange(start, count * kFloats);
    this.positions.needsUpdate = true;
  }

  /** Replaces the trail of one vehicle by the last points of `trail`. */
  replace(vehicleId: number, trail: Trail): void {
    const place = this.places.get(vehicleId);
    if (place === undefined) return;
    const values = this.positions.array as Float32Array;
    const count = this.places.size;
    const points = Math.floor(Math.min(trail.quad.length, trail.load.length) / 3);
    const first = Math.max(0, points - 1 - this.slots);
    const end = new Float32Array(6);
    for (let slot = 0; slot < this.slots; ++slot) {
      const at = (slot * count + place) * kFloats;
      const from = first + slot;
      if (from + 1 >= points) {
        values.fill(0, at, at + kFloats);
        continue;
      }
      for (const [offset, source] of [[0, trail.quad], [3, trail.load]] as const) {
        toScene([source[3 * from]!, source[3 * from + 1]!, source[3 * from + 2]!], point).toArray(end, offset);
        toScene([source[3 * from + 3]!, source[3 * from + 4]!, source[3 * from + 5]!], point);
        const isGap = offset === 0 ? slot % 2 === 1 : !hasLoad(this.run, place);
        write(values, at + 2 * offset, end, offset, isGap);
      }
    }
    this.positions.clearUpdateRanges();
    this.positions.needsUpdate = true;
    this.filled = this.slots;
    this.next = Math.max(0, Math.min(points - 1, this.slots)) % this.slots;
    this.lines.geometry.setDrawRange(0, Infinity);
    this.lastTime = NaN;
  }

  reset(): void {
    (this.positions.array as Float32Array).fill(0);
    this.positions.clearUpdateRanges();
    this.positions.needsUpdate = true;
    this.next = 0;
    this.filled = 0;
    this.lines.geometry.setDrawRange(0, 0);
    this.lastTime = NaN;
  }

  dispose(): void {
    this.lines.geometry.dispose();
    (this.lines.material as LineBasicMaterial).dispose();
    this.lines.removeFromParent();
  }

  private makeColours(count: number): BufferAttribute {
    const colours = [kQuadColour, kQuadColour, kLoadColour, kLoadColour].map((hex) => new Color(hex));
    const values = new Uint8Array(this.slots * count * kFloats);
    for (let i = 0; i < values.length; i += 3) {
      const { r, g, b } = colours[(i / 3) % 4]!;
      values.set([255 * r, 255 * g, 255 * b], i);
    }
    return new BufferAttribute(values, 3, true);
  }
}

const point = new Vector3();

/** Writes the segment from `end` to `point`, or none for a gap, and moves `end` to `point`. */
function write(values: Float32Array, at: number, end: Float32Array, offset: number, isGap: boolean): void {
  if (isGap) {
    values.fill(0, at, at + 6);
  } else {
    for (let axis = 0; axis < 3; ++axis) values[at + axis] = end[offset + axis]!;
    point.toArray(values, at + 3);
  }
  point.toArray(end, offset);
}

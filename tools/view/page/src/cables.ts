/** One load on cables (scene::LoadScene of common/scene): where it is, and how its cables hang. */
import { Color, Quaternion, SRGBColorSpace, Vector3 } from "three";
import type { Cable, Pose, Run, SharedLoad } from "./types";

/** Parts of a cable that hangs; its lowest point is the end of one of them. */
export const kCableParts = 24;
const kLeastWidth = 1e-3; // of the length: narrower ones are drawn like this

/** True if vehicle number `place` of the run has a load to draw: of one load on cables the first alone. */
export const hasLoad = (run: Run, place: number): boolean => !run.load || place === 0;

/** Position in W of the load: of one load on cables its centre, else the vehicle's own. */
export function findLoad(pose: Pose, run: Run): ArrayLike<number> {
  const attachment = run.load?.attachments_m[pose.vehicleId];
  if (!attachment || !pose.cable) return pose.load;
  const [w, x, y, z] = Array.from(pose.cable.attitude) as [number, number, number, number];
  const offset = new Vector3(...attachment).applyQuaternion(new Quaternion(x, y, z, w));
  return [pose.load[0]! - offset.x, pose.load[1]! - offset.y, pose.load[2]! - offset.z];
}

/** Points of a cable in scene coordinates: none if it is cut, both ends if it is taut, else as it hangs or lies. */
export function calcCablePoints(load: SharedLoad, cable: Cable, vehicle: Vector3, end: Vector3): Vector3[] {
  if (cable.isReleased) return [];
  if (cable.isTaut) return [vehicle, end];
  const points = calcHangingPoints(vehicle, end, cable.length);
  const ground = load.ground_z_m;
  if (ground !== null) for (const point of points) point.z = Math.max(point.z, -ground);
  return points;
}

/** The catenary of scene::calc_hanging_points, whose formulas common/scene/load_scene.cpp derives; z is up. */
export function calcHangingPoints(from: Vector3, to: Vector3, length: number): Vector3[] {
  const along = new Vector3().subVectors(to, from);
  const width = Math.max(Math.hypot(along.x, along.y), kLeastWidth * length);
  const ratio = Math.sqrt(Math.max(length * length - along.z * along.z, 0)) / width;
  if (!(ratio > 1 + 1e-9)) return [from.clone(), to.clone()];
  const a = (0.5 * width) / invertSinhRatio(ratio);
  const x0 = 0.5 * width - a * Math.atanh(along.z / length);
  const s0 = -a * Math.sinh(x0 / a);
  const place = (-s0 / length) * kCableParts; // of the lowest point: the point next to it is moved there
  const lowest = place > 0 && place < kCableParts ? Math.min(Math.max(Math.round(place), 1), kCableParts - 1) : 0;
  const points = [from.clone()];
  for (let i = 1; i < kCableParts; ++i) {
    const s = i === lowest ? 0 : s0 + (length * i) / kCableParts;
    const part = (x0 + a * Math.asinh(s / a)) / width;
    points.push(new Vector3(from.x + part * along.x, from.y + part * along.y,
      from.z + Math.hypot(a, s) - Math.hypot(a, s0)));
  }
  points.push(to.clone());
  return points;
}

/** x > 0 with sinh(x) / x = ratio, for ratio > 1. */
function invertSinhRatio(ratio: number): number {
  let x = ratio < 3 ? Math.sqrt(6 * (ratio - 1)) : Math.log(2 * ratio) + 1.2 * Math.log(Math.log(2 * ratio));
  for (let i = 0; i < 20; ++i) x -= (Math.sinh(x) - ratio * x) / Math.max(Math.cosh(x) - ratio, 1e-300);
  return x;
}

export function calcColour({ colours, full_tension_n }: SharedLoad, cable: Cable, result: Color): Color {
  if (!cable.isTaut) return result.setRGB(...colours.slack, SRGBColorSpace);
  const part = Math.min(1, Math.max(0, cable.tension / full_tension_n));
  const mix = (i: 0 | 1 | 2) => colours.low[i] + part * (colours.high[i] - colours.low[i]);
  return result.setRGB(mix(0), mix(1), mix(2), SRGBColorSpace);
}

/** "1.25 N", "slack" or "cut". */
export function describeCable({ isReleased, isTaut, tension }: Cable): string {
  if (isReleased) return "cut";
  return isTaut ? `${tension.toFixed(2)} N` : "slack";
}

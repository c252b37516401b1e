/** Two recordings of the same scenario, side by side in time. */
import { distance, type Recording } from "./recording";

const kMostSamples = 4000;

/** Largest distance between the loads of one vehicle in two recordings, m, and when. */
export function findLargestDistance(a: Recording, b: Recording, vehicleId: number): { distance: number; time: number } {
  const none = { distance: NaN, time: NaN };
  const rows = a.rowsOf(vehicleId);
  if (!rows || !b.rowsOf(vehicleId)) return none;
  const stride = Math.max(1, Math.ceil(rows.time.length / kMostSamples));
  let largest = none;
  for (let i = 0; i < rows.time.length; i += stride) {
    const time = rows.time[i]!;
    if (time < b.from || time > b.to) continue;
    const apart = distance(a.poseAt(vehicleId, time).load, b.poseAt(vehicleId, time).load);
    if (!(apart <= largest.distance)) largest = { distance: apart, time };
  }
  return largest;
}

/** "0.0123 m", or "–" where there is none. */
export function formatMetres(length: number): string {
  return Number.isFinite(length) ? `${length.toPrecision(3)} m` : "–";
}

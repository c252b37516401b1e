/** Only this file converts frame W (x forward, y right, z down) into the scene's (x forward, y left, z up). */
import type { Quaternion, Vector3 } from "three";

/** Converts a position in W, or a vector in the body frame: half a turn about x. */
export function toScene(point: ArrayLike<number>, result: Vector3): Vector3 {
  return result.set(point[0]!, -point[1]!, -point[2]!);
}

/** Converts an attitude w, x, y, z of the body frame in W; both frames have z down. */
export function toSceneRotation(attitude: ArrayLike<number>, result: Quaternion): Quaternion {
  const [w, x, y, z] = [attitude[0]!, attitude[1]!, attitude[2]!, attitude[3]!];
  if (!Number.isFinite(w + x + y + z)) return result.identity();
  return result.set(x, -y, -z, w).normalize();
}

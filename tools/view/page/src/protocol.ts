/** Binary messages of subprotocol sls.view.1 (tools/view/README.md), little-endian. */
import type { Cable, Pose, Rows } from "./types";

const kPoseBytes = 64;
const kCableBytes = 32; // more of each pose, of a run with one load on cables
const kPosesHeader = 40;
const kRowsHeader = 24;

export interface Poses {
  runId: string;
  step: number;
  simTime: number;
  /** Wall clock of the server, ms since 1970. */
  publishedMs: number;
  poses: Pose[];
}

export interface RunRows extends Rows {
  runId: string;
}

const toHex = (id: bigint) => id.toString(16).padStart(16, "0");

/** 1: poses, 2: rows. */
export function readKind(message: ArrayBuffer): number {
  return message.byteLength < 4 ? 0 : new DataView(message).getUint32(0, true);
}

/** @throws Error if the length does not fit the count. */
export function readPoses(message: ArrayBuffer): Poses {
  const view = new DataView(message);
  const count = view.getUint32(4, true);
  const hasCables = message.byteLength === kPosesHeader + count * (kPoseBytes + kCableBytes);
  const size = kPoseBytes + (hasCables ? kCableBytes : 0);
  if (message.byteLength !== kPosesHeader + count * size)
    throw new Error(`poses: expected ${kPosesHeader + count * size} bytes, got ${message.byteLength}`);
  const poses: Pose[] = new Array(count);
  for (let i = 0; i < count; ++i) {
    const at = kPosesHeader + i * size;
    const numbers = new Float32Array(message, at + 8, size / 4 - 2);
    poses[i] = {
      vehicleId: view.getUint32(at, true),
      quad: numbers.subarray(0, 3),
      attitude: numbers.subarray(3, 7),
      load: numbers.subarray(7, 10),
      cable: hasCables && Number.isFinite(numbers[14]) ? readCable(numbers.subarray(14)) : null,
      reference: numbers.subarray(10, 13),
      rotorRate: numbers[13]!,
    };
  }
  return {
    runId: toHex(view.getBigUint64(8, true)),
    step: Number(view.getBigUint64(16, true)),
    simTime: view.getFloat64(24, true),
    publishedMs: view.getFloat64(32, true),
    poses,
  };
}

function readCable(numbers: Float32Array): Cable {
  const [tension, length, taut, , , , , released] = Array.from(numbers) as [number, number, ...number[]];
  return { tension, length, isTaut: taut === 1, isReleased: released === 1, attitude: numbers.subarray(3, 7) };
}

/** @throws Error if the length does not fit rows and columns. */
export function readRows(message: ArrayBuffer): RunRows {
  const view = new DataView(message);
  const rows = view.getUint32(8, true);
  const columns = view.getUint32(12, true);
  const expected = kRowsHeader + rows * 8 + rows * columns * 4;
  if (message.byteLength !== expected) throw new Error(`rows: expected ${expected} bytes, got ${message.byteLength}`);
  return {
    vehicleId: view.getUint32(4, true),
    runId: toHex(view.getBigUint64(16, true)),
    time: new Float64Array(message, kRowsHeader, rows),
    values: new Float32Array(message, kRowsHeader + rows * 8, rows * columns),
    columns,
  };
}

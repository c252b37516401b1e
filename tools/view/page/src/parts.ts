/** Shapes of the vehicle's parts, in the scene's body frame: x forward, y left, z up, metres. */
import {
  BoxGeometry,
  BufferAttribute,
  BufferGeometry,
  Color,
  ConeGeometry,
  CylinderGeometry,
  IcosahedronGeometry,
  PlaneGeometry,
  Quaternion,
  RingGeometry,
  Vector3,
} from "three";
import { mergeGeometries } from "three/examples/jsm/utils/BufferGeometryUtils.js";
import { kLoadColour, kQuadColour } from "./colours";
import { toScene } from "./frames";
import type { Rotor, Run, Vehicle } from "./types";

/** Rotors for a run without a description of rotors. */
const kDrawnRotors: readonly Rotor[] = [
  { position_m: [0.16, 0.16, 0], spin: 1 },
  { position_m: [-0.16, -0.16, 0], spin: 1 },
  { position_m: [0.16, -0.16, 0], spin: -1 },
  { position_m: [-0.16, 0.16, 0], spin: -1 },
];

export interface Airframe {
  /** Vehicles of the same key look the same. */
  key: string;
  rotors: readonly Rotor[];
  /** Radius of the frame, to the rotors' axes. */
  radius: number;
  rotorRadius: number;
}

export function makeAirframe(vehicle: Vehicle): Airframe {
  const rotors = vehicle.rotors.length > 0 ? vehicle.rotors : kDrawnRotors;
  const radius = Math.max(0.05, ...rotors.map(({ position_m: [x, y] }) => Math.hypot(x, y)));
  let nearest = 2 * radius;
  rotors.forEach((one, index) =>
    rotors.slice(index + 1).forEach((other) => {
      const gap = Math.hypot(one.position_m[0] - other.position_m[0], one.position_m[1] - other.position_m[1]);
      if (gap > 1e-3) nearest = Math.min(nearest, gap); // coaxial rotors have the same position
    }),
  );
  return { key: JSON.stringify(rotors), rotors, radius, rotorRadius: Math.min(0.46 * nearest, 0.75 * radius) };
}

/** Radius of a ball of the load's mass, of about the density of wood. Of a rigid load it marks the centre alone. */
export function calcLoadRadius(run: Run, vehicle: Vehicle): number {
  if (run.load && run.load.outline_m.length > 0) return 0.04;
  const mass = run.load ? run.vehicles.reduce((sum, { load_mass_kg }) => sum + load_mass_kg, 0) : vehicle.load_mass_kg;
  const radius = Math.cbrt((3 * mass) / (4 * Math.PI * 600));
  return Math.min(0.4 * vehicle.rod_length_m, Math.max(0.05, radius));
}

/** With a colour at each vertex. */
export function paint(geometry: BufferGeometry, colour: Color): BufferGeometry {
  const result = geometry.index ? geometry.toNonIndexed() : geometry;
  const count = result.getAttribute("position").count;
  const values = new Float32Array(3 * count);
  for (let i = 0; i < count; ++i) colour.toArray(values, 3 * i);
  result.setAttribute("color", new BufferAttribute(values, 3));
  result.deleteAttribute("uv");
  return result;
}

// `isCoarse`: with few triangles, for fleets drawn by software, where the number of triangles limits the frame rate.

/** Hub in the quadrotor's colour, darker arms and motors, and a light wedge in front. */
export function makeFrameGeometry({ rotors, radius }: Airframe, isCoarse: boolean): BufferGeometry {
  const hub = new Color(kQuadColour);
  const arm = hub.clone().multiplyScalar(0.45);
  const motor = hub.clone().multiplyScalar(0.22);
  const parts = [paint(new BoxGeometry(0.72 * radius, 0.5 * radius, 0.24 * radius), hub)];
  const nose = new ConeGeometry(0.2 * radius, 0.36 * radius, 3);
  nose.rotateZ(-Math.PI / 2).scale(1, 1, 0.55).translate(0.5 * radius, 0, 0);
  parts.push(paint(nose, new Color(0xf4f8ff)));
  for (const { position_m: [x, yDown, zDown] } of rotors) {
    const [y, z] = [-yDown, -zDown];
    const length = Math.hypot(x, y) || 0.01;
    const beam = new BoxGeometry(length, 0.09 * radius, 0.07 * radius);
    beam.translate(length / 2, 0, 0).rotateY(-Math.atan2(z, length)).rotateZ(Math.atan2(y, x));
    parts.push(paint(beam, arm));
    const pod = new CylinderGeometry(0.075 * radius, 0.075 * radius, 0.2 * radius, isCoarse ? 3 : 8);
    pod.rotateX(Math.PI / 2).translate(x, y, z);
    parts.push(paint(pod, motor));
  }
  return mergeGeometries(parts);
}

/** Two blades and the rim of their circle; radius 1. */
export function makeBladeGeometry(): BufferGeometry {
  const blade = new BoxGeometry(1.9, 0.11, 0.02).toNonIndexed();
  const rim = new RingGeometry(0.95, 1, 28).toNonIndexed();
  blade.deleteAttribute("uv");
  rim.deleteAttribute("uv");
  return mergeGeometries([blade, rim]);
}

/** A rod from the origin along +z; radius and length 1. */
export function makeRodGeometry(): BufferGeometry {
  return new CylinderGeometry(1, 1, 1, 6, 1, true).rotateX(Math.PI / 2).translate(0, 0, 0.5);
}

/** A rigid load, in the frame of the load: rods along its outline, and a darker plate within. */
export function makeLoadGeometry(run: Run): BufferGeometry {
  const corners = (run.load?.outline_m ?? []).map((point) => toScene(point, new Vector3()));
  const centre = corners.reduce((sum, corner) => sum.addScaledVector(corner, 1 / corners.length), new Vector3());
  const colour = new Color(kLoadColour);
  const parts: BufferGeometry[] = [];
  corners.forEach((corner, index) => {
    const next = corners[(index + 1) % corners.length]!;
    const along = new Vector3().subVectors(next, corner);
    const length = along.length();
    if (length < 1e-6) return;
    const turn = new Quaternion().setFromUnitVectors(new Vector3(0, 0, 1), along.divideScalar(length));
    const rod = makeRodGeometry().scale(0.016, 0.016, length).applyQuaternion(turn);
    parts.push(paint(rod.translate(corner.x, corner.y, corner.z), colour));
    const plate = new BufferGeometry().setFromPoints([centre, corner, next]);
    plate.computeVertexNormals();
    parts.push(paint(plate, colour.clone().multiplyScalar(0.45)));
  });
  return mergeGeometries(parts);
}

export function makeBallGeometry(isCoarse: boolean): BufferGeometry {
  return new IcosahedronGeometry(1, isCoarse ? 1 : 3);
}

/** Reticle that faces the camera: a ring from 1.5 to 1.75 with four ticks. */
export function makeReticleGeometry(isCoarse: boolean): BufferGeometry {
  const parts = [new RingGeometry(1.5, 1.78, isCoarse ? 12 : 28).toNonIndexed()];
  for (let quarter = 0; quarter < 4; ++quarter) {
    const tick = new PlaneGeometry(0.75, 0.22).translate(2.05, 0, 0).rotateZ((quarter * Math.PI) / 2);
    parts.push(tick.toNonIndexed());
  }
  return mergeGeometries(parts);
}

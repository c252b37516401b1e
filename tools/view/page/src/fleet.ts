/** All vehicles of one run. Every part is one draw call for any number of vehicles. */
import {
  BackSide,
  BufferAttribute,
  BufferGeometry,
  CircleGeometry,
  Color,
  DataTexture,
  DoubleSide,
  FloatType,
  Group,
  Matrix4,
  Mesh,
  MeshBasicMaterial,
  Quaternion,
  RGBAFormat,
  Vector3,
  type Camera,
} from "three";
import { mergeGeometries } from "three/examples/jsm/utils/BufferGeometryUtils.js";
import { calcCablePoints, calcColour, findLoad, hasLoad, kCableParts } from "./cables";
import { kLoadColour, kReferenceColour, type Theme } from "./colours";
import {
  calcLoadRadius,
  makeAirframe,
  makeBallGeometry,
  makeBladeGeometry,
  makeFrameGeometry,
  makeLoadGeometry,
  makeReticleGeometry,
  makeRodGeometry,
  paint,
  type Airframe,
} from "./parts";
import { toScene, toSceneRotation } from "./frames";
import { calcGroundHeight } from "./ground";
import type { Cable, Pose, Run, RunIndex, Vehicle } from "./types";

const kNominalRate = 700; // rad/s, for rotors of unknown rate
const kDrawnRate = 9; // rad/s at the nominal rate: faster rotors seem to stand still on a screen
const kLeastFramePixels = 9; // least radius on the screen: smaller vehicles are drawn larger than they are
const kLeastBladePixels = 16;
const kLeastLoadPixels = 4.5;

/** Position and attitude of one vehicle, in scene coordinates. */
export class Body {
  readonly airframe: Airframe;
  readonly loadRadius: number;
  readonly hasLoad: boolean;
  readonly quad = new Vector3();
  /** Of the load, or of the end of the cable. */
  readonly load = new Vector3();
  /** Of the load. */
  readonly centre = new Vector3();
  readonly loadRotation = new Quaternion();
  readonly reference = new Vector3();
  readonly rotation = new Quaternion();
  cable: Cable | null = null;
  hasPose = false;
  hasReference = false;
  rotorRate = NaN;

  constructor(run: Run, readonly vehicle: Vehicle, place: number) {
    this.airframe = makeAirframe(vehicle);
    this.loadRadius = calcLoadRadius(run, vehicle);
    this.hasLoad = hasLoad(run, place);
  }
}

/** The same part of all vehicles: one mesh with `count` copies of the geometry, whose vertices look up the matrix of
 * their copy in a texture. Instancing would do the same, but in software drawing each instance costs a draw call. */
class Part {
  readonly mesh: Mesh<BufferGeometry, MeshBasicMaterial>;
  private readonly matrices: DataTexture;

  constructor(group: Group, geometry: BufferGeometry, material: MeshBasicMaterial, count: number, order = 0) {
    this.matrices = new DataTexture(new Float32Array(16 * count), 4, count, RGBAFormat, FloatType);
    material.onBeforeCompile = (shader) => {
      shader.uniforms.matrices = { value: this.matrices };
      shader.vertexShader = `attribute float copy;\nuniform highp sampler2D matrices;\n${shader.vertexShader}`.replace(
        "#include <begin_vertex>",
        `#include <begin_vertex>
        int row = int(copy);
        mat4 place = mat4(texelFetch(matrices, ivec2(0, row), 0), texelFetch(matrices, ivec2(1, row), 0),
                          texelFetch(matrices, ivec2(2, row), 0), texelFetch(matrices, ivec2(3, row), 0));
        transformed = (place * vec4(transformed, 1.0)).xyz;`,
      );
    };
    this.mesh = new Mesh(repeat(geometry, count), material);
    this.mesh.frustumCulled = false;
    this.mesh.renderOrder = order;
    group.add(this.mesh);
  }

  /** Changes the colour of a copy of a geometry that has colours. */
  paint(index: number, colour: Color): void {
    const { array, count } = this.mesh.geometry.getAttribute("color");
    const vertices = count / this.matrices.image.height;
    for (let i = index * vertices; i < (index + 1) * vertices; ++i) colour.toArray(array as Float32Array, 3 * i);
    this.mesh.geometry.getAttribute("color").needsUpdate = true;
  }

  set(index: number, matrix: Matrix4): void {
    matrix.toArray(this.matrices.image.data as Float32Array, 16 * index);
  }

  commit(): void {
    this.matrices.needsUpdate = true;
  }

  dispose(): void {
    this.mesh.geometry.dispose();
    this.mesh.material.dispose();
    this.matrices.dispose();
  }
}

/** `count` copies of a geometry, with the number of the copy in attribute `copy`. */
function repeat(geometry: BufferGeometry, count: number): BufferGeometry {
  const source = geometry.index ? geometry.toNonIndexed() : geometry;
  source.deleteAttribute("normal").deleteAttribute("uv"); // nothing is lit
  const vertices = source.getAttribute("position").count;
  const result = mergeGeometries(new Array<BufferGeometry>(count).fill(source));
  const copies = new Float32Array(count * vertices);
  for (let copy = 0; copy < count; ++copy) copies.fill(copy, copy * vertices, (copy + 1) * vertices);
  result.setAttribute("copy", new BufferAttribute(copies, 1));
  return result;
}

export class Fleet {
  readonly group = new Group();
  readonly bodies: Body[];
  private readonly frames: { part: Part; outline: Part; members: number[] }[] = [];
  private readonly discs: Part;
  private readonly blades: Part;
  /** Rods; or of each cable `kCableParts`. */
  private readonly rods: Part;
  private readonly rigidLoad: Part | null;
  private readonly loads: Part;
  private readonly outlines: Part;
  private readonly reticles: Part;
  private readonly shadows: Part;
  private readonly parts: Part[] = [];
  private readonly themed: { material: MeshBasicMaterial; colour: keyof Theme }[] = [];
  private spin = 0;
  private simTime = NaN;

  constructor(
    private readonly run: Run,
    index: RunIndex,
    theme: Theme,
    isMany: boolean,
    isCoarse: boolean,
  ) {
    this.bodies = run.vehicles.map((vehicle, place) => new Body(run, vehicle, place));
    const opacity = index === 1 ? 0.38 : 1;
    const count = this.bodies.length;
    const rotors = this.bodies.reduce((sum, { airframe }) => sum + airframe.rotors.length, 0);

    this.shadows = this.add(new CircleGeometry(1, isCoarse ? 8 : 20), count, 1, { colour: "outline", opacity: 0.22 * opacity });
    for (const members of this.groupByAirframe().values()) {
      const { airframe } = this.bodies[members[0]!]!;
      const geometry = makeFrameGeometry(airframe, isCoarse);
      const outline = this.add(geometry, members.length, 2, { colour: "outline", side: BackSide, opacity });
      const part = this.add(geometry, members.length, 3, { opacity, vertexColors: true });
      outline.mesh.visible = !isCoarse;
      this.frames.push({ part, outline, members });
    }
    this.rods = run.load
      ? this.add(paint(makeRodGeometry(), new Color()), count * kCableParts, 3, { opacity, vertexColors: true })
      : this.add(makeRodGeometry(), count, 3, { colour: "frame", opacity });
    const isRigid = run.load && run.load.outline_m.length > 1;
    this.rigidLoad = isRigid ? this.add(makeLoadGeometry(run), 1, 3, { opacity, vertexColors: true, side: DoubleSide }) : null;
    this.outlines = this.add(makeBallGeometry(isCoarse), count, 3, { colour: "outline", side: BackSide, opacity });
    for (const { mesh } of [this.shadows, this.outlines]) mesh.visible = !isCoarse;
    this.loads = this.add(makeBallGeometry(isCoarse), count, 4, { fixed: kLoadColour, opacity });
    this.blades = this.add(makeBladeGeometry(), rotors, 5, { colour: "frame", side: DoubleSide, opacity: 0.85 * opacity });
    this.discs = this.add(new CircleGeometry(1, isCoarse ? 9 : 24), rotors, 6, {
      colour: "frame",
      side: DoubleSide,
      opacity: (isMany ? 0.3 : 0.16) * opacity,
    });
    this.reticles = this.add(makeReticleGeometry(isCoarse), count, 7, { fixed: kReferenceColour, side: DoubleSide, opacity });
    this.setTheme(theme);
    this.group.visible = false;
  }

  find(vehicleId: number): Body | undefined {
    return this.bodies.find(({ vehicle }) => vehicle.id === vehicleId);
  }

  setTheme(theme: Theme): void {
    for (const { material, colour } of this.themed) material.color.set(theme[colour] as string);
  }

  setPoses(simTime: number, poses: readonly Pose[]): void {
    for (const pose of poses) {
      const body = this.find(pose.vehicleId);
      if (!body) continue;
      toScene(pose.quad, body.quad);
      toScene(pose.load, body.load);
      toScene(findLoad(pose, this.run), body.centre);
      body.cable = pose.cable;
      if (pose.cable) toSceneRotation(pose.cable.attitude, body.loadRotation);
      toSceneRotation(pose.attitude, body.rotation);
      body.hasReference = Number.isFinite(pose.reference[0]);
      if (body.hasReference) toScene(pose.reference, body.reference);
      body.hasPose = true;
      body.rotorRate = pose.rotorRate;
    }
    const passed = simTime - this.simTime;
    if (passed > 0) this.spin += Math.min(passed, 0.05) * kDrawnRate;
    this.simTime = simTime;
    this.group.visible = true;
  }

  /** Factors by which vehicles are drawn larger than they are, so that they are visible from a distance. */
  calcScales(metresPerPixel: number): { frame: number; load: number } {
    const radius = this.bodies[0]?.airframe.radius ?? 0.2;
    const load = this.bodies[0]?.loadRadius ?? 0.05;
    const frame = Math.max(1, (kLeastFramePixels * metresPerPixel) / radius);
    return { frame, load: Math.max(1, (kLeastLoadPixels * metresPerPixel) / load) };
  }

  /** Moves every part to its body, for the view of `camera`. */
  update(camera: Camera, metresPerPixel: number): void {
    const scales = this.calcScales(metresPerPixel);
    this.updateFrames(scales.frame, metresPerPixel);
    this.updateRotors(scales.frame, metresPerPixel);
    this.updateRods(metresPerPixel);
    this.updateBalls(camera, scales.load, metresPerPixel);
    for (const part of this.parts) part.commit();
  }

  dispose(): void {
    for (const part of this.parts) part.dispose();
    this.group.removeFromParent();
  }

  private groupByAirframe(): Map<string, number[]> {
    const groups = new Map<string, number[]>();
    this.bodies.forEach(({ airframe }, place) => groups.set(airframe.key, [...(groups.get(airframe.key) ?? []), place]));
    return groups;
  }

  private add(
    geometry: BufferGeometry,
    count: number,
    order: number,
    look: { colour?: keyof Theme; fixed?: string; side?: typeof BackSide | typeof DoubleSide; opacity: number;
            vertexColors?: boolean },
  ): Part {
    const material = new MeshBasicMaterial({
      color: look.fixed ?? 0xffffff,
      opacity: look.opacity,
      transparent: look.opacity < 1,
      depthWrite: look.opacity === 1,
      vertexColors: look.vertexColors ?? false,
      toneMapped: false,
      ...(look.side !== undefined ? { side: look.side } : {}),
    });
    if (look.colour) this.themed.push({ material, colour: look.colour });
    const part = new Part(this.group, geometry, material, count, order);
    this.parts.push(part);
    return part;
  }

  private updateFrames(scale: number, metresPerPixel: number): void {
    for (const { part, outline, members } of this.frames) {
      members.forEach((place, index) => {
        const { quad, rotation, airframe, hasPose } = this.bodies[place]!;
        const size = hasPose ? scale : 0;
        part.set(index, compose(quad, rotation, size, size, size));
        const grown = hasPose ? size * (1 + (1.3 * metresPerPixel) / (airframe.radius * size)) : 0;
        outline.set(index, compose(quad, rotation, grown, grown, grown));
      });
    }
  }

  private updateRotors(scale: number, metresPerPixel: number): void {
    let index = 0;
    // Blades of distant rotors would be noise, so only their discs are drawn.
    const hasBlades = ((this.bodies[0]?.airframe.radius ?? 0) * scale) / metresPerPixel >= kLeastBladePixels;
    this.blades.mesh.visible = hasBlades;
    for (const { quad, rotation, airframe, hasPose, rotorRate } of this.bodies) {
      const speed = Number.isFinite(rotorRate) ? rotorRate / kNominalRate : 1;
      const size = hasPose ? scale * airframe.rotorRadius : 0;
      for (const { position_m, spin } of airframe.rotors) {
        toScene(position_m, scratch.point);
        scratch.point.z += 0.11 * airframe.radius; // on top of the motor
        scratch.point.multiplyScalar(scale).applyQuaternion(rotation).add(quad);
        // A positive sense is about the body's z axis, which points down.
        scratch.turn.setFromAxisAngle(kUp, -spin * this.spin * Math.max(0.15, speed) + index).premultiply(rotation);
        this.discs.set(index, compose(scratch.point, scratch.turn, size, size, size));
        if (hasBlades) this.blades.set(index, scratch.matrix);
        ++index;
      }
    }
  }

  private updateRods(metresPerPixel: number): void {
    const radius = Math.max(0.008, 0.7 * metresPerPixel);
    this.bodies.forEach(({ vehicle, quad, load, rotation, hasPose, cable }, index) => {
      const from = toScene(vehicle.attachment_m, new Vector3()).applyQuaternion(rotation).add(quad);
      const size = hasPose ? radius : 0;
      if (!this.run.load || !cable) return this.setRod(index * (this.run.load ? kCableParts : 1), from, load, size);
      const points = calcCablePoints(this.run.load, cable, from, load);
      const colour = calcColour(this.run.load, cable, scratch.colour);
      for (let part = 0; part < kCableParts; ++part) {
        const [begin, end] = [points[part], points[part + 1]];
        const copy = index * kCableParts + part;
        this.setRod(copy, begin ?? load, end ?? load, end ? size : 0);
        this.rods.paint(copy, colour);
      }
    });
  }

  private setRod(copy: number, from: Vector3, to: Vector3, radius: number): void {
    scratch.along.subVectors(to, from);
    const length = scratch.along.length();
    scratch.turn.setFromUnitVectors(kUp, length > 0 ? scratch.along.divideScalar(length) : kUp);
    this.rods.set(copy, compose(from, scratch.turn, radius, radius, radius > 0 ? length : 0));
  }

  private updateBalls(camera: Camera, scale: number, metresPerPixel: number): void {
    this.bodies.forEach(({ centre, reference, quad, loadRadius, airframe, hasPose, hasReference, ...body }, index) => {
      const size = hasPose && body.hasLoad ? scale * loadRadius : 0;
      this.loads.set(index, compose(centre, kLevel, size, size, size));
      const grown = size > 0 ? size + 1.3 * metresPerPixel : 0;
      this.outlines.set(index, compose(centre, kLevel, grown, grown, grown));
      if (index === 0) this.rigidLoad?.set(0, compose(centre, body.loadRotation, 1, 1, hasPose ? 1 : 0));
      const reticle = hasReference && hasPose ? scale * loadRadius : 0;
      this.reticles.set(index, compose(reference, camera.quaternion, reticle, reticle, reticle));
      scratch.point.set(quad.x, quad.y, 0.004 + calcGroundHeight(this.run));
      const shadow = hasPose ? airframe.radius * 1.1 : 0;
      this.shadows.set(index, compose(scratch.point, kLevel, shadow, shadow, shadow));
    });
  }
}

const kUp = new Vector3(0, 0, 1);
const kLevel = new Quaternion();
const scratch = {
  point: new Vector3(),
  along: new Vector3(),
  turn: new Quaternion(),
  scale: new Vector3(),
  colour: new Color(),
  matrix: new Matrix4(),
};

function compose(position: Vector3, rotation: Quaternion, x: number, y: number, z: number): Matrix4 {
  return scratch.matrix.compose(position, rotation, scratch.scale.set(x, y, z));
}

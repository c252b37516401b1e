/** The camera: an orbit about a target, or a true-to-scale drawing from above or from the side. */
import { MathUtils, OrthographicCamera, PerspectiveCamera, Vector3, type Box3, type Camera } from "three";
import type { CameraMode } from "./types";

const kFieldOfView = (40 * Math.PI) / 180;
const kMostElevation = (89 * Math.PI) / 180;
const kLeastElevation = (-20 * Math.PI) / 180;
const kLeastDistance = 0.3;
const kMostDistance = 2000;

export class View {
  mode: CameraMode = "free";
  readonly target = new Vector3(0, 0, 1);
  private distance = 6;
  private azimuth = (215 * Math.PI) / 180;
  private elevation = (22 * Math.PI) / 180;
  private width = 1;
  private height = 1;
  private readonly perspective = new PerspectiveCamera((kFieldOfView * 180) / Math.PI, 1, 0.05, 5000);
  private readonly orthographic = new OrthographicCamera(-1, 1, 1, -1, 0.05, 10000);

  get isFlat(): boolean {
    return this.mode === "top" || this.mode === "side";
  }

  get camera(): Camera {
    return this.isFlat ? this.orthographic : this.perspective;
  }

  /** Metres across the height of the picture, at the target. */
  get heightMetres(): number {
    return 2 * this.distance * Math.tan(kFieldOfView / 2);
  }

  get metresPerPixel(): number {
    return this.heightMetres / this.height;
  }

  /** Size of the picture in CSS pixels. */
  resize(width: number, height: number): void {
    this.width = Math.max(1, width);
    this.height = Math.max(1, height);
  }

  /** Puts `box` into the picture; a drawing to scale leaves `covered` CSS pixels at its top free, where the buttons are. */
  fit(box: Box3, covered: number): void {
    if (box.isEmpty()) return;
    box.getCenter(this.target);
    const size = box.getSize(new Vector3());
    const aspect = this.width / this.height;
    if (this.isFlat) {
      const [across, up] = this.mode === "top" ? [size.y, size.x] : [size.x, size.z];
      const seen = Math.max(0.5, 1 - covered / this.height);
      this.setDistance((0.625 * Math.max(up / seen, across / aspect, 1)) / Math.tan(kFieldOfView / 2));
      this.target[this.mode === "top" ? "x" : "z"] += ((1 - seen) / 2) * this.heightMetres;
      return;
    }
    const radius = Math.max(0.5 * size.length(), 0.8);
    this.setDistance(radius / Math.sin(kFieldOfView / 2) / Math.min(1, aspect * 1.1));
    // A wide, flat fleet is seen better from higher up than a single flight.
    this.elevation = size.z < 0.2 * Math.hypot(size.x, size.y) ? 0.55 : 0.36;
  }

  rotate(dx: number, dy: number): void {
    if (this.isFlat) return this.pan(dx, dy);
    this.azimuth -= dx * 0.006;
    this.elevation = MathUtils.clamp(this.elevation + dy * 0.006, kLeastElevation, kMostElevation);
  }

  pan(dx: number, dy: number): void {
    this.update();
    const scale = this.metresPerPixel;
    const right = new Vector3().setFromMatrixColumn(this.camera.matrixWorld, 0);
    const up = new Vector3().setFromMatrixColumn(this.camera.matrixWorld, 1);
    this.target.addScaledVector(right, -dx * scale).addScaledVector(up, dy * scale);
  }

  zoom(factor: number): void {
    this.setDistance(this.distance * factor);
  }

  /** Updates the cameras from the fields above. */
  update(): void {
    const aspect = this.width / this.height;
    if (!this.isFlat) {
      const flat = Math.cos(this.elevation) * this.distance;
      this.perspective.position.set(
        this.target.x + flat * Math.cos(this.azimuth),
        this.target.y + flat * Math.sin(this.azimuth),
        this.target.z + Math.sin(this.elevation) * this.distance,
      );
      this.perspective.up.set(0, 0, 1);
      this.perspective.near = Math.max(0.02, this.distance / 200);
      this.perspective.far = this.distance * 20 + 500;
      this.perspective.aspect = aspect;
      this.perspective.lookAt(this.target);
      this.perspective.updateProjectionMatrix();
      this.perspective.updateMatrixWorld();
      return;
    }
    const half = this.heightMetres / 2;
    const camera = this.orthographic;
    Object.assign(camera, { left: -half * aspect, right: half * aspect, top: half, bottom: -half });
    // From above x points up and y of frame W right; from the side x points right and height up.
    camera.up.set(this.mode === "top" ? 1 : 0, 0, this.mode === "top" ? 0 : 1);
    camera.position.copy(this.target);
    if (this.mode === "top") camera.position.z += 2000;
    else camera.position.y -= 2000;
    camera.lookAt(this.target);
    camera.updateProjectionMatrix();
    camera.updateMatrixWorld();
  }

  /** Pixel of the picture, from its upper left corner; null for a point behind the camera. */
  project(point: Vector3): [number, number] | null {
    const seen = point.clone().project(this.camera);
    if (seen.z > 1 || seen.z < -1) return null;
    return [((seen.x + 1) / 2) * this.width, ((1 - seen.y) / 2) * this.height];
  }

  private setDistance(distance: number): void {
    this.distance = MathUtils.clamp(distance, kLeastDistance, kMostDistance);
  }
}

/** Drag turns, drag with the right button or shift moves, wheel and pinch zoom. The keys: arrows and +/−. */
export function control(element: HTMLElement, view: View, changed: () => void, clicked: (x: number, y: number) => void) {
  const pointers = new Map<number, PointerEvent>();
  let moved = 0;

  element.addEventListener("pointerdown", (event) => {
    element.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, event);
    if (pointers.size === 1) moved = 0;
  });
  element.addEventListener("pointermove", (event) => {
    const before = pointers.get(event.pointerId);
    if (!before) return;
    const dx = event.clientX - before.clientX;
    const dy = event.clientY - before.clientY;
    moved += Math.abs(dx) + Math.abs(dy);
    if (pointers.size === 1) {
      const pans = (event.buttons & 2) !== 0 || (event.buttons & 4) !== 0 || event.shiftKey;
      if (pans) view.pan(dx, dy);
      else view.rotate(dx, dy);
    } else if (pointers.size === 2) {
      const other = [...pointers.values()].find((pointer) => pointer.pointerId !== event.pointerId)!;
      const span = (pointer: PointerEvent) =>
        Math.hypot(pointer.clientX - other.clientX, pointer.clientY - other.clientY) || 1;
      view.zoom(span(before) / span(event));
      view.pan(dx / 2, dy / 2);
    }
    pointers.set(event.pointerId, event);
    changed();
  });
  const release = (event: PointerEvent) => {
    if (!pointers.delete(event.pointerId) || event.type === "pointercancel") return;
    if (moved > 5 || pointers.size > 0) return;
    const area = element.getBoundingClientRect();
    clicked(event.clientX - area.left, event.clientY - area.top);
  };
  element.addEventListener("pointerup", release);
  element.addEventListener("pointercancel", release);
  element.addEventListener("contextmenu", (event) => event.preventDefault());
  element.addEventListener(
    "wheel",
    (event) => {
      event.preventDefault();
      view.zoom(Math.exp(MathUtils.clamp(event.deltaY * (event.deltaMode === 1 ? 0.04 : 0.0015), -0.4, 0.4)));
      changed();
    },
    { passive: false },
  );
  element.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const step = 30;
    const arrows: Record<string, [number, number]> = {
      ArrowLeft: [step, 0],
      ArrowRight: [-step, 0],
      ArrowUp: [0, step],
      ArrowDown: [0, -step],
    };
    const arrow = arrows[event.key];
    if (arrow && event.shiftKey) view.pan(arrow[0], arrow[1]);
    else if (arrow) view.rotate(arrow[0], arrow[1]);
    else if (event.key === "+" || event.key === "=") view.zoom(0.85);
    else if (event.key === "-") view.zoom(1 / 0.85);
    else return;
    event.preventDefault();
    changed();
  });
}

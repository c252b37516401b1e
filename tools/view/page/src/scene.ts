/** The flight in three dimensions. Draws after changes, at most once a frame. */
import { Box3, Color, Scene as World, Vector3, WebGLRenderer, type Line } from "three";
import { calcCablePoints } from "./cables";
import { control, View } from "./camera";
import { onThemeChange, readTheme, type Theme } from "./colours";
import { Fleet, type Body } from "./fleet";
import { toScene } from "./frames";
import { calcGroundHeight, Ground, makePath } from "./ground";
import { Overlay } from "./overlay";
import { Trails } from "./trails";
import type { CameraMode, Pose, Run, RunIndex, Trail } from "./types";

const kManyVehicles = 10; // more vehicles are drawn without smooth edges
const kSlowFrame = 40; // ms between frames above which fewer pixels are drawn
const kQuickFrame = 22;
const kRest = 100; // ms: a frame requested later than this after the last one does not count for `adapt`
const kFramesJudged = 12;
const kScales = [1, 0.75, 0.5, 0.4]; // the last two for fleets only
const kPickPixels = 26;

interface Layer {
  run: Run;
  fleet: Fleet;
  trails: Trails;
  path: Line;
  isFitted: boolean;
}

export class Scene {
  private canvas: HTMLCanvasElement;
  private readonly overlay: Overlay;
  private readonly world = new World();
  private readonly view = new View();
  private readonly ground: Ground;
  private readonly layers: [Layer | null, Layer | null] = [null, null];
  private renderer: WebGLRenderer;
  private theme: Theme = readTheme();
  private selected = 0;
  private pick: (vehicleId: number) => void = () => {};
  private drawn: () => void = () => {};
  private request = 0;
  private scale = 0; // index into kScales
  private lastFrame = 0;
  private requested = 0; // time of the request for the next frame
  private intervals: number[] = [];
  private frameCount = 0;
  private readonly frameTimes: number[] = [];
  /** True if the browser draws without a graphics processor. */
  readonly isSoftware: boolean;

  /** @throws Error if the browser has no WebGL 2. */
  constructor(canvas: HTMLCanvasElement) {
    this.canvas = canvas;
    this.renderer = this.makeRenderer(true);
    this.isSoftware = isDrawnBySoftware(this.renderer);
    const labels = document.createElement("canvas");
    labels.className = "labels";
    labels.setAttribute("aria-hidden", "true");
    canvas.after(labels);
    this.overlay = new Overlay(labels);
    this.ground = new Ground(this.theme);
    this.world.add(this.ground.lines);
    this.world.background = new Color(this.theme.background);
    const area = canvas.parentElement!;
    control(area, this.view, () => this.invalidate(), (x, y) => this.pickAt(x, y));
    new ResizeObserver(() => this.resize()).observe(area);
    onThemeChange(() => this.setTheme());
    this.resize();
  }

  setRun(run: Run, index: RunIndex = 0): void {
    const old = this.layers[index];
    if (old) {
      old.fleet.dispose();
      old.trails.dispose();
      old.path.geometry.dispose();
      old.path.removeFromParent();
    }
    const isMany = run.vehicles.length > kManyVehicles;
    if (index === 0) this.useSmoothEdges(!isMany);
    const fleet = new Fleet(run, index, this.theme, isMany, isMany && this.isSoftware);
    const layer = { run, fleet, trails: new Trails(run, index), path: makePath(run, index), isFitted: false };
    this.layers[index] = layer;
    this.world.add(fleet.group, layer.trails.lines, layer.path);
    if (index === 0 && !fleet.find(this.selected)) this.selected = run.vehicles[0]?.id ?? 0;
    this.fit();
  }

  setPoses(simTime: number, poses: readonly Pose[], index: RunIndex = 0): void {
    const layer = this.layers[index];
    if (!layer) return;
    layer.fleet.setPoses(simTime, poses);
    layer.trails.extend(simTime, poses);
    if (!layer.isFitted) {
      layer.isFitted = true;
      this.fit();
    }
    this.invalidate();
  }

  resetTrails(index: RunIndex = 0): void {
    this.layers[index]?.trails.reset();
    this.invalidate();
  }

  /** Replaces the trail that poses have left: for a jump in time of a recording. */
  setTrail(vehicleId: number, trail: Trail, index: RunIndex = 0): void {
    this.layers[index]?.trails.replace(vehicleId, trail);
    this.invalidate();
  }

  select(vehicleId: number): void {
    this.selected = vehicleId;
    this.invalidate();
  }

  setCamera(mode: CameraMode): void {
    this.view.mode = mode;
    if (mode !== "follow") this.fit();
    this.invalidate();
  }

  /** `act` is called with the vehicle that was clicked. */
  onPick(act: (vehicleId: number) => void): void {
    this.pick = act;
  }

  /** `act` is called after every frame. */
  onDrawn(act: () => void): void {
    this.drawn = act;
  }

  /** Moves the camera so that path and vehicles fit into the picture. */
  fit(): void {
    const box = new Box3();
    let pathTop = -Infinity;
    for (const layer of this.layers) {
      if (!layer) continue;
      for (const point of layer.run.path_m) box.expandByPoint(toScene(point, new Vector3()));
      pathTop = Math.max(pathTop, ...layer.run.path_m.map(([, , z]) => -z));
      for (const body of layer.fleet.bodies) {
        if (!body.hasPose) continue;
        box.expandByPoint(body.load).expandByPoint(body.quad);
      }
    }
    if (box.isEmpty()) box.set(new Vector3(-2, -2, 0), new Vector3(2, 2, 2));
    const height = calcGroundHeight(this.layers[0]?.run);
    this.ground.cover(box.min, box.max, height);
    // Includes the rod above the planned path of the load.
    const rod = Math.max(...(this.layers[0]?.run.vehicles.map((vehicle) => vehicle.rod_length_m) ?? [1]));
    box.expandByPoint(new Vector3(box.min.x, box.min.y, Math.max(box.max.z, pathTop + rod)));
    if (box.min.z > height) box.min.z = height;
    const buttons = document.querySelector<HTMLElement>(".scene-tools")!;
    this.view.fit(box, buttons.offsetTop + buttons.offsetHeight);
    this.invalidate();
  }

  /** Draws with the next frame. */
  invalidate(): void {
    if (this.request !== 0) return;
    this.requested = performance.now();
    this.request = requestAnimationFrame((now) => this.drawFrame(now));
  }

  /** Draws at once. */
  render(): void {
    const body = this.body(this.selected);
    if (this.view.mode === "follow" && body) this.view.target.lerpVectors(body.quad, body.load, 0.5);
    this.view.update();
    for (const layer of this.layers) layer?.fleet.update(this.view.camera, this.view.metresPerPixel);
    this.renderer.render(this.world, this.view.camera);
    const title = this.view.mode === "top" ? "from above" : this.view.mode === "side" ? "from the side (along −y)" : "";
    const bodies = this.layers[0]?.fleet.bodies ?? [];
    this.overlay.draw(this.view, this.theme, this.ground.extent, bodies, this.selected, title);
    ++this.frameCount;
  }

  frames(): number {
    return this.frameCount;
  }

  /** Frames drawn during the last second. */
  fps(): number {
    const since = performance.now() - 1000;
    return this.frameTimes.filter((time) => time > since).length;
  }

  /** Places of the vehicle's parts, in CSS pixels of the page. */
  projection(vehicleId: number) {
    const body = this.body(vehicleId);
    if (!body?.hasPose) return null;
    this.view.update(); // the camera may have changed since the last frame
    const area = this.canvas.getBoundingClientRect();
    const place = (point: Vector3): [number, number] | null => {
      const pixel = this.view.project(point);
      return pixel && [pixel[0] + area.left, pixel[1] + area.top];
    };
    const quad = place(body.quad);
    const load = place(body.load);
    if (!quad || !load) return null;
    return { quad, load, reference: body.hasReference ? place(body.reference) : null };
  }

  /** Points of the vehicle's cable in frame W, of a load on cables; none if it is cut. */
  cable(vehicleId: number): number[][] | null {
    const body = this.body(vehicleId);
    const load = this.layers[0]?.run.load;
    if (!body?.cable || !load) return null;
    return calcCablePoints(load, body.cable, body.quad, body.load).map(({ x, y, z }) => [x, -y, -z]);
  }

  /** The camera: mode, target in frame W, metres across the picture's height at the target, area in CSS pixels. */
  camera() {
    const { left, top, width, height } = this.canvas.getBoundingClientRect();
    const { x, y, z } = this.view.target;
    return { mode: this.view.mode, target_m: [x, -y, -z], height_m: this.view.heightMetres,
             area: { left, top, width, height }, resolution: kScales[this.scale] };
  }

  private body(vehicleId: number): Body | undefined {
    return this.layers[0]?.fleet.find(vehicleId);
  }

  private drawFrame(now: number): void {
    this.request = 0;
    this.adapt(now);
    this.render();
    this.frameTimes.push(performance.now());
    if (this.frameTimes.length > 240) this.frameTimes.splice(0, 120);
    this.drawn();
  }

  /** Draws fewer pixels while consecutive frames take too long, and more again when they do not. */
  private adapt(now: number): void {
    const interval = now - this.lastFrame;
    this.lastFrame = now;
    if (interval > 0 && this.requested > now - interval + kRest) return void (this.intervals = []); // nothing was to be drawn
    this.intervals.push(interval);
    if (this.intervals.length < kFramesJudged) return;
    const median = [...this.intervals].sort((a, b) => a - b)[kFramesJudged / 2]!;
    this.intervals = [];
    const isFleet = (this.layers[0]?.run.vehicles.length ?? 0) > kManyVehicles;
    const smallest = isFleet ? kScales.length - 1 : 1;
    if (median > kSlowFrame && this.scale < smallest) ++this.scale;
    else if (median < kQuickFrame && this.scale > 0) --this.scale;
    else return;
    this.resize(false);
  }

  private makeRenderer(isSmooth: boolean): WebGLRenderer {
    const renderer = new WebGLRenderer({ canvas: this.canvas, antialias: isSmooth, powerPreference: "high-performance" });
    renderer.sortObjects = true;
    return renderer;
  }

  /** Replaces the canvas, because a WebGL context cannot change its smooth edges. */
  private useSmoothEdges(isSmooth: boolean): void {
    if (this.renderer.getContextAttributes().antialias === isSmooth) return;
    const canvas = this.canvas.cloneNode() as HTMLCanvasElement;
    this.renderer.dispose();
    this.renderer.forceContextLoss();
    this.canvas.replaceWith(canvas);
    this.canvas = canvas;
    this.renderer = this.makeRenderer(isSmooth);
    this.resize(false);
  }

  private resize(isNewSize = true): void {
    const area = this.canvas.parentElement!;
    const [width, height] = [Math.max(1, area.clientWidth), Math.max(1, area.clientHeight)];
    const ratio = this.isSoftware ? 1 : Math.min(2, devicePixelRatio);
    this.renderer.setPixelRatio(ratio * kScales[this.scale]!);
    this.renderer.setSize(width, height, false);
    if (isNewSize) {
      this.overlay.resize(width, height, ratio);
      this.view.resize(width, height);
    }
    this.invalidate();
  }

  private setTheme(): void {
    this.theme = readTheme();
    this.world.background = new Color(this.theme.background);
    this.ground.setTheme(this.theme);
    for (const layer of this.layers) layer?.fleet.setTheme(this.theme);
    this.invalidate();
  }

  private pickAt(x: number, y: number): void {
    let nearest = kPickPixels;
    let found: number | null = null;
    for (const body of this.layers[0]?.fleet.bodies ?? []) {
      if (!body.hasPose) continue;
      for (const point of [body.quad, body.load]) {
        const pixel = this.view.project(point);
        const distance = pixel ? Math.hypot(pixel[0] - x, pixel[1] - y) : Infinity;
        if (distance >= nearest) continue;
        nearest = distance;
        found = body.vehicle.id;
      }
    }
    if (found !== null) this.pick(found);
  }
}

function isDrawnBySoftware(renderer: WebGLRenderer): boolean {
  const context = renderer.getContext();
  const names = context.getExtension("WEBGL_debug_renderer_info");
  const name = names ? String(context.getParameter(names.UNMASKED_RENDERER_WEBGL)) : "";
  return /swiftshader|llvmpipe|software/i.test(name);
}

/** The ground, at height 0 unless the run has one elsewhere, with a grid in metres, and the planned path. */
import { BufferAttribute, BufferGeometry, Color, Line, LineBasicMaterial, LineDashedMaterial, LineSegments, Vector3 } from "three";
import { kReferenceColour, type Theme } from "./colours";
import { toScene } from "./frames";
import type { Run, RunIndex } from "./types";

export interface Extent {
  /** Whole steps, in scene coordinates, m. */
  left: number;
  right: number;
  back: number;
  front: number;
  step: number;
  height: number;
  /** Lines at multiples of this many steps are stronger and have labels. */
  major: number;
}

export class Ground {
  readonly lines = new LineSegments(new BufferGeometry(), new LineBasicMaterial({ vertexColors: true, toneMapped: false }));
  extent: Extent = { left: -5, right: 5, back: -5, front: 5, step: 1, height: 0, major: 5 };

  constructor(private theme: Theme) {
    this.lines.frustumCulled = false;
    this.build();
  }

  /** Makes the ground at this height cover this area, in scene coordinates, with a margin. */
  cover(minimum: Vector3, maximum: Vector3, height: number): void {
    const size = Math.max(maximum.x - minimum.x, maximum.y - minimum.y, 2);
    const step = size <= 24 ? 1 : size <= 120 ? 5 : 50;
    const margin = Math.max(3 * step, 0.35 * size);
    const extent = {
      left: Math.floor((minimum.x - margin) / step) * step,
      right: Math.ceil((maximum.x + margin) / step) * step,
      back: Math.floor((minimum.y - margin) / step) * step,
      front: Math.ceil((maximum.y + margin) / step) * step,
      step,
      height,
      major: step === 5 ? 2 : 5,
    };
    if (JSON.stringify(extent) === JSON.stringify(this.extent)) return;
    this.extent = extent;
    this.build();
  }

  setTheme(theme: Theme): void {
    this.theme = theme;
    this.build();
  }

  private build(): void {
    const { left, right, back, front, step, height, major } = this.extent;
    const minor = new Color(this.theme.grid);
    const strong = new Color(this.theme.gridMajor);
    const points: number[] = [];
    const colours: number[] = [];
    const add = (x0: number, y0: number, x1: number, y1: number, place: number) => {
      points.push(x0, y0, height, x1, y1, height);
      const colour = Math.round(place / step) % major === 0 ? strong : minor;
      colours.push(...colour.toArray(), ...colour.toArray());
    };
    for (let x = left; x <= right + 1e-6; x += step) add(x, back, x, front, x);
    for (let y = back; y <= front + 1e-6; y += step) add(left, y, right, y, y);
    this.lines.geometry.dispose();
    this.lines.geometry = new BufferGeometry();
    this.lines.geometry.setAttribute("position", new BufferAttribute(new Float32Array(points), 3));
    this.lines.geometry.setAttribute("color", new BufferAttribute(new Float32Array(colours), 3));
  }
}

/** Height of the ground of a run, in scene coordinates. */
export function calcGroundHeight(run: Run | undefined): number {
  return 0 - (run?.load?.ground_z_m ?? 0);
}

/** The planned path of the load, dashed. */
export function makePath(run: Run, index: RunIndex): Line {
  const points = run.path_m.map((point) => toScene(point, new Vector3()));
  const material = new LineDashedMaterial({
    color: kReferenceColour,
    transparent: true,
    opacity: index === 1 ? 0.3 : 0.7,
    dashSize: 0.09,
    gapSize: 0.06,
    toneMapped: false,
  });
  const line = new Line(new BufferGeometry().setFromPoints(points), material);
  line.computeLineDistances();
  line.frustumCulled = false;
  line.renderOrder = 1;
  return line;
}

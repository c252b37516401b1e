/** Text over the scene: metres of the grid, names of vehicles, the axes of frame W, a scale. Drawn flat on a canvas. */
import { Vector3 } from "three";
import type { View } from "./camera";
import { describeCable } from "./cables";
import type { Theme } from "./colours";
import type { Body } from "./fleet";
import type { Extent } from "./ground";

const kFont = "11px system-ui, sans-serif";
const kLeastGap = 38; // px between labels of the grid

export class Overlay {
  private readonly context: CanvasRenderingContext2D;
  private width = 0;
  private height = 0;

  constructor(readonly canvas: HTMLCanvasElement) {
    this.context = canvas.getContext("2d")!;
  }

  resize(width: number, height: number, ratio: number): void {
    this.width = width;
    this.height = height;
    this.canvas.width = Math.round(width * ratio);
    this.canvas.height = Math.round(height * ratio);
    this.context.setTransform(ratio, 0, 0, ratio, 0, 0);
  }

  draw(view: View, theme: Theme, extent: Extent, bodies: readonly Body[], selected: number, title: string): void {
    const { context } = this;
    context.clearRect(0, 0, this.width, this.height);
    context.font = kFont;
    this.drawMetres(view, theme, extent);
    if (bodies.length > 1 || bodies[0]?.cable) this.drawNames(view, theme, bodies, selected);
    this.drawAxes(view, theme);
    if (view.isFlat) this.drawScale(view, theme);
    if (title) {
      context.fillStyle = theme.muted;
      context.textAlign = "left";
      context.fillText(title, 12, this.height - 12);
    }
  }

  /** Along the two edges of the grid, in coordinates of W. */
  private drawMetres(view: View, theme: Theme, extent: Extent): void {
    const { context } = this;
    context.fillStyle = theme.muted;
    context.textAlign = "center";
    context.textBaseline = "middle";
    const spacing = extent.step * (extent.right - extent.left > 30 * extent.step ? extent.major : 1);
    const label = (from: number, to: number, place: (at: number) => Vector3, text: (at: number) => string) => {
      let last: [number, number] | null = null;
      for (let at = Math.ceil(from / spacing) * spacing; at <= to + 1e-6; at += spacing) {
        const pixel = view.project(place(at));
        if (!pixel || (last && Math.hypot(pixel[0] - last[0], pixel[1] - last[1]) < kLeastGap)) continue;
        context.fillText(text(at), pixel[0], pixel[1]);
        last = pixel;
      }
    };
    const pad = 0.35 * extent.step;
    if (view.mode === "side") {
      label(extent.left, extent.right, (x) => point.set(x, extent.back, extent.height - pad), (x) => `${format(x)} m`);
      label(extent.step, 100 * extent.step, (z) => point.set(extent.left - pad, 0, z), (z) => `${format(z)} m high`);
      return;
    }
    label(extent.left, extent.right, (x) => point.set(x, extent.back - pad, extent.height), (x) => `x ${format(x)} m`);
    label(extent.left, extent.right, (x) => point.set(x, extent.front + pad, extent.height), (x) => `x ${format(x)} m`);
    label(extent.back + spacing, extent.front - spacing, (y) => point.set(extent.left - pad, y, extent.height), (y) => `y ${format(-y)} m`);
    label(extent.back + spacing, extent.front - spacing, (y) => point.set(extent.right + pad, y, extent.height), (y) => `y ${format(-y)} m`);
  }

  private drawNames(view: View, theme: Theme, bodies: readonly Body[], selected: number): void {
    const { context } = this;
    const taken = new Set<string>();
    const order = [...bodies].sort((a, b) => Number(b.vehicle.id === selected) - Number(a.vehicle.id === selected));
    context.textAlign = "center";
    for (const body of order) {
      if (!body.hasPose) continue;
      const pixel = view.project(body.quad);
      if (!pixel) continue;
      const isSelected = body.vehicle.id === selected;
      const cell = `${Math.round(pixel[0] / (body.cable ? 60 : 24))},${Math.round(pixel[1] / 14)}`;
      if (taken.has(cell)) continue;
      taken.add(cell);
      const radius = Math.max(11, body.airframe.radius / view.metresPerPixel);
      if (isSelected && bodies.length > 1) this.drawSelection(pixel, radius, theme);
      context.fillStyle = isSelected ? theme.text : theme.muted;
      context.font = isSelected ? `600 ${kFont}` : kFont;
      const name = body.cable ? `${body.vehicle.id}: ${describeCable(body.cable)}` : String(body.vehicle.id);
      context.fillText(name, pixel[0], pixel[1] - radius - 9);
    }
    context.font = kFont;
  }

  private drawSelection([x, y]: [number, number], radius: number, theme: Theme): void {
    const { context } = this;
    context.strokeStyle = theme.accent;
    context.lineWidth = 1.5;
    context.beginPath();
    context.arc(x, y, radius + 4, 0, 2 * Math.PI);
    context.stroke();
  }

  /** Axes of W as the camera sees them; its z points down, so up is −z. */
  private drawAxes(view: View, theme: Theme): void {
    const { context } = this;
    const [x, y] = [40, this.height - 52];
    const length = 26;
    const axes: [Vector3, string, string][] = [
      [new Vector3(1, 0, 0), "x", theme.series[0]!],
      [new Vector3(0, -1, 0), "y", theme.series[1]!],
      [new Vector3(0, 0, 1), "up (−z)", theme.series[2]!],
    ];
    context.lineWidth = 2;
    context.textAlign = "center";
    for (const [axis, name, colour] of axes) {
      const seen = axis.transformDirection(view.camera.matrixWorldInverse);
      if (Math.hypot(seen.x, seen.y) < 0.08) continue; // points at the camera
      context.strokeStyle = context.fillStyle = colour;
      context.beginPath();
      context.moveTo(x, y);
      context.lineTo(x + length * seen.x, y - length * seen.y);
      context.stroke();
      const gap = name.length > 1 && Math.abs(seen.x) > 0.5 ? 26 : 10;
      const norm = Math.hypot(seen.x, seen.y);
      context.fillText(name, x + length * seen.x + (gap * seen.x) / norm, y - length * seen.y - (10 * seen.y) / norm);
    }
  }

  private drawScale(view: View, theme: Theme): void {
    const { context } = this;
    const wanted = 90 * view.metresPerPixel;
    const power = 10 ** Math.floor(Math.log10(wanted));
    const metres = [5, 2, 1].map((factor) => factor * power).find((value) => value <= wanted) ?? power;
    const pixels = metres / view.metresPerPixel;
    const [x, y] = [this.width - pixels - 18, this.height - 18];
    context.strokeStyle = context.fillStyle = theme.muted;
    context.lineWidth = 1.5;
    context.beginPath();
    context.moveTo(x, y - 4);
    context.lineTo(x, y);
    context.lineTo(x + pixels, y);
    context.lineTo(x + pixels, y - 4);
    context.stroke();
    context.textAlign = "center";
    context.fillText(`${Number(metres.toPrecision(2))} m`, x + pixels / 2, y - 10);
  }
}

const point = new Vector3();

function format(value: number): string {
  return String(Math.round(value * 100) / 100 + 0).replace("-", "−");
}

/** The parts of the page that a live flight and a recording share: scene, plots, table, cameras, keys, theme. */
import { find, isTyping, make, makeChoice, setText } from "./dom";
import { Plots } from "./plots";
import { distance } from "./replay/recording";
import { Scene } from "./scene";
import type { CameraMode, Pose, Run, RunIndex } from "./types";

const kTableTime = 400; // ms between updates of the table
const kRedrawTime = 50; // ms between redraws of the plots
const kSoftwareRedrawTime = 200; // the same without a graphics processor: then one costs as much as a frame of 100 vehicles
const kTextTime = 2000; // ms between updates of the text that describes the scene

export interface Shell {
  /** Null if the browser has no WebGL: the table takes its place. */
  readonly scene: Scene | null;
  readonly plots: Plots;
  selected(): number;
  /** `act` is called when the user chooses another vehicle. */
  onSelect(act: (vehicleId: number) => void): void;
  setRun(run: Run, index?: RunIndex): void;
  setPoses(simTime: number, poses: readonly Pose[], index?: RunIndex): void;
  /** Adds `window.slsView` with `own` functions, for tests. */
  expose(own: object): void;
}

const kKeys: [string, string][] = [
  ["Space", "start, pause or resume"],
  ["N", "step"],
  ["Shift R / Shift S", "reset / stop"],
];
const kSharedKeys: [string, string][] = [
  ["1 2 3 4", "camera: orbit, follow, top, side"],
  ["F", "fit everything into the picture"],
  ["T", "table of positions"],
  ["[ ]", "previous and next vehicle"],
  ["Arrows, + −", "turn and zoom, with the scene in focus"],
  ["?", "these keys"],
];

export function makeShell(): Shell {
  setUpTheme();
  setUpKeys();
  const scene = makeScene();
  const plots = new Plots(find("plots"), scene?.isSoftware ? kSoftwareRedrawTime : kRedrawTime);
  const table = new Table(scene !== null);
  const picker = find<HTMLSelectElement>("vehicle");
  let selected = 0;
  let ids: number[] = [];
  let newest: readonly Pose[] = [];
  let chosen: (vehicleId: number) => void = () => {};

  const select = (vehicleId: number) => {
    selected = vehicleId;
    scene?.select(vehicleId);
    table.select(vehicleId);
    picker.value = String(vehicleId);
    setText(find("plots-title"), ids.length > 1 ? `Plots of vehicle ${vehicleId}` : "Plots");
  };
  const choose = (vehicleId: number) => {
    if (!ids.includes(vehicleId)) return;
    select(vehicleId);
    chosen(vehicleId);
  };
  scene?.onPick(choose);
  table.onPick(choose);
  picker.addEventListener("change", () => choose(Number(picker.value)));
  makeChoice(find("cameras"), ({ dataset }) => scene?.setCamera(dataset.camera as CameraMode));
  find("fit").addEventListener("click", () => scene?.fit());
  makeChoice(find("windows"), ({ dataset }) => plots.setWindow(dataset.window === "all" ? null : Number(dataset.window)));
  document.addEventListener("keydown", (event) => {
    if (isTyping(event) || event.ctrlKey || event.metaKey || event.altKey) return;
    const camera = ["free", "follow", "top", "side"][Number(event.key) - 1];
    if (camera) find("cameras").querySelector<HTMLButtonElement>(`[data-camera=${camera}]`)!.click();
    else if (event.key === "f") scene?.fit();
    else if (event.key === "t") find("table-toggle").click();
    else if (event.key === "[" || event.key === "]") {
      const at = ids.indexOf(selected) + (event.key === "]" ? 1 : -1);
      choose(ids[(at + ids.length) % ids.length]!);
    }
  });

  return {
    scene,
    plots,
    selected: () => selected,
    onSelect: (act) => void (chosen = act),
    setRun(run, index = 0) {
      scene?.setRun(run, index);
      if (index !== 0) return;
      plots.setRun(run);
      newest = [];
      ids = run.vehicles.map(({ id }) => id);
      picker.replaceChildren(...ids.map((id) => make("option", { value: String(id) }, String(id))));
      find("vehicle-picker").hidden = ids.length < 2;
      table.setRun(run);
      select(ids.includes(selected) ? selected : (ids[0] ?? 0));
    },
    setPoses(simTime, poses, index = 0) {
      scene?.setPoses(simTime, poses, index);
      if (index !== 0) return;
      newest = poses;
      table.offer(simTime, poses);
    },
    expose(own) {
      Object.assign(window, {
        slsView: {
          redraw: () => scene?.invalidate(),
          frames: () => scene?.frames() ?? 0,
          projection: (vehicleId: number) => scene?.projection(vehicleId) ?? null,
          camera: () => scene?.camera() ?? null,
          cable: (vehicleId: number) => scene?.cable(vehicleId) ?? null,
          plotted: () => plots.times(),
          /** Of the newest step, frame W. */
          pose: (vehicleId: number) => {
            const pose = newest.find((candidate) => candidate.vehicleId === vehicleId);
            return pose ? { quad: Array.from(pose.quad), load: Array.from(pose.load), attitude: Array.from(pose.attitude) } : null;
          },
          ...own,
        },
      });
    },
  };
}

function makeScene(): Scene | null {
  try {
    return new Scene(find<HTMLCanvasElement>("canvas"));
  } catch {
    find("scene").hidden = true;
    find("cameras").hidden = find("fit").hidden = true;
    document.querySelector<HTMLElement>(".key-list")!.hidden = true;
    return null;
  }
}

function setUpTheme(): void {
  const root = document.documentElement;
  const system = matchMedia("(prefers-color-scheme: light)");
  const key = "sls-theme";
  const load = () => {
    try {
      return localStorage.getItem(key);
    } catch {
      return null; // not allowed on a page from a file
    }
  };
  const apply = () => void (root.dataset.theme = load() ?? (system.matches ? "light" : "dark"));
  apply();
  system.addEventListener("change", apply);
  find("theme").addEventListener("click", () => {
    const theme = root.dataset.theme === "dark" ? "light" : "dark";
    try {
      localStorage.setItem(key, theme);
    } catch {
      // The setting then lasts as long as the page.
    }
    root.dataset.theme = theme;
  });
}

function setUpKeys(): void {
  const dialog = find<HTMLDialogElement>("keys");
  const list = make("dl", {}, ...listKeys(kKeys));
  const close = make("button", { type: "button" }, "Close");
  close.addEventListener("click", () => dialog.close());
  dialog.replaceChildren(make("h2", { id: "keys-title" }, "Keys"), list, make("div", { class: "buttons" }, close));
  find("help").addEventListener("click", () => dialog.showModal());
  document.addEventListener("keydown", (event) => {
    if (event.key === "?" && !isTyping(event)) dialog.showModal();
  });
}

/** Elements of the list of keys: `keys`, then those that live flights and recordings have. */
export function listKeys(keys: [string, string][]): HTMLElement[] {
  return [...keys, ...kSharedKeys].flatMap(([key, text]) => [make("dt", {}, make("kbd", {}, key)), make("dd", {}, text)]);
}

/** Positions as numbers, the alternative to the scene. Not updated while it is hidden. */
class Table {
  private readonly root = find("table");
  private readonly toggle = find<HTMLButtonElement>("table-toggle");
  private readonly body = make("tbody");
  private readonly rows = new Map<number, HTMLTableRowElement>();
  private pick: (vehicleId: number) => void = () => {};
  private selected = 0;
  private lastTime = 0;
  private lastText = 0;

  constructor(hasScene: boolean) {
    const names = ["Vehicle", "quad x m", "y m", "z m", "load x m", "y m", "z m", "load off reference m"];
    const head = make("tr", {}, ...names.map((name) => make("th", { scope: "col" }, name)));
    this.root.append(make("table", {}, make("thead", {}, head), this.body));
    this.toggle.addEventListener("click", () => this.show(this.root.hidden));
    if (hasScene) return;
    this.show(true);
    this.toggle.hidden = true;
    this.root.prepend(make("p", { class: "quiet", id: "no-webgl" },
      "This browser has no WebGL; this table shows the positions instead (frame W, z down)."));
  }

  onPick(act: (vehicleId: number) => void): void {
    this.pick = act;
  }

  setRun(run: Run): void {
    this.rows.clear();
    for (const { id } of run.vehicles) {
      const row = make("tr", {}, make("td", {}, String(id)), ...Array.from({ length: 7 }, () => make("td", {}, "–")));
      row.addEventListener("click", () => this.pick(id));
      this.rows.set(id, row);
    }
    this.body.replaceChildren(...this.rows.values());
    this.select(this.selected);
  }

  select(vehicleId: number): void {
    this.selected = vehicleId;
    for (const [id, row] of this.rows) row.setAttribute("aria-selected", String(id === vehicleId && this.rows.size > 1));
    this.lastText = 0;
  }

  offer(simTime: number, poses: readonly Pose[]): void {
    const now = performance.now();
    if (now - this.lastText > kTextTime) {
      this.lastText = now;
      this.describe(simTime, poses);
    }
    if (this.root.hidden || now - this.lastTime < kTableTime) return;
    this.lastTime = now;
    for (const pose of poses) {
      const cells = this.rows.get(pose.vehicleId)?.cells;
      if (!cells) continue;
      const numbers = [...Array.from(pose.quad).slice(0, 3), ...Array.from(pose.load).slice(0, 3), distance(pose.load, pose.reference)];
      numbers.forEach((value, index) => setText(cells[index + 1]!, format(value)));
    }
  }

  private describe(simTime: number, poses: readonly Pose[]): void {
    const pose = poses.find(({ vehicleId }) => vehicleId === this.selected);
    if (!pose) return;
    const place = (point: ArrayLike<number>) => `x ${format(point[0]!)}, y ${format(point[1]!)}, height ${format(-point[2]!)} m`;
    const text = `At ${simTime.toFixed(1)} s vehicle ${pose.vehicleId}: quadrotor ${place(pose.quad)}; load ${place(pose.load)}; ` +
      `load off its reference by ${format(distance(pose.load, pose.reference))} m.`;
    setText(find("scene-text"), text);
  }

  private show(isShown: boolean): void {
    this.root.hidden = !isShown;
    this.toggle.setAttribute("aria-pressed", String(isShown));
  }
}

function format(value: number): string {
  return Number.isFinite(value) ? value.toFixed(3).replace("-", "−") : "–";
}

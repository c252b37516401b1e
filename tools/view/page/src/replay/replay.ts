/** The page for one or two recordings: from sls_view, or from the page itself. */
import { findLoad } from "../cables";
import { find, make, setText } from "../dom";
import { showBanner, showLines, showPhase, showRun, showStage, showTime } from "../panels";
import { listKeys, makeShell, type Shell } from "../shell";
import type { PageMode, RunIndex, Trail } from "../types";
import { loadRecording } from "./load";
import { Player } from "./player";
import { distance, findRow, type RecordedFault, type Recording } from "./recording";
import { formatTime, Timeline, type TimelineMark } from "./timeline";

const kTrailSpacing = 0.04; // s of simulated time between two points
const kMostTrailPoints = 1400;
const kShortFlight = 60; // s that plots show at once
const kMostSamples = 4000; // of a comparison

const kKeys: [string, string][] = [
  ["Space", "play or pause"],
  [", .", "one row back or on"],
  ["< >", "slower or faster"],
  ["P N", "previous or next mark"],
  ["L", "loop"],
];

/** Shows the recordings of `mode`, or on the page the error that they have. */
export async function startReplay(mode: PageMode): Promise<void> {
  const shell = makeShell();
  find("link").hidden = true;
  showPhase("loading");
  try {
    const recordings = await Promise.all((mode.recordings ?? []).slice(0, 2).map(loadRecording));
    if (recordings.length === 0) throw new Error("expected a recording, got none");
    new Replay(shell, recordings);
  } catch (error) {
    showRun(null);
    showPhase("no recording");
    showBanner(error instanceof Error ? error.message : String(error));
  }
}

export class Replay {
  private readonly player: Player;
  private readonly timeline: Timeline;
  private readonly main: Recording;
  private readonly names: string[];
  private readonly apart: HTMLElement[] = [];
  private shownTime = NaN;
  private lastFrame = 0;

  constructor(
    private readonly shell: Shell,
    private readonly recordings: Recording[],
  ) {
    this.main = recordings[0]!;
    this.names = nameRecordings(recordings);
    this.player = new Player(
      Math.min(...recordings.map(({ from }) => from)), Math.max(...recordings.map(({ to }) => to)));
    recordings.forEach(({ run }, index) => shell.setRun(run, index as RunIndex));
    const list = this.makePanels();
    this.timeline = new Timeline(find("bar").appendChild(make("div")), {
      player: this.player,
      step: this.main.spacing,
      list,
      onSeek: () => this.jump(),
      describe: () => this.main.stageAt(shell.selected(), this.player.time),
    });
    shell.onSelect(() => this.showVehicle());
    shell.plots.onSeek((time) => {
      this.player.seek(time);
      this.jump();
    });
    this.describe();
    this.showVehicle();
    this.jump();
    this.expose();
    // No automatic start in a report, whose text is read first, or if the user prefers reduced motion.
    const isQuiet = window.parent !== window || matchMedia("(prefers-reduced-motion: reduce)").matches;
    if (!isQuiet) this.player.play();
    requestAnimationFrame((now) => this.drawFrame(now));
  }

  /** Shows recordings in place of participants, and marks in place of live events. */
  private makePanels(): HTMLElement {
    const panel = find("participants-panel");
    setText(panel.querySelector("h2")!, this.recordings.length > 1 ? "Recordings" : "Recording");
    setText(find("events-panel").querySelector("h2")!, "Stages, events and faults");
    find("keys").querySelector("dl")!.replaceChildren(...listKeys(kKeys));
    const list = find("events");
    list.setAttribute("role", "list");
    list.setAttribute("aria-live", "off");
    list.classList.add("timeline-marks");
    if (this.main.run.period_s * this.main.head.steps_total <= kShortFlight)
      find("windows").querySelector<HTMLButtonElement>("[data-window=all]")!.click();
    return list;
  }

  /** Shows the texts that do not change with time. */
  private describe(): void {
    const { head, run } = this.main;
    showRun(run);
    document.title = `${this.names.join(" and ")}: recording`;
    const incomplete = this.recordings.flatMap(({ head: { complete, outcome } }, index) =>
      complete ? [] : [`${this.recordings.length > 1 ? `${this.names[index]}: ` : ""}incomplete: ${outcome}`]);
    showPhase(head.complete ? head.outcome.split(":")[0]! : "incomplete");
    if (!head.complete) find("phase").dataset.phase = "failed";
    if (incomplete.length > 0) showBanner(incomplete.join("; "), "warn");
    const every = head.every > 1 ? ` (1 of ${head.every} shown)` : "";
    showLines([
      { name: "Outcome", text: head.outcome },
      { name: "Steps", text: `${head.steps_total}${every} · ${run.mode}, period ${+(run.period_s * 1000).toPrecision(4)} ms` },
      { name: "Flown", text: `${formatTime(this.main.from)} s to ${formatTime(this.main.to)} s` },
      { name: "Vehicles", text: `${this.main.vehicleIds.length}` },
    ]);
  }

  /** Shows plots, marks and comparison of the selected vehicle. */
  private showVehicle(): void {
    const vehicleId = this.shell.selected();
    this.shell.plots.setRun(this.main.run);
    this.recordings.forEach((recording, index) => {
      const rows = recording.rowsAs(this.main.columns, vehicleId);
      if (rows) this.shell.plots.replace(rows, index as RunIndex);
    });
    const marks = this.listMarks(vehicleId);
    this.timeline.setMarks(marks);
    this.shell.plots.setMarks(marks.flatMap((mark) =>
      mark.to === undefined ? [mark] : [mark, { ...mark, time: mark.to, text: `${mark.text} ends` }]));
    this.showRecordings(vehicleId);
    this.shownTime = NaN;
    this.show();
  }

  private listMarks(vehicleId: number): TimelineMark[] {
    return this.recordings.flatMap(({ head }, index) => {
      const name = index > 0 ? `${this.names[index]}: ` : "";
      const isOfVehicle = ({ vehicle }: { vehicle: number }) => vehicle === vehicleId;
      const stages = index > 0 ? [] : head.stage_starts.filter(isOfVehicle);
      return [
        ...stages.map(({ sim_time_s, name: stage }) => ({ time: sim_time_s, text: `stage ${stage}`, kind: "stage" as const })),
        ...head.events.map(({ sim_time_s, text }) => ({ time: sim_time_s, text: name + text, kind: "event" as const })),
        ...head.faults.filter(isOfVehicle).map((fault) => ({
          time: fault.from_s, to: fault.to_s, text: name + describeFault(fault), kind: "fault" as const })),
      ];
    });
  }

  private showRecordings(vehicleId: number): void {
    this.apart.length = 0;
    const value = () => {
      const element = make("dd");
      this.apart.push(element);
      return element;
    };
    const list = make("dl", { class: "timeline-recordings" });
    this.recordings.forEach(({ run }, index) => {
      const key = make("span", { class: `timeline-sample timeline-sample-${index}`, "aria-hidden": "true" });
      const note = index > 0 ? ", translucent" : "";
      list.append(make("dt", {}, key, this.names[index]!), make("dd", {}, `run ${run.run_id}${note}`));
      list.append(make("dt", {}, "load off reference"), value());
    });
    if (this.recordings.length > 1) {
      const largest = findLargestDistance(this.main, this.recordings[1]!, vehicleId);
      list.append(make("dt", {}, "loads apart"), value());
      list.append(make("dt", {}, "at most"), make("dd", { id: "most-apart" },
        Number.isFinite(largest.time) ? `${formatMetres(largest.distance)} at ${formatTime(largest.time)} s` : "–"));
    }
    find("participants").replaceChildren(list);
  }

  private drawFrame(now: number): void {
    const passed = Math.max(0, now - this.lastFrame) / 1000;
    this.lastFrame = now;
    if (this.player.advance(passed)) this.jump();
    else this.show();
    requestAnimationFrame((next) => this.drawFrame(next));
  }

  /** After a jump in time, sets the trails to the flight until that time. */
  private jump(): void {
    this.shownTime = NaN;
    this.show();
    this.recordings.forEach((recording, index) => {
      this.shell.scene?.resetTrails(index as RunIndex);
      for (const id of recording.vehicleIds)
        this.shell.scene?.setTrail(id, makeTrail(recording, id, this.player.time), index as RunIndex);
    });
  }

  private show(): void {
    const { time } = this.player;
    if (time !== this.shownTime) {
      this.shownTime = time;
      this.recordings.forEach((recording, index) => this.shell.setPoses(time, recording.posesAt(time), index as RunIndex));
      this.shell.plots.setCursor(time);
      this.showTexts(time);
    }
    this.timeline?.update();
  }

  private showTexts(time: number): void {
    const vehicleId = this.shell.selected();
    showTime(time);
    const stage = this.main.stageAt(vehicleId, time);
    const { stages } = this.main.run;
    showStage(stage, stages.indexOf(stage), stages.length);
    const loads = this.recordings.map((recording) =>
      recording.rowsOf(vehicleId)?.time.length ? recording.poseAt(vehicleId, time) : null);
    const texts = loads.map((pose) => formatMetres(pose ? distance(pose.load, pose.reference) : NaN));
    if (loads[0] && loads[1]) texts.push(formatMetres(distance(loads[0].load, loads[1].load)));
    this.apart.forEach((element, index) => setText(element, texts[index] ?? "–"));
  }

  private expose(): void {
    this.shell.expose({
      seek: (time: number) => {
        this.player.pause();
        this.player.seek(time);
        this.jump();
      },
      state: () => ({
        sim_time_s: this.player.time,
        is_playing: this.player.isPlaying,
        recordings: this.names,
        has_scene: this.shell.scene !== null,
      }),
    });
  }
}

/** Names by folder; recordings with the same name get numbers, too. */
function nameRecordings(recordings: Recording[]): string[] {
  const names = recordings.map(({ head }) => head.name);
  const isUnique = new Set(names).size === names.length;
  return isUnique ? names : names.map((name, index) => `${name} ${index + 1}`);
}

function describeFault({ kind, on }: RecordedFault): string {
  if (on) return `fault: ${kind} on ${on}`;
  if (kind === "held") return "no answer: last one held";
  return kind === "fail_safe" ? "no answer: fail-safe force" : `controller reports ${kind}`;
}

/** Trail of the flight until `time`. */
export function makeTrail(recording: Recording, vehicleId: number, time: number): Trail {
  const rows = recording.rowsOf(vehicleId)!;
  const last = findRow(rows.time, time);
  const stride = Math.max(1, Math.round(kTrailSpacing / recording.spacing));
  const [quad, load]: number[][] = [[], []];
  const [quadAt, loadAt] = [recording.columns.find("quad_x_m"), recording.columns.find("load_x_m")];
  const first = Math.max(0, last - stride * kMostTrailPoints);
  for (let row = first; row <= last; row += stride) {
    const at = row * rows.columns;
    quad!.push(...rows.values.subarray(at + quadAt, at + quadAt + 3));
    load!.push(...(recording.run.load
      ? Array.from(findLoad(recording.poseAt(vehicleId, rows.time[row]!), recording.run))
      : rows.values.subarray(at + loadAt, at + loadAt + 3)));
  }
  return { quad: quad!, load: load! };
}

/** Largest distance between the loads of one vehicle in two recordings, m, and when. */
function findLargestDistance(a: Recording, b: Recording, vehicleId: number): { distance: number; time: number } {
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
function formatMetres(length: number): string {
  return Number.isFinite(length) ? `${length.toPrecision(3)} m` : "–";
}

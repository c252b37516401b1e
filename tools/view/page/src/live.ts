/** The page for a live flight: uses subprotocol sls.view.1 and reconnects. */
import { find } from "./dom";
import { History } from "./history";
import { OperatorBar } from "./operator";
import {
  addEvent, clearEvents, showBanner, showEmpty, showLink, showPhase, showRun, showStage, showStatus, showTime, type Latency,
} from "./panels";
import { readKind, readPoses, readRows, type Poses } from "./protocol";
import { loadRecording } from "./replay/load";
import type { Recording } from "./replay/recording";
import { makeTrail, Replay } from "./replay/replay";
import { makeShell, type Shell } from "./shell";
import type { FlightEvent, Hello, Mark, NoRun, Reply, Run, Status } from "./types";

const kFirstWait = 250; // ms before the next try to connect
const kMostWait = 4000;
const kPanelTime = 250;
const kMostLatencies = 1000;
const kMostMarks = 300;
const kEndTime = 1000; // ms after a run has ended, in which its last rows come
const kFlushTime = 1000; // ms in which a recorder writes what it has

type Message =
  | ({ op: "hello" } & Hello)
  | { op: "run"; run: Run }
  | ({ op: "no_run" } & NoRun)
  | ({ op: "status" } & Status)
  | ({ op: "event" } & FlightEvent)
  | ({ op: "reply" } & Reply);

export function startLive(): void {
  new Live(makeShell());
}

/** Takes the token from the fragment, which is never sent to a server, and removes it from the address bar. */
function takeToken(): string {
  const token = new URLSearchParams(location.hash.slice(1)).get("token") ?? "";
  if (token) history.replaceState(null, "", location.pathname + location.search);
  return token;
}

class Live {
  private socket: WebSocket | null = null;
  private wait = kFirstWait;
  private token = takeToken();
  private run: Run | null = null;
  private status: Status | null = null;
  private newest: Poses | null = null;
  private drawnStep = -1;
  private marks: Mark[] = [];
  private readonly events = new Set<string>();
  private readonly latencies: number[] = [];
  private readonly bar: OperatorBar;
  private readonly channel = new MessageChannel();
  private readonly measured: number[] = [];
  private history: History | null = null;
  private panels = 0;
  private isEnding = false; // the run has ended, and its recording has been asked for
  private isOver = false; // the page is a replay
  /** What must come before what was flown until then is read from the recording. */
  private awaited: "status" | "rows" | "nothing" = "status";
  private missing = ""; // why it cannot be read

  constructor(private readonly shell: Shell) {
    this.bar = new OperatorBar(
      (id, action, steps) => this.send({ op: "control", id, action, steps }),
      (token) => {
        this.token = token;
        this.send({ op: "authenticate", token });
      },
    );
    shell.onSelect((vehicleId) => {
      this.showRows();
      this.send({ op: "select", vehicle_id: vehicleId });
    });
    shell.scene?.onDrawn(() => this.noteFrame());
    this.channel.port1.onmessage = () => this.noteDrawn();
    clearEvents();
    showPhase("connecting");
    this.panels = window.setInterval(() => this.showPanels(), kPanelTime);
    addEventListener("online", () => {
      this.wait = kFirstWait;
      this.retry();
    });
    shell.expose({ state: () => this.getState() });
    this.connect();
  }

  private connect(): void {
    const scheme = location.protocol === "https:" ? "wss" : "ws";
    const socket = new WebSocket(`${scheme}://${location.host}/`, "sls.view.1");
    socket.binaryType = "arraybuffer";
    this.socket = socket;
    socket.onopen = () => {
      this.wait = kFirstWait;
      this.awaited = "status";
      showLink("open", "connected");
      if (!this.isOver) showBanner(null);
      if (this.token) this.send({ op: "authenticate", token: this.token });
      if (this.run) this.send({ op: "select", vehicle_id: this.shell.selected() });
    };
    socket.onmessage = ({ data }) => this.receive(data as string | ArrayBuffer);
    socket.onclose = ({ reason }) => this.noteLost(socket, reason);
  }

  private noteLost(socket: WebSocket, reason: string): void {
    if (socket !== this.socket) return;
    this.socket = null;
    if (this.hasEnded()) void this.end();
    if (this.isOver || this.isEnding) return void setTimeout(() => this.retry(), kMostWait);
    showLink("lost", "not connected");
    const why = reason ? ` (${reason})` : "";
    const kept = this.run ? " The picture is the last one that came." : "";
    showBanner(`Connection to sls_view lost${why}; trying again.${kept}`);
    this.bar.setPhase(this.status?.phase ?? "", this.status?.step ?? 0, false);
    setTimeout(() => this.retry(), this.wait * (0.8 + 0.4 * Math.random()));
    this.wait = Math.min(kMostWait, 2 * this.wait);
  }

  private retry(): void {
    if (this.socket === null) this.connect();
  }

  private send(message: object): void {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(message));
  }

  private hasEnded(): boolean {
    return this.history !== null && /finished|failed/.test(this.status?.phase ?? "");
  }

  /** Waits for the last rows and the recording of a run that has ended. */
  private async end(): Promise<void> {
    if (this.isEnding) return;
    this.isEnding = true;
    const { run } = this;
    const [past] = await Promise.all([this.loadPast(), new Promise((resolve) => setTimeout(resolve, kEndTime))]);
    if (run === this.run && this.hasEnded()) this.becomeReplay(past);
  }

  /** Shows a run that has ended: its recording, or what has come. The next run is shown live, by a fresh page. */
  private becomeReplay(past: Recording | null): void {
    if (this.isOver) return;
    const { phase, reason, step } = this.status!;
    const isWhole = past !== null && !(this.newest && this.newest.simTime > past.to + this.run!.period_s / 2);
    if (past && !isWhole) this.history!.addPast(past);
    const recording = isWhole ? past : this.history!.toRecording(reason ? `${phase}: ${reason}` : phase, step);
    if (!recording) return;
    this.isOver = true;
    clearInterval(this.panels);
    this.newest = null;
    this.bar.setPhase("", 0, false);
    find("bar").replaceChildren();
    find("link").hidden = true;
    new Replay(this.shell, [recording]);
    const name = past?.head.name ?? "DIR";
    const folder = /^[\w./+:@-]+$/.test(name) ? name : `'${name.replaceAll("'", "'\\''")}'`;
    const source = isWhole ? "its recording" : `what the page received (${past ? "its recording ends earlier" : this.missing})`;
    showBanner(`The flight has ended. This is ${source}; ./sls view ${folder} shows the recording again.`, "note");
  }

  /** The recording of the run, as far as it is written; null: `missing` says why. */
  private async loadPast(): Promise<Recording | null> {
    const id = this.run!.run_id;
    try {
      const past = await loadRecording("/history");
      if (past.run.run_id !== id) throw new Error(`expected the recording of run ${id}, got that of ${past.run.run_id}`);
      this.missing = "";
      return past;
    } catch (error) {
      this.missing = (error as Error).message;
      return null;
    }
  }

  private async askForPast(): Promise<void> {
    const { history } = this;
    const past = await this.loadPast();
    if (past && history === this.history && !this.isEnding) this.addPast(past);
  }

  private addPast(past: Recording): void {
    const { run_id, period_s } = this.run!;
    this.history!.addPast(past);
    const flown = this.showRows()!;
    for (const id of flown.vehicleIds) this.shell.scene?.setTrail(id, makeTrail(flown, id, flown.to));
    if (!(this.newest && this.newest.simTime > flown.to - period_s / 2))
      this.receivePoses({
        runId: run_id, step: Math.round(flown.to / period_s), simTime: flown.to, publishedMs: NaN, poses: flown.posesAt(flown.to) });
  }

  /** Plots what has been flown; null: nothing. */
  private showRows(): Recording | null {
    const { plots } = this.shell;
    const flown = this.history?.toRecording("", 0) ?? null;
    if (this.run) plots.setRun(this.run);
    const rows = flown?.rowsOf(this.shell.selected());
    if (rows) plots.replace(rows);
    plots.setMarks(this.marks);
    return flown;
  }

  private receive(data: string | ArrayBuffer): void {
    if (this.isOver) return this.awaitRun(data);
    if (typeof data === "string") return this.receiveText(JSON.parse(data) as Message);
    const kind = readKind(data);
    if (kind === 1) this.receivePoses(readPoses(data));
    else if (kind === 2) this.receiveRows(data);
  }

  private awaitRun(data: string | ArrayBuffer): void {
    const message = typeof data === "string" ? (JSON.parse(data) as Message) : null;
    if (message?.op !== "run" || message.run.run_id === this.run?.run_id) return;
    if (this.token) location.hash = new URLSearchParams({ token: this.token }).toString();
    location.reload();
  }

  private receiveText(message: Message): void {
    switch (message.op) {
      case "hello":
        this.bar.setHello(message);
        break;
      case "run":
        this.setRun(message.run);
        break;
      case "no_run":
        this.noteNoRun(message);
        break;
      case "status":
        this.status = { ...message, phase: message.phase.toLowerCase() };
        this.bar.setPhase(this.status.phase, this.status.step, true);
        this.history?.addStage(this.status);
        if (this.hasEnded()) void this.end();
        else if (this.awaited === "status" && this.run) {
          this.awaited = this.status.step > 0 ? "rows" : "nothing";
          if (this.status.step > 0) void this.askForPast();
        }
        break;
      case "event":
        this.noteEvent(message);
        break;
      case "reply":
        this.bar.showReply(message);
        break;
    }
  }

  private setRun(run: Run): void {
    showRun(run);
    showBanner(null); // of no_run
    if (this.run?.run_id === run.run_id) return; // the same run after a reconnection
    this.run = run;
    this.history = new History(run);
    this.isEnding = false;
    this.missing = "";
    this.awaited = "status";
    this.status = null;
    this.newest = null;
    this.marks = [];
    this.events.clear();
    this.latencies.length = 0;
    clearEvents();
    showTime(NaN);
    showPhase("waiting");
    this.shell.setRun(run);
    this.shell.scene?.resetTrails();
  }

  private noteNoRun(missing: NoRun): void {
    if (this.run) {
      // The last flight stays in the picture.
      showBanner(`${missing.text} ${missing.command}`, "warn");
      showPhase(this.status?.phase ?? "no flight");
    } else {
      showRun(null);
      showPhase("no flight");
      showEmpty(missing);
    }
    this.bar.setPhase("", 0, true);
  }

  private noteEvent(event: FlightEvent): void {
    const key = `${event.run_id} ${event.step} ${event.text}`;
    if (this.events.has(key)) return; // every connection sends the past events again
    this.events.add(key);
    if (/not ready$/.test(event.text)) return; // the status says it while it is so
    addEvent(event);
    this.history?.events.push(event);
    this.marks = [...this.marks.slice(1 - kMostMarks), { time: event.sim_time_s, text: event.text, kind: kindOf(event.text) }];
    this.shell.plots.setMarks(this.marks);
  }

  private receivePoses(poses: Poses): void {
    if (poses.runId !== this.run?.run_id) return;
    this.newest = poses;
    this.history?.addPoses(poses.simTime, poses.poses, this.shell.selected());
    this.shell.setPoses(poses.simTime, poses.poses);
  }

  private receiveRows(data: ArrayBuffer): void {
    const rows = readRows(data);
    if (rows.runId !== this.run?.run_id || rows.vehicleId !== this.shell.selected()) return;
    this.history?.addRows(rows);
    this.shell.plots.append(rows);
    if (this.awaited !== "rows") return;
    this.awaited = "nothing";
    setTimeout(() => void this.askForPast(), kFlushTime);
  }

  /** Measures the latency up to a message through a channel, which arrives after layout and paint of the frame. */
  private noteFrame(): void {
    if (!this.newest || this.newest.step === this.drawnStep) return;
    this.drawnStep = this.newest.step;
    showTime(this.newest.simTime);
    if (Number.isNaN(this.newest.publishedMs)) return; // of the recording
    this.measured.push(this.newest.publishedMs);
    this.channel.port2.postMessage(0);
  }

  private noteDrawn(): void {
    const now = performance.timeOrigin + performance.now();
    for (const published of this.measured.splice(0)) this.latencies.push(now - published);
    if (this.latencies.length > kMostLatencies) this.latencies.splice(0, this.latencies.length - kMostLatencies);
  }

  private calcLatency(): Latency {
    const sorted = [...this.latencies].sort((a, b) => a - b);
    const at = (part: number) => sorted[Math.min(sorted.length - 1, Math.floor(part * sorted.length))] ?? NaN;
    return { p50: at(0.5), p99: at(0.99), count: sorted.length };
  }

  private showPanels(): void {
    if (!this.status || document.hidden) return;
    if (this.newest && !this.shell.scene) showTime(this.newest.simTime);
    else if (!this.newest) showTime(this.status.sim_time_s);
    const stages = this.run?.stages ?? [];
    const stage = this.status.stage || (stages.length === 1 ? stages[0]! : "");
    showStage(stage, stages.indexOf(stage), stages.length);
    showStatus(this.status, this.run, this.calcLatency(), this.shell.scene?.fps() ?? 0, this.missing && `not shown: ${this.missing}`);
  }

  private getState() {
    return {
      is_connected: this.socket?.readyState === WebSocket.OPEN,
      phase: this.status?.phase ?? null,
      step: this.newest?.step ?? null,
      sim_time_s: this.newest?.simTime ?? null,
      selected: this.shell.selected(),
      has_scene: this.shell.scene !== null,
    };
  }
}

function kindOf(text: string): Mark["kind"] {
  if (/fault/i.test(text)) return "fault";
  return /stage/i.test(text) ? "stage" : "event";
}

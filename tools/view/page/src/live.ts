/** The page for a live flight: uses subprotocol sls.view.1 and reconnects. */
import { find } from "./dom";
import { History } from "./history";
import { OperatorBar } from "./operator";
import {
  addEvent, clearEvents, showBanner, showEmpty, showLink, showPhase, showRun, showStage, showStatus, showTime, type Latency,
} from "./panels";
import { readKind, readPoses, readRows, type Poses } from "./protocol";
import { Replay } from "./replay/replay";
import { makeShell, type Shell } from "./shell";
import type { FlightEvent, Hello, Mark, NoRun, Reply, Run, Status } from "./types";

const kFirstWait = 250; // ms before the next try to connect
const kMostWait = 4000;
const kPanelTime = 250;
const kMostLatencies = 1000;
const kMostMarks = 300;
const kEndTime = 1000; // ms after a run has ended, in which its last rows come

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
  private isOver = false; // the page is a replay

  constructor(private readonly shell: Shell) {
    this.bar = new OperatorBar(
      (id, action, steps) => this.send({ op: "control", id, action, steps }),
      (token) => {
        this.token = token;
        this.send({ op: "authenticate", token });
      },
    );
    shell.onSelect((vehicleId) => {
      if (this.run) shell.plots.setRun(this.run);
      shell.plots.setMarks(this.marks);
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
    if (this.hasEnded()) this.becomeReplay();
    if (this.isOver) return void setTimeout(() => this.retry(), kMostWait);
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

  /** Shows what has come of a run that has ended. The next run is shown live, by a fresh page. */
  private becomeReplay(): void {
    if (this.isOver) return;
    const { phase, reason, step } = this.status!;
    const recording = this.history!.toRecording(reason ? `${phase}: ${reason}` : phase, step);
    if (!recording) return;
    this.isOver = true;
    clearInterval(this.panels);
    this.newest = null;
    this.bar.setPhase("", 0, false);
    find("bar").replaceChildren();
    find("link").hidden = true;
    new Replay(this.shell, [recording]);
    showBanner(`The flight has ended. This replay has what the page received; ./sls view DIR shows the whole recording.`, "note");
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
        if (this.hasEnded()) setTimeout(() => this.hasEnded() && this.becomeReplay(), kEndTime);
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
  }

  /** Measures the latency up to a message through a channel, which arrives after layout and paint of the frame. */
  private noteFrame(): void {
    if (!this.newest || this.newest.step === this.drawnStep) return;
    this.drawnStep = this.newest.step;
    showTime(this.newest.simTime);
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
    showStatus(this.status, this.run, this.calcLatency(), this.shell.scene?.fps() ?? 0);
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

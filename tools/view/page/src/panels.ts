/** The page's texts and numbers: run, participants, events, missing data. */
import { find, make, setText } from "./dom";
import type { FlightEvent, NoRun, Participant, Run, Status } from "./types";

const kMostEvents = 500;
const kFaultWords = /fault|failed|refused|lost|silent|gone|error|dead/i;

export interface Latency {
  p50: number;
  p99: number;
  count: number;
}

export function showRun(run: Run | null): void {
  setText(find("scenario"), run ? run.scenario : "No flight");
  setText(find("run-id"), run ? run.run_id : "");
  document.title = run ? `${run.scenario}: flight` : "Flight";
  if (run) showEmpty(null);
}

export function showPhase(phase: string): void {
  const pill = find("phase");
  setText(pill, phase);
  pill.dataset.phase = phase;
}

export function showTime(simTime: number): void {
  setText(find("clock"), Number.isFinite(simTime) ? simTime.toFixed(2) : "–");
}

export function showStage(stage: string, index: number, count: number): void {
  setText(find("stage"), stage ? (count > 1 && index >= 0 ? `${stage} (${index + 1} of ${count})` : stage) : "");
}

export function showLink(state: "open" | "lost" | "connecting", text: string): void {
  const link = find("link");
  setText(link, text);
  link.title = text;
  link.dataset.state = state;
}

export function showBanner(text: string | null, kind: "bad" | "warn" | "note" = "bad"): void {
  const banner = find("banner");
  banner.hidden = text === null;
  banner.dataset.kind = kind;
  if (text !== null) setText(banner, text);
}

/** Shows in place of the scene that there is no flight, and how to start one. */
export function showEmpty(missing: NoRun | null): void {
  const sheet = find("empty");
  sheet.hidden = missing === null;
  if (!missing) return;
  const copy = make("button", { type: "button", id: "copy" }, "Copy");
  copy.addEventListener("click", () => void copyText(missing.command, copy));
  sheet.replaceChildren(
    make("p", { class: "lead" }, "No flight yet"),
    make("p", {}, missing.text),
    make("div", { class: "command" }, make("code", { class: "mono", id: "command" }, missing.command), copy),
  );
}

async function copyText(text: string, button: HTMLButtonElement): Promise<void> {
  try {
    await navigator.clipboard.writeText(text);
    setText(button, "Copied");
  } catch {
    getSelection()?.selectAllChildren(find("command"));
    setText(button, "Selected");
  }
}

interface Line {
  name: string;
  text: string;
  title?: string;
  kind?: "warn" | "bad";
}

/** Shows the list of the run. Elements stay, only their texts change. */
export function showLines(lines: readonly Line[]): void {
  const list = find("status");
  while (list.children.length > 2 * lines.length) list.lastElementChild!.remove();
  lines.forEach(({ name, text, kind }, index) => {
    if (list.children.length <= 2 * index) list.append(make("dt"), make("dd"));
    const [term, value] = [list.children[2 * index] as HTMLElement, list.children[2 * index + 1] as HTMLElement];
    setText(term, name);
    term.title = lines[index]!.title ?? "";
    setText(value, text);
    value.className = kind ?? "";
  });
}

/** `missing`: why the page does not show the steps before it was opened, or empty. */
export function showStatus(status: Status, run: Run | null, drawn: Latency, fps: number, missing: string): void {
  showPhase(status.phase);
  const lines: Line[] = [];
  const add = (name: string, text: string, kind?: "warn" | "bad") => {
    if (text) lines.push({ name, text, ...(kind ? { kind } : {}) });
  };
  add("Problem", status.problem, "bad");
  if (status.is_silent) add("Server", `silent for ${status.silence_s.toFixed(1)} s`, "bad");
  add("Waits for", ([] as string[]).concat(status.waiting_for ?? []).join(", "), "warn");
  add("Reason", status.reason, status.phase === "failed" ? "bad" : undefined);
  const period = run ? `, period ${+(run.period_s * 1000).toPrecision(4)} ms` : "";
  add("Step", `${format(status.step)}${run ? ` · ${run.mode}${period}` : ""}`);
  const wanted = run && run.real_time_factor > 0 ? ` (target ${run.real_time_factor})` : "";
  add("Earlier steps", missing);
  add("Real-time factor", status.real_time_factor > 0 ? `${status.real_time_factor.toFixed(3)}${wanted}` : "");
  add("Timing", status.timing);
  add("Controller", status.controller);
  if (status.round_trip_p50_us > 0)
    add("Round trip", `p50 ${Math.round(status.round_trip_p50_us)} · p99 ${Math.round(status.round_trip_p99_us)} µs`);
  if (drawn.count > 0)
    lines.push({
      name: "Published → drawn", text: `p50 ${drawn.p50.toFixed(0)} · p99 ${drawn.p99.toFixed(0)} ms · ${fps} frames/s`,
      title: "From when the server published a step until this page had drawn it; only valid on one machine" });
  const counters = Object.entries(status.counters).filter(([, value]) => value > 0);
  add("Counters", counters.map(([name, value]) => `${name.replaceAll("_", " ")} ${format(value)}`).join(" · "), "warn");
  showLines(lines);
  showParticipants(status.participants);
  const factor = status.real_time_factor > 0 ? `× ${status.real_time_factor.toFixed(2)}` : "";
  setText(find("facts"), [factor, `step ${format(status.step)}`].filter(Boolean).join(" · "));
}

function showParticipants(participants: readonly Participant[]): void {
  const place = find("participants");
  const rows = participants.map((participant) => {
    const state = participant.done ? "done" : participant.ready ? "ready" : "not ready";
    const last = participant.role.includes("recorder") && participant.last_complete_step >= 0
      ? format(participant.last_complete_step) : "–";
    return [participant.role, participant.name, participant.host, state, last];
  });
  const key = JSON.stringify(rows);
  if (place.dataset.key === key) return;
  place.dataset.key = key;
  if (rows.length === 0) return place.replaceChildren(make("p", { class: "quiet" }, "None yet"));
  const head = ["Role", "Name", "Host", "State", "Rows to"].map((name) =>
    make("th", name === "Rows to" ? { scope: "col", title: "The recorder has written all rows up to this step" } : { scope: "col" }, name));
  const body = rows.map((cells) =>
    make("tr", {}, ...cells.map((cell, column) => {
      const kind = column !== 3 ? (column === 1 ? "name" : "") : cell === "not ready" ? "warn" : "good";
      return make("td", kind ? { class: kind } : {}, cell);
    })));
  place.replaceChildren(make("table", {}, make("thead", {}, make("tr", {}, ...head)), make("tbody", {}, ...body)));
}

/** Adds an event at the top and removes the oldest beyond the limit. */
export function addEvent(event: Pick<FlightEvent, "sim_time_s" | "step" | "text">): void {
  const list = find("events");
  list.querySelector(".none")?.remove();
  const time = make("time", { title: `step ${event.step}` }, `${event.sim_time_s.toFixed(2)} s`);
  list.prepend(make("li", kFaultWords.test(event.text) ? { class: "fault" } : {}, time, make("span", {}, event.text)));
  while (list.children.length > kMostEvents) list.lastElementChild!.remove();
}

export function clearEvents(): void {
  find("events").replaceChildren(make("li", { class: "none" }, "None yet"));
}

/** 12345 → "12 345" with narrow spaces. */
function format(value: number): string {
  return String(value).replace(/\B(?=(\d{3})+$)/g, "\u202f");
}

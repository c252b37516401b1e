/** Buttons that send requests to the server. Shows the reply; asks the user before requests that cannot be undone. */
import { confirmAction, find, isTyping, make, makeIcon, setText } from "./dom";
import type { Action, Hello, Reply } from "./types";

const kIcons: Record<Action, string> = {
  start: "M4 2l10 6-10 6z",
  resume: "M2 2h2.5v12H2zM6.5 2L15 8l-8.500 6z",
  pause: "M3 2h3.500v12H3zM9.500 2H13v12H9.500z",
  step: "M3 2l7 6-7 6zM11 2h2.500v12H11z",
  reset: "M8 2a6 6 0 1 1-5.700 4.100l1.900.6A4 4 0 1 0 8 4v2.500L3.800 3.200 8 0z",
  stop: "M3 3h10v10H3z",
};
const kKeys: Record<Action, string> = { start: "Space", pause: "Space", resume: "Space", step: "N", reset: "Shift+R", stop: "Shift+S" };
const kAnswerTime = 10_000; // ms after which a missing reply is shown; steps may take longer

export class OperatorBar {
  private readonly bar = find("bar");
  private readonly buttons = new Map<Action, HTMLButtonElement>();
  private readonly steps = make("input", { type: "number", min: "1", max: "1000000", value: "1", "aria-label": "Number of steps" });
  private readonly reply = make("span", { class: "reply", role: "status", "aria-live": "polite", id: "reply" });
  private hello: Hello | null = null;
  private phase = "";
  private step = 0;
  private isConnected = false;
  private nextId = 1;
  private waiting: { id: number; action: Action; timer: number } | null = null;

  constructor(
    private readonly ask: (id: number, action: Action, steps: number) => void,
    private readonly authenticate: (token: string) => void,
  ) {
    document.addEventListener("keydown", (event) => this.handleKey(event));
  }

  setHello(hello: Hello): void {
    this.hello = hello;
    this.build();
  }

  /** Disables buttons whose request the server would refuse. */
  setPhase(phase: string, step: number, isConnected: boolean): void {
    if (phase === this.phase && isConnected === this.isConnected && (step === 0) === (this.step === 0)) return;
    [this.phase, this.step, this.isConnected] = [phase, step, isConnected];
    this.update();
  }

  showReply(reply: Reply): void {
    if (this.waiting?.id === reply.id) {
      clearTimeout(this.waiting.timer);
      this.waiting = null;
    }
    const text = reply.accepted
      ? `${reply.action} done at step ${reply.step}`
      : `${reply.action} ${reply.action === "step" ? "not carried out" : "refused"}: ${reply.reason}`;
    this.say(text, reply.accepted ? "good" : "bad");
    this.update();
  }

  private build(): void {
    this.buttons.clear();
    if (!this.hello?.may_operate) return this.buildReadOnly();
    const groups = [["start", "resume", "pause", "step"], ["reset", "stop"]] as const;
    const [run, end] = groups.map((actions) =>
      make("div", { class: "group", role: "group" }, ...actions.map((action) => this.makeButton(action))));
    run!.setAttribute("aria-label", "Resume or pause the run");
    run!.append(this.steps);
    end!.setAttribute("aria-label", "End the run");
    this.bar.replaceChildren(run!, make("span", { class: "gap" }), end!, this.reply);
    this.update();
  }

  private buildReadOnly(): void {
    const why = make("span", { class: "why" }, `View only: ${this.hello?.why_not || "this page may not operate"}`);
    const parts: HTMLElement[] = [why];
    if (this.hello?.needs_token) {
      const field = make("input", { type: "password", autocomplete: "off", "aria-label": "Operator's token", placeholder: "token" });
      const form = make("form", {}, field, make("button", { type: "submit" }, "Unlock"));
      form.addEventListener("submit", (event) => {
        event.preventDefault();
        if (field.value) this.authenticate(field.value);
      });
      parts.push(form);
    }
    this.bar.replaceChildren(...parts, this.reply);
  }

  private makeButton(action: Action): HTMLButtonElement {
    const name = action[0]!.toUpperCase() + action.slice(1);
    const button = make("button", { type: "button", "data-action": action, "aria-label": name, title: `${name} (${kKeys[action]})` });
    button.append(makeIcon(kIcons[action]), make("span", { class: "label" }, name));
    button.addEventListener("click", () => void this.request(action));
    this.buttons.set(action, button);
    return button;
  }

  private isPossible(action: Action): boolean {
    if (!this.isConnected || !this.hello?.may_operate) return false;
    const isPaused = this.phase === "paused";
    const isGoing = this.phase === "running" || this.phase === "waiting";
    if (action === "pause") return isGoing;
    if (action === "step") return isPaused && this.waiting?.action !== "step";
    if (action === "start") return isPaused && this.step === 0;
    if (action === "resume") return isPaused && this.step > 0;
    return isPaused || isGoing;
  }

  private update(): void {
    for (const [action, button] of this.buttons) {
      const isPossible = this.isPossible(action);
      const hadFocus = document.activeElement === button;
      button.disabled = !isPossible;
      const isNext = isPossible && (action === "start" || action === "resume");
      button.classList.toggle("primary", isNext);
      if (action === "start") button.hidden = !(this.step === 0);
      if (action === "resume") button.hidden = this.step === 0;
      if (hadFocus && !isPossible) this.bar.focus({ preventScroll: true });
    }
  }

  private async request(action: Action): Promise<void> {
    if (!this.isPossible(action)) return;
    if (action === "reset" && !(await confirmAction("Reset the run?", "The run ends and restarts from step 0 with a new run id.", "Reset"))) return;
    if (action === "stop" && !(await confirmAction("Stop the run?", "It ends as failed. The server and its participants leave.", "Stop"))) return;
    if (!this.isPossible(action)) return this.say(`${action}: no longer possible, the run is ${this.phase}`, "bad");
    const id = this.nextId++;
    if (this.waiting) clearTimeout(this.waiting.timer);
    const timer = window.setTimeout(() => this.say(`${action}: no reply yet`, "bad"), kAnswerTime);
    this.waiting = { id, action, timer };
    this.say(`${action} …`, "");
    this.ask(id, action, action === "step" ? Math.max(1, Math.floor(Number(this.steps.value) || 1)) : 0);
    this.update();
  }

  private say(text: string, kind: "good" | "bad" | ""): void {
    setText(this.reply, text);
    this.reply.dataset.kind = kind;
  }

  private handleKey(event: KeyboardEvent): void {
    if (isTyping(event) || event.ctrlKey || event.metaKey || event.altKey || event.repeat) return;
    const isButton = (event.target as HTMLElement).matches("button, summary, a");
    let actions: Action[] = [];
    if (event.key === " " && !isButton) actions = ["pause", "start", "resume"];
    else if (event.key === "n" || event.key === "N") actions = ["step"];
    else if (event.key === "R") actions = ["reset"];
    else if (event.key === "S") actions = ["stop"];
    const action = actions.find((candidate) => this.isPossible(candidate));
    if (event.key === " " && !isButton && this.buttons.size > 0) event.preventDefault();
    if (!action) return;
    event.preventDefault();
    void this.request(action);
  }
}

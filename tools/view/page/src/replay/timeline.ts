/** Slider, buttons and list of marks of a replay. */
import { isTyping, make } from "../dom";
import { kSpeeds, type Player } from "./player";
import type { Mark } from "../types";

/** A mark that may be an interval: `to` is its end. */
export interface TimelineMark extends Mark {
  to?: number;
}

export interface TimelineOptions {
  player: Player;
  /** Seconds for one press of an arrow key: the time between two rows. */
  step: number;
  /** The list that holds the buttons of the marks. */
  list: HTMLElement;
  onSeek(): void;
  /** Text beside the time: the stage. */
  describe(): string;
}

export class Timeline {
  private readonly slider: HTMLInputElement;
  private readonly playButton = make("button", { type: "button", class: "timeline-play primary" });
  private readonly speed = make("select");
  private readonly loop = make("input", { type: "checkbox" });
  private readonly label = make("output", { class: "timeline-time", "aria-live": "off" });
  private readonly stage = make("span", { class: "timeline-now" });
  private readonly band = make("div", { class: "timeline-band", "aria-hidden": "true" });
  private marks: TimelineMark[] = [];

  constructor(
    element: HTMLElement,
    private readonly options: TimelineOptions,
  ) {
    const { player } = options;
    element.classList.add("timeline");
    this.playButton.addEventListener("click", () => this.toggle());
    this.slider = make("input", {
      type: "range", class: "timeline-slider", id: "time", "aria-label": "Simulated time",
      min: `${player.from}`, max: `${player.to}`, step: "any",
    });
    this.slider.addEventListener("input", () => this.seek(Number(this.slider.value)));
    const track = make("div", { class: "timeline-track" }, this.band, this.slider);

    this.speed.append(...kSpeeds.map((speed) => new Option(`${speed}×`, `${speed}`, speed === 1, speed === 1)));
    this.speed.addEventListener("change", () => {
      player.setSpeed(Number(this.speed.value));
      this.update();
    });
    this.loop.addEventListener("change", () => (player.loops = this.loop.checked));
    const controls = make("div", { class: "timeline-controls" }, this.playButton, this.label, this.stage,
      make("label", {}, "Speed ", this.speed), make("label", {}, "Loop ", this.loop));
    element.append(controls, track);
    document.addEventListener("keydown", (event) => this.handleKey(event));
    this.update();
  }

  setMarks(marks: TimelineMark[]): void {
    this.marks = [...marks].sort((a, b) => a.time - b.time);
    const { from, to } = this.options.player;
    const place = (time: number) => `${(100 * (Math.min(to, Math.max(from, time)) - from)) / Math.max(to - from, 1e-9)}%`;
    let lane = 0;
    this.band.replaceChildren(
      ...this.marks.map((mark) => {
        const tick = make("span", { class: `timeline-mark timeline-${mark.kind}`, title: mark.text });
        tick.style.left = place(mark.time);
        if (mark.to !== undefined) {
          tick.style.right = `calc(100% - ${place(mark.to)})`;
          tick.style.top = `${1 + 4 * (lane++ % 3)}px`; // faults overlap in time
        }
        return tick;
      }),
    );
    this.options.list.replaceChildren(
      ...this.marks.map((mark) => {
        const time = make("time", {}, `${formatTime(mark.time)} s`);
        const key = make("span", { class: `timeline-key timeline-${mark.kind}` });
        const button = make("button", { type: "button" }, time, key, mark.text);
        button.addEventListener("click", () => this.seek(mark.time));
        return make("li", {}, button);
      }),
    );
  }

  /** Shows the state of the player. */
  update(): void {
    const { player } = this.options;
    const text = player.isPlaying ? "Pause" : "Play";
    if (this.playButton.textContent !== text) {
      this.playButton.textContent = text;
      this.playButton.setAttribute("aria-label", `${text} (space)`);
    }
    this.slider.value = `${player.time}`;
    const label = `${formatTime(player.time)} / ${formatTime(player.to)} s`;
    const stage = this.options.describe();
    this.label.textContent = label;
    this.stage.textContent = stage;
    this.slider.setAttribute("aria-valuetext", stage ? `${label}, ${stage}` : label);
    this.speed.value = `${player.speed}`;
    this.loop.checked = player.loops;
  }

  private toggle(): void {
    const { player } = this.options;
    const from = player.time;
    if (player.isPlaying) player.pause();
    else player.play();
    if (player.time !== from) this.options.onSeek();
    this.update();
  }

  private seek(time: number): void {
    this.options.player.seek(time);
    this.options.onSeek();
    this.update();
  }

  /** Jumps to the mark before or after the time that is shown. */
  private seekMark(direction: 1 | -1): void {
    const { time } = this.options.player;
    const others = this.marks.filter((mark) => (mark.time - time) * direction > 1e-6);
    const next = direction > 0 ? others[0] : others[others.length - 1];
    if (next) this.seek(next.time);
  }

  private handleKey(event: KeyboardEvent): void {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const target = event.target as HTMLElement;
    const { player, step } = this.options;
    const move = { ArrowLeft: -1, ArrowRight: 1, PageDown: -10, PageUp: 10, ",": -1, ".": 1 }[event.key];
    const actions: Record<string, () => void> = {
      " ": () => this.toggle(),
      "<": () => player.changeSpeed(-1),
      ">": () => player.changeSpeed(1),
      n: () => this.seekMark(1),
      p: () => this.seekMark(-1),
      l: () => void (player.loops = !player.loops),
    };
    if (target === this.slider && move) this.seek(player.time + move * step);
    else if (target !== this.slider && isTyping(event)) return;
    else if (event.key === " " && target.matches("button, summary")) return;
    else if (event.key === "," || event.key === ".") this.seek(player.time + move! * step);
    else if (actions[event.key]) actions[event.key]!();
    else return;
    event.preventDefault();
    this.update();
  }
}

/** Seconds with two decimals. */
export function formatTime(seconds: number): string {
  return seconds.toFixed(2);
}

/** The simulated time that is shown, and its progress. No drawing here. */

export const kSpeeds = [0.1, 0.25, 0.5, 1, 2, 5, 10] as const;

export class Player {
  time: number;
  isPlaying = false;
  loops = false;
  private speedIndex = kSpeeds.indexOf(1);

  constructor(
    readonly from: number,
    readonly to: number,
  ) {
    this.time = from;
  }

  get speed(): number {
    return kSpeeds[this.speedIndex]!;
  }

  setSpeed(speed: number): void {
    const index = (kSpeeds as readonly number[]).indexOf(speed);
    if (index >= 0) this.speedIndex = index;
  }

  changeSpeed(by: number): void {
    this.speedIndex = Math.min(kSpeeds.length - 1, Math.max(0, this.speedIndex + by));
  }

  /** At the end, starts again from the beginning. */
  play(): void {
    if (this.time >= this.to) this.time = this.from;
    this.isPlaying = this.to > this.from;
  }

  pause(): void {
    this.isPlaying = false;
  }

  seek(time: number): void {
    if (Number.isFinite(time)) this.time = Math.min(this.to, Math.max(this.from, time));
  }

  /** `passed`: wall time since the last call, s. True if the time jumped back to the beginning. */
  advance(passed: number): boolean {
    if (!this.isPlaying) return false;
    // After the tab was hidden, the flight continues from the time where it stopped.
    const next = this.time + Math.min(passed, 0.25) * this.speed;
    if (next < this.to) {
      this.time = next;
      return false;
    }
    if (!this.loops) {
      this.time = this.to;
      this.isPlaying = false;
      return false;
    }
    this.time = this.from;
    return true;
  }
}

// SPDX-License-Identifier: Apache-2.0
import { createContext, useContext } from "react";
import type { Control } from "../control/control";
import { Recording } from "../control/recorded/recording";
import type { Source } from "../control/source";
import { stillOf } from "../control/still";
import { WatchedValue } from "../control/watched";

/** Interval at which the cursor of a playing recording moves, ms. */
const STEP_MS = 40;

/** The common time axis of all views, which show the running system, the paused system, or a recording at its cursor. */
export class Axis {
  readonly live: Control;
  readonly source: WatchedValue<Source>;
  /** Playback speed of the recording, as a multiple of real time; null if it is not playing. */
  readonly playing = new WatchedValue<number | null>(null);
  #player: ReturnType<typeof setInterval> | undefined;

  constructor(live: Control) {
    this.live = live;
    this.source = new WatchedValue<Source>(live);
    // A paused view holds values of the earlier run, so it returns to the running system.
    live.restarts.watch(() => this.recording ?? this.goLive());
  }

  get recording(): Recording | null {
    const source = this.source.get();
    return source instanceof Recording ? source : null;
  }

  goLive(): void {
    this.play(null);
    this.#show(this.live);
  }

  /** Pauses the display of the running system. */
  pause(): void {
    this.play(null);
    this.#show(stillOf(this.live, this.live.values.readings()));
  }

  /** Opens a recording, at its beginning. Throws `RefusalError`. */
  async open(name: string): Promise<Recording> {
    const recording = await Recording.open(this.live, name);
    this.play(null);
    this.#show(recording);
    return recording;
  }

  #show(source: Source): void {
    const left = this.recording;
    this.source.set(source);
    left?.leave();
  }

  /** Plays the recording at a rate; null stops playback. */
  play(rate: number | null): void {
    clearInterval(this.#player);
    const recording = this.recording;
    this.playing.set(recording ? rate : null);
    if (!recording || rate === null) return;
    if (recording.cursor.get() >= recording.ends_ns) recording.go(recording.begins_ns);
    let before = performance.now();
    this.#player = setInterval(() => {
      const now = performance.now();
      recording.go(recording.cursor.get() + (now - before) * 1e6 * rate);
      before = now;
      if (recording.cursor.get() >= recording.ends_ns) this.play(null);
    }, STEP_MS);
  }
}

export const AxisContext = createContext<Axis | null>(null);

export function useAxis(): Axis {
  const axis = useContext(AxisContext);
  if (!axis) throw new Error("this part of the page has no connected system");
  return axis;
}

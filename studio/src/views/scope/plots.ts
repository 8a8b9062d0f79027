// SPDX-License-Identifier: Apache-2.0
import { Bars } from "./bars";
import type { Band, DrawnTrace } from "./messages";
import { type Axis, type Gestures, Plot } from "./plot";
import type { Scope } from "./scope";

/** Height of the x-axis area below the last plot, px. */
export const X_AXIS = 30;

/** A plot and the scales that have an axis in it. */
export interface PlotAxes {
  plot: number;
  axes: Axis[];
}

/** The plots of the screen, one below the other. They share a time axis, the cursors, and one picture, of which each shows a section. */
export class Plots {
  readonly #host: HTMLElement;
  readonly #scope: Scope;
  readonly #gestures: Gestures;
  #parts: { number: number; place: HTMLElement; plot: Plot; bars: Bars }[] = [];
  #drawn: DrawnTrace | null = null;

  constructor(host: HTMLElement, scope: Scope, gestures: Gestures) {
    this.#host = host;
    this.#scope = scope;
    this.#gestures = gestures;
  }

  /**
   * Sets axes and sizes; unchanged plots are kept. `along` is the unit of the x axis; null for time. `isFixed` is true if the x axis
   * shows the values of a trace.
   */
  build(plots: readonly PlotAxes[], along: string | null, isFixed: boolean, width: number, height: number, theme: number): void {
    if (JSON.stringify(this.#parts.map((part) => part.number)) !== JSON.stringify(plots.map((one) => one.plot))) {
      this.#clear();
      this.#parts = plots.map(({ plot }) => this.#part(plot));
    }
    const most = Math.max(...plots.map(({ axes }) => axes.length));
    const share = Math.floor((height - X_AXIS) / plots.length);
    plots.forEach(({ axes }, i) => {
      const part = this.#parts[i];
      if (!part) return;
      const isLast = i === plots.length - 1;
      const tall = share + (isLast ? X_AXIS : 0);
      part.place.style.height = `${tall}px`;
      part.plot.build(axes, along, width, tall, theme, { isLast, axes: most, isFixed });
    });
    let top = 0;
    for (const { plot } of this.#parts) {
      plot.from = top;
      top += plot.size().height;
    }
    if (this.#drawn) this.draw(this.#drawn);
  }

  /** Returns the size of the picture in device pixels, and the positions of the plots in it. */
  size(): { width: number; height: number; plots: Band[] } {
    const plots = this.#parts.map(({ number, plot }) => ({ plot: number, top: plot.from, height: plot.size().height }));
    const height = plots.reduce((sum, band) => sum + band.height, 0);
    return { width: this.#parts[0]?.plot.size().width ?? 0, height, plots };
  }

  draw(drawn: DrawnTrace): void {
    if (this.#drawn !== drawn) this.#drawn?.bitmap.close();
    this.#drawn = drawn;
    for (const { plot, bars } of this.#parts) {
      plot.draw(drawn);
      bars.place();
    }
  }

  /** Updates the positions of the cursors. */
  place(): void {
    for (const { bars } of this.#parts) bars.place();
  }

  destroy(): void {
    this.#clear();
    this.#drawn?.bitmap.close();
    this.#drawn = null;
  }

  #part(number: number) {
    const place = document.createElement("div");
    place.className = "one-plot";
    place.dataset.plot = String(number + 1);
    this.#host.append(place);
    const plot = new Plot(place, this.#gestures);
    const { past, cursors } = this.#scope;
    const onAxis = (time_ns: number | undefined) => {
      const { span } = this.#scope;
      const { xy, spectrum } = this.#scope.setup.get();
      return span && xy === null && spectrum === null && time_ns !== undefined ? (time_ns - span.origin_ns) / 1e9 : null;
    };
    const bars = new Bars(
      plot,
      cursors,
      () => onAxis(past?.cursor.get()),
      () => onAxis(past?.differs.get()?.time_ns),
    );
    plot.onRebuilt = () => bars.attach();
    return { number, place, plot, bars };
  }

  #clear(): void {
    for (const { place, plot, bars } of this.#parts) {
      bars.remove();
      plot.destroy();
      place.remove();
    }
    this.#parts = [];
  }
}

// SPDX-License-Identifier: Apache-2.0
import type { ShownTrace } from "../messages";
import type { TraceSetup } from "../setup";
import { combined, derivative, difference } from "../signal/derived";
import { type Formula, formula } from "../signal/formula";
import { type Missing, missingIn, type Series, seriesOf } from "../signal/series";
import type { Acquisition, KeptChannel } from "./acquisition";

/** Source of the values of traces: the acquisition, or a reference. */
export interface Store {
  series(channel: string, component: string, from_ns: number, to_ns: number): Series;
}

/** Returns the store of an acquisition. */
export function live(acquisition: Acquisition): Store {
  return {
    series(channel, component, from_ns, to_ns) {
      const kept = acquisition.channels.get(channel);
      const index = kept ? kept.components.indexOf(component) : -1;
      return kept && index >= 0 ? seriesOf(kept.ring, index, from_ns, to_ns) : [];
    },
  };
}

/** Returns the values of a trace between two times, plus one value on each side. */
export function traceSeries(store: Store, trace: TraceSetup, from_ns: number, to_ns: number): Series {
  if (trace.derive?.kind === "formula") {
    const series = trace.derive.of.map(({ channel, component }) => store.series(channel, component, from_ns, to_ns));
    return combined(series, understood(trace.derive).value);
  }
  const own = store.series(trace.channel, trace.component ?? "", from_ns, to_ns);
  if (trace.derive?.kind === "derivative") return derivative(own);
  if (trace.derive?.kind === "difference") {
    return difference(own, store.series(trace.derive.less.channel, trace.derive.less.component, from_ns, to_ns));
  }
  return own;
}

/** Cache of parsed formulas, so that they are not parsed for each picture. */
const read = new WeakMap<object, Formula>();

function understood(derived: { text: string }): Formula {
  const known = read.get(derived) ?? formula(derived.text);
  read.set(derived, known);
  return known;
}

/** Store shown behind the traces, with its time 0, and exact sums if they are known. */
export interface Behind extends Store {
  readonly origin_ns: number;
  readonly sums: Acquisition["sums"] | null;
}

/** A recording shown behind the current one; `origin_ns` is its time that corresponds to time 0. */
export class Beside implements Behind {
  readonly origin_ns: number;
  readonly #of: Acquisition;

  constructor(of: Acquisition, origin_ns: number) {
    this.#of = of;
    this.origin_ns = origin_ns;
  }

  get sums(): Acquisition["sums"] {
    return this.#of.sums;
  }

  series(channel: string, component: string, from_ns: number, to_ns: number): Series {
    return live(this.#of).series(channel, component, from_ns, to_ns);
  }
}

/** Earlier traces that remain on the screen: a copy of their values and their time 0. */
export class Reference implements Behind {
  readonly sums = null;
  readonly origin_ns: number;
  readonly #series = new Map<string, Series>();

  constructor(acquisition: Acquisition, traces: readonly ShownTrace[], span: { from_ns: number; to_ns: number; origin_ns: number }) {
    this.origin_ns = span.origin_ns;
    const of = live(acquisition);
    for (const { setup } of traces) {
      this.#keep(of, setup.channel, setup.component ?? "", span);
      if (setup.derive?.kind === "formula") for (const { channel, component } of setup.derive.of) this.#keep(of, channel, component, span);
      if (setup.derive?.kind === "difference") this.#keep(of, setup.derive.less.channel, setup.derive.less.component, span);
    }
  }

  series(channel: string, component: string): Series {
    return this.#series.get(`${channel} ${component}`) ?? [];
  }

  #keep(of: Store, channel: string, component: string, span: { from_ns: number; to_ns: number }): void {
    const copied = of.series(channel, component, span.from_ns, span.to_ns).map((piece) => ({
      times_ns: piece.times_ns.slice(piece.from, piece.to),
      values: piece.values.slice(piece.from, piece.to),
      from: 0,
      to: piece.to - piece.from,
      broken: piece.broken,
    }));
    this.#series.set(`${channel} ${component}`, copied);
  }
}

/** Returns the gaps in the shown channels, each channel once. */
export function missingOf(acquisition: Acquisition, traces: readonly ShownTrace[], from_ns: number, to_ns: number): Missing[] {
  const channels = new Set<KeptChannel>();
  for (const { setup } of traces) {
    const kept = acquisition.channels.get(setup.channel);
    if (kept) channels.add(kept);
  }
  return [...channels].flatMap(({ ring }) => missingIn(ring, from_ns, to_ns));
}

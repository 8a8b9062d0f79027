// SPDX-License-Identifier: Apache-2.0
import type { Gestures } from "./plot";
import type { Scope } from "./scope";

/** Selectable widths of the screen, s. */
export const SPANS_S = [1e-3, 2e-3, 5e-3, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 30, 60];
const SPAN_MIN_NS = 1e3;
const SPAN_MAX_NS = 600e9;

/**
 * Returns the handlers of wheel, drag and key events. While the picture is rolling, they change the time base; while it is frozen, they
 * zoom.
 */
export function gesturesOf(scope: Scope): Gestures {
  const of = (): Gestures => (scope.setup.get().spectrum ? overFrequency(scope) : overTime(scope));
  return {
    selected: (from, to) => of().selected(from, to),
    zoomed: (factor, at) => of().zoomed(factor, at),
    moved: (by) => of().moved(by),
    clicked: (at) => of().clicked(at),
    reset: () => of().reset(),
  };
}

/** Minimum visible fraction of the frequency range. */
const FREQUENCIES_MIN = 1e-5;

/** Returns the handlers for a frequency axis; the time span does not change. */
export function overFrequency(scope: Pick<Scope, "setup" | "along" | "rows" | "change">): Gestures {
  const highest = () => Math.max(scope.along?.hi ?? 0, ...scope.rows.get().map((row) => (row.spectrum?.rate_hz ?? 0) / 2));
  const show = (from: number, to: number) => {
    const all = highest();
    const size = Math.min(all, Math.max(all * FREQUENCIES_MIN, to - from));
    const from_hz = Math.min(Math.max(0, from), all - size);
    const to_hz = from_hz + size < all * (1 - FREQUENCIES_MIN) ? from_hz + size : null;
    scope.change((setup) => (setup.spectrum ? { ...setup, spectrum: { ...setup.spectrum, from_hz, to_hz } } : setup));
  };
  return {
    selected: show,
    zoomed(factor, at) {
      if (!scope.along) return;
      const { lo, hi } = scope.along;
      // The frequency under the pointer stays there, within the range of frequencies.
      const [from, to] = [at - (at - lo) * factor, at + (hi - at) * factor];
      show(Math.max(0, from), Math.min(highest(), to));
    },
    moved(by) {
      if (scope.along) show(scope.along.lo + by, scope.along.hi + by);
    },
    clicked: () => {},
    reset: () => show(0, Number.POSITIVE_INFINITY),
  };
}

function overTime(scope: Scope): Gestures {
  return {
    selected(from_s, to_s) {
      const span = scope.span;
      if (span)
        scope.look({
          ...span,
          from_ns: span.origin_ns + from_s * 1e9,
          to_ns: span.origin_ns + Math.max(to_s * 1e9, from_s * 1e9 + SPAN_MIN_NS),
        });
    },
    zoomed(factor, at_s) {
      const span = scope.span;
      if (!span) return;
      if (scope.setup.get().sweep === "roll" && !scope.stopped.get()) return nextSpan(scope, factor > 1 ? 1 : -1);
      const at_ns = span.origin_ns + at_s * 1e9;
      const size = span.to_ns - span.from_ns;
      const most = scope.past ? Math.max(SPAN_MAX_NS, 2 * (scope.past.ends_ns - scope.past.begins_ns)) : SPAN_MAX_NS;
      const wanted = Math.min(most, Math.max(SPAN_MIN_NS, size * factor));
      const from_ns = at_ns - ((at_ns - span.from_ns) * wanted) / size;
      scope.look({ ...span, from_ns, to_ns: from_ns + wanted });
    },
    moved(by_s) {
      const span = scope.span;
      if (span) scope.look({ ...span, from_ns: span.from_ns + by_s * 1e9, to_ns: span.to_ns + by_s * 1e9 });
    },
    clicked(at_s) {
      if (scope.past && scope.span) scope.past.go(scope.span.origin_ns + at_s * 1e9);
    },
    reset() {
      if (scope.stopped.get()) scope.fit();
    },
  };
}

export function nextSpan(scope: Scope, by: 1 | -1): void {
  const now = scope.setup.get().span_s;
  const next = by > 0 ? SPANS_S.find((span) => span > now * 1.001) : SPANS_S.findLast((span) => span < now * 0.999);
  if (next) scope.change((setup) => ({ ...setup, span_s: next }));
}

/** Handles a key pressed on the screen; returns true if the screen uses the key. */
export function key(scope: Scope, event: { key: string; shiftKey: boolean }): boolean {
  const gestures = gesturesOf(scope);
  const span = scope.span;
  const time = { lo: ((span?.from_ns ?? 0) - (span?.origin_ns ?? 0)) / 1e9, hi: ((span?.to_ns ?? 0) - (span?.origin_ns ?? 0)) / 1e9 };
  const { lo, hi } = scope.setup.get().spectrum && scope.along ? scope.along : time;
  const [size, middle] = [hi - lo, (lo + hi) / 2];
  switch (event.key) {
    case "+":
    case "=":
      gestures.zoomed(0.8, middle);
      return true;
    case "-":
      gestures.zoomed(1.25, middle);
      return true;
    case "ArrowLeft":
      gestures.moved(-size * (event.shiftKey ? 0.5 : 0.1));
      return true;
    case "ArrowRight":
      gestures.moved(size * (event.shiftKey ? 0.5 : 0.1));
      return true;
    case "Home":
      gestures.reset();
      return true;
    case " ":
      scope.stop(!scope.stopped.get());
      return true;
    case "c":
      // Cursors exist only on a time axis.
      if (scope.setup.get().spectrum || scope.setup.get().xy !== null) return false;
      toggleCursors(scope);
      return true;
    default:
      return false;
  }
}

/** Shows the cursors at one third and two thirds of the screen, or hides them. */
export function toggleCursors(scope: Scope): void {
  const span = scope.span;
  const at = (part: number) => (span ? (span.from_ns + part * (span.to_ns - span.from_ns) - span.origin_ns) / 1e9 : 0);
  scope.cursors.set(scope.cursors.get() || !span ? null : [at(1 / 3), at(2 / 3)]);
}

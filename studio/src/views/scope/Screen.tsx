// SPDX-License-Identifier: Apache-2.0
import { useEffect, useRef, useState } from "react";
import "uplot/dist/uPlot.min.css";
import { colour, onThemeChange } from "../../design/colours";
import { useWatched } from "../../shell/context";
import { Bars } from "./bars";
import { gesturesOf, key } from "./gestures";
import { colourOf, patternOf } from "./looks";
import type { Show, ShownTrace } from "./messages";
import { type Axis, Plot } from "./plot";
import type { Scope } from "./scope";
import { type Setup, traceId, unitOf } from "./setup";
import type { StreamChannel } from "./signal/frame";
import { Timing } from "./Timing";

/** Scales that have an axis: more cannot be read. */
const AXES_MAX = 3;

/** The screen of the scope. */
export function Screen(props: { scope: Scope; chosen: string | null }) {
  const { scope, chosen } = props;
  const host = useRef<HTMLDivElement>(null);
  const plot = useRef<{ plot: Plot; bars: Bars } | null>(null);
  const [size, setSize] = useState({ width: 0, height: 0 });
  const [theme, setTheme] = useState(0);
  const setup = useWatched(scope.setup);
  const channels = useWatched(scope.channels);
  const window = useWatched(scope.window);
  const cursors = useWatched(scope.cursors);

  useEffect(() => {
    const element = host.current;
    if (!element) return;
    const made = new Plot(element, gesturesOf(scope));
    const bars = new Bars(made, scope.cursors, () => {
      const { past, span } = scope;
      return past && span ? (past.cursor.get() - span.origin_ns) / 1e9 : null;
    });
    made.onRebuilt = () => bars.attach();
    plot.current = { plot: made, bars };
    const ends = [
      scope.onDrawn((drawn) => {
        made.draw(drawn);
        bars.place();
      }),
      scope.cursors.watch(() => bars.place()),
      scope.past?.cursor.watch(() => bars.place()) ?? (() => undefined),
      onThemeChange(() => setTheme((count) => count + 1)),
    ];
    const watched = new ResizeObserver(() => setSize({ width: element.clientWidth, height: element.clientHeight }));
    watched.observe(element);
    return () => {
      watched.disconnect();
      for (const end of ends) end();
      bars.remove();
      made.destroy();
      plot.current = null;
      scope.show({ ...HIDDEN });
    };
  }, [scope]);

  useEffect(() => {
    const made = plot.current?.plot;
    if (!made) return;
    const traces = shownTraces(setup, channels);
    made.build(axesOf(setup, traces, chosen), setup.xy === null ? null : setup.xy, size.width, size.height, theme);
    const { width, height } = made.size();
    scope.show(showOf(setup, traces, { width, height }, window, cursors));
  }, [scope, setup, channels, window, cursors, size, theme, chosen]);

  return (
    <div className="screen">
      <div
        className="plot"
        ref={host}
        role="group"
        tabIndex={0}
        aria-label="Screen. Keys: + and − zoom, left and right move, Home fits, space stops and goes on, c cursors"
        onKeyDown={(event) => {
          if (event.ctrlKey || event.metaKey || event.altKey) return;
          if (key(scope, event)) event.preventDefault();
        }}
      />
      <Timing scope={scope} />
    </div>
  );
}

const HIDDEN: Show = {
  width: 0,
  height: 0,
  ratio: 1,
  window: null,
  traces: [],
  scales: "unit",
  steps: false,
  xy: null,
  cursors: null,
  ink: { text: "", quiet: "", bad: "", warn: "", ground: "" },
  font: "",
  marker: null,
};

function shownTraces(setup: Setup, channels: ReadonlyMap<string, StreamChannel>): ShownTrace[] {
  const colours = new Map<string, string>();
  const inked = (token: string) => {
    const known = colours.get(token) ?? colour(token);
    colours.set(token, known);
    return known;
  };
  return setup.traces
    .filter((trace) => trace.component !== null)
    .map((trace) => {
      const unit = channels.get(trace.channel)?.unit || null;
      return {
        id: traceId(trace),
        setup: trace,
        colour: inked(colourOf(trace.look)),
        pattern: [...patternOf(trace.look)],
        unit: unitOf(trace, unit),
      };
    });
}

function axesOf(setup: Setup, traces: readonly ShownTrace[], chosen: string | null): Axis[] {
  const seen = traces.filter((trace) => !trace.setup.hidden && trace.id !== setup.xy);
  if (setup.scales === "lanes") return setup.xy === null ? [] : own(seen, chosen);
  if (setup.scales === "own") return own(seen, chosen);
  const units = [...new Set(seen.map((trace) => trace.unit ?? ""))];
  return units.slice(0, AXES_MAX).map((unit) => ({ key: `unit ${unit}`, label: unit }));
}

// Each its own scale: the axis is that of the trace that was chosen in the table, else of the first.
function own(seen: readonly ShownTrace[], chosen: string | null): Axis[] {
  const one = seen.find((trace) => trace.id === chosen) ?? seen[0];
  return one ? [{ key: `trace ${one.id}`, label: `${one.id}${one.unit ? ` (${one.unit})` : ""}` }] : [];
}

function showOf(
  setup: Setup,
  traces: ShownTrace[],
  size: { width: number; height: number },
  window: Show["window"],
  cursors: Show["cursors"],
): Show {
  const ratio = globalThis.devicePixelRatio || 1;
  const family = getComputedStyle(document.body).fontFamily;
  const level = setup.trigger?.on === "level" && setup.sweep !== "roll" ? setup.trigger : null;
  return {
    ...size,
    ratio,
    window,
    traces,
    scales: setup.scales,
    steps: setup.steps,
    xy: setup.xy,
    cursors,
    ink: {
      text: colour("--text"),
      quiet: colour("--quiet"),
      bad: colour("--bad"),
      warn: colour("--warn"),
      ground: colour("--panel"),
    },
    font: `${Math.round(11 * ratio)}px ${family}`,
    marker: level && { channel: level.channel, component: level.component, level: level.level },
  };
}

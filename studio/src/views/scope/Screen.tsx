// SPDX-License-Identifier: Apache-2.0

import { useEffect, useRef, useState } from "react";
import { tr } from "../../language/text";
import "uplot/dist/uPlot.min.css";
import { colour, onThemeChange } from "../../design/colours";
import { useWatched } from "../../shell/context";
import { gesturesOf, key } from "./gestures";
import { colourOf, patternOf } from "./looks";
import type { Show, ShownTrace } from "./messages";
import type { Axis } from "./plot";
import { type PlotAxes, Plots, X_AXIS } from "./plots";
import type { Scope } from "./scope";
import { plotsOf, type Setup, traceId, unitOf } from "./setup";
import type { StreamChannel } from "./signal/frame";
import { spectrumUnit } from "./signal/spectrum";
import { Timing } from "./Timing";
import { ownKey, scaleKey } from "./worker/scales";

/** Maximum number of scales shown with an axis; more would be illegible. */
const AXES_MAX = 3;

/** Height of a lane with enough space for the name of its trace, px. The screen scrolls if its lanes need more space than it has. */
const LANE = 20;
/** Maximum number of lanes of that height, because browsers limit the size of a canvas. With more, lanes are lower. */
const LANES_MAX = 256;

/** The screen of the scope. */
export function Screen(props: { scope: Scope; chosen: string | null }) {
  const { scope, chosen } = props;
  const host = useRef<HTMLDivElement>(null);
  const plot = useRef<Plots | null>(null);
  const [size, setSize] = useState({ width: 0, height: 0 });
  const [theme, setTheme] = useState(0);
  const setup = useWatched(scope.setup);
  const channels = useWatched(scope.channels);
  const window = useWatched(scope.window);
  const cursors = useWatched(scope.cursors);

  useEffect(() => {
    const element = host.current;
    if (!element) return;
    const made = new Plots(element, scope, gesturesOf(scope));
    plot.current = made;
    const ends = [
      scope.onDrawn((drawn) => made.draw(drawn)),
      scope.cursors.watch(() => made.place()),
      scope.past?.cursor.watch(() => made.place()) ?? (() => undefined),
      scope.past?.differs.watch(() => made.place()) ?? (() => undefined),
      onThemeChange(() => setTheme((count) => count + 1)),
    ];
    const watched = new ResizeObserver(() => setSize({ width: element.clientWidth, height: element.clientHeight }));
    watched.observe(element);
    return () => {
      watched.disconnect();
      for (const end of ends) end();
      made.destroy();
      plot.current = null;
      scope.show({ ...HIDDEN });
    };
  }, [scope]);

  useEffect(() => {
    const made = plot.current;
    if (!made) return;
    const traces = shownTraces(setup, channels);
    made.build(axesOf(setup, traces, chosen), setup.spectrum ? "Hz" : setup.xy, setup.xy !== null, size.width, size.height, theme);
    scope.show({ ...showOf(setup, traces, made.size(), window, cursors), recorded: scope.past !== null });
  }, [scope, setup, channels, window, cursors, size, theme, chosen]);

  return (
    <div className="screen">
      <div
        className="plot"
        ref={host}
        style={{ minHeight: heightOf(setup) }}
        role="group"
        tabIndex={0}
        aria-label={tr("scope.screenKeysAndZoomLeftAnd")}
        onKeyDown={(event) => {
          if (event.ctrlKey || event.metaKey || event.altKey) return;
          if (key(scope, event)) event.preventDefault();
        }}
      />
      <Timing scope={scope} />
    </div>
  );
}

/** Returns the minimum height of the plots, px. */
function heightOf({ scales, xy, spectrum, traces }: Setup): number {
  if (scales !== "lanes" || xy !== null || spectrum !== null) return 0;
  const lanes = traces.filter((trace) => trace.component !== null && !trace.hidden).length;
  return Math.min(lanes, LANES_MAX) * LANE + X_AXIS;
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
  spectrum: null,
  recorded: false,
  plots: [],
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
        unit: setup.spectrum ? spectrumUnit(unitOf(trace, unit), setup.spectrum.amount) : unitOf(trace, unit),
      };
    });
}

function axesOf(setup: Setup, traces: readonly ShownTrace[], chosen: string | null): PlotAxes[] {
  const all = plotsOf(setup);
  return all.map((plot) => {
    const isSeen = ({ id, setup: of }: ShownTrace) => !of.hidden && id !== setup.xy && (all.length === 1 || (of.plot ?? 0) === plot);
    return { plot, axes: axesIn(setup, traces.filter(isSeen), chosen) };
  });
}

function axesIn(setup: Setup, seen: readonly ShownTrace[], chosen: string | null): Axis[] {
  if (setup.scales === "lanes") return setup.xy === null ? [] : own(seen, chosen);
  if (setup.scales === "own") return own(seen, chosen);
  const units = new Map(seen.map((trace) => [scaleKey(trace, setup), trace.unit ?? ""]));
  return [...units].slice(0, AXES_MAX).map(([key, label]) => ({ key, label }));
}

// With separate scales, the axis is that of the trace selected in the table, or else of the first.
function own(seen: readonly ShownTrace[], chosen: string | null): Axis[] {
  const one = seen.find((trace) => trace.id === chosen) ?? seen[0];
  return one ? [{ key: ownKey(one.id), label: `${one.id}${one.unit ? ` (${one.unit})` : ""}` }] : [];
}

function showOf(
  setup: Setup,
  traces: ShownTrace[],
  size: Pick<Show, "width" | "height" | "plots">,
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
    spectrum: setup.spectrum,
    recorded: false,
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

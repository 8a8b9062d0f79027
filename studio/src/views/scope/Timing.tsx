// SPDX-License-Identifier: Apache-2.0

import { useEffect, useRef } from "react";
import { count, duration } from "../../design/numbers";
import { tr } from "../../language/text";
import { useWatched } from "../../shell/context";
import type { Row } from "./messages";
import type { Scope } from "./scope";
import { secondsText } from "./signal/table";
import { timeUnit } from "./signal/ticks";

/** Line below the screen: the meaning of the axis, its time 0 in the system's time, and the times of the cursors. */
export function Timing(props: { scope: Scope }) {
  const { scope } = props;
  const axis = useRef<HTMLSpanElement>(null);
  const cursors = useWatched(scope.cursors);
  const { xy, spectrum } = useWatched(scope.setup);
  useEffect(() => {
    const write = () => {
      const span = scope.span;
      if (!axis.current || !span) return;
      if (spectrum) {
        axis.current.textContent = spectralText(scope.rows.get());
        return;
      }
      const { unit } = timeUnit((span.to_ns - span.from_ns) / 1e9);
      if (scope.past && xy === null) {
        axis.current.textContent = tr("scope.unitOnTheSystemSClock", { unit, to_ns: duration(span.to_ns - span.from_ns) });
        return;
      }
      const zero = span.triggered ? "trigger" : scope.stopped.get() ? "stop" : "now";
      const said = tr("scope.unitFromThe", {
        unit,
        part: zero === "now" ? tr("scope.newestValue") : zero === "stop" ? tr("scope.stop2") : tr("scope.trigger2"),
      });
      axis.current.textContent = tr("scope.0IsAtOriginNsS", {
        part: xy === null ? said : tr("scope.toNsShown", { to_ns: duration(span.to_ns - span.from_ns) }),
        origin_ns: secondsText(Math.round(span.origin_ns)),
      });
    };
    write();
    return scope.rows.watch(write);
  }, [scope, xy, spectrum]);
  return (
    <div className="timing small">
      <span className="quiet figures" ref={axis} data-testid="axis">
        {tr("scope.noValueYet")}
      </span>
      {cursors && <CursorTimes at={cursors} />}
    </div>
  );
}

/** Describes the spectra, using the spectrum of the first trace that has one. */
function spectralText(rows: readonly Row[]): string {
  const of = rows.find((row) => row.spectrum)?.spectrum;
  if (!of) return tr("scope.hzNoSpectrumYetAtLeast");
  const held = of.held > 0 ? tr("scope.heldOfThemRepeatThePrevious", { count: count(of.held) }) : "";
  return tr("scope.hzOfCountValuesAtRate", { count: count(of.count), rate_hz: figures(of.rate_hz), held });
}

function CursorTimes(props: { at: [number, number] }) {
  const [a, b] = props.at;
  const difference = b - a;
  const frequency = difference === 0 ? "–" : `${figures(1 / Math.abs(difference))} Hz`;
  return (
    <dl className="cursor-times figures">
      <div>
        <dt>A</dt> <dd>{duration(a * 1e9)}</dd>
      </div>
      <div>
        <dt>B</dt> <dd>{duration(b * 1e9)}</dd>
      </div>
      <div>
        <dt>B − A</dt> <dd data-testid="cursor-difference">{duration(difference * 1e9)}</dd>
      </div>
      <div>
        <dt>1/|B − A|</dt> <dd>{frequency}</dd>
      </div>
    </dl>
  );
}

function figures(value: number): string {
  return value >= 1e5 ? value.toExponential(3) : String(Number(value.toPrecision(4)));
}

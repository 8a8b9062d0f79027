// SPDX-License-Identifier: Apache-2.0

import { useEffect, useState } from "react";
import { Refusals } from "../../design/parts";
import { tr } from "../../language/text";
import { useControl, useWatched } from "../../shell/context";
import { addressOf } from "../../shell/route";
import { colourOf } from "../scope/looks";
import { Screen } from "../scope/Screen";
import { Scope } from "../scope/scope";
import { EMPTY, type Setup, traceId, withChannel } from "../scope/setup";
import { useStill } from "../scope/useStill";
import { Lead } from "./Lead";
import "../scope/scope.css";

/** Plot of values over time, each at full rate, in a separate rolling scope. */
export function PlotPanel(props: { names: readonly string[]; seconds: number }) {
  const source = useControl();
  const { origin } = source;
  const [scope, setScope] = useState<Scope | null>(null);
  const asked = JSON.stringify([props.names, props.seconds]);
  useEffect(() => {
    const [names, seconds] = JSON.parse(asked) as [string[], number];
    const made = new Scope(origin, setupOf(names, seconds));
    setScope(made);
    return () => {
      setScope(null);
      made.end();
    };
  }, [origin, asked]);
  return scope && <Plotted scope={scope} isStill={source !== origin} />;
}

/** Returns the setup of a plot, which rolls and stores only slightly more than the shown span. */
export function setupOf(names: readonly string[], seconds: number): Setup {
  const rolling: Setup = { ...EMPTY, span_s: seconds, keep_s: Math.min(600, Math.max(1, seconds * 1.2)) };
  return names.reduce((setup, name) => withChannel(setup, name), rolling);
}

function Plotted(props: { scope: Scope; isStill: boolean }) {
  const { scope } = props;
  const setup = useWatched(scope.setup);
  const channels = useWatched(scope.channels);
  const refused = useWatched(scope.feeds.refused);
  const trouble = useWatched(scope.trouble);
  const lost = useWatched(scope.counts).reduce((sum, one) => sum + one.lost, 0);
  useStill(scope, props.isStill);
  const traces = setup.traces.filter((trace) => trace.component !== null);
  return (
    <div className="plot-panel">
      <div className="screen-frame">
        <Screen scope={scope} chosen={null} />
      </div>
      <ul className="legend small">
        {traces.map((trace) => (
          <li key={traceId(trace)}>
            <span className="ink" style={{ background: `var(${colourOf(trace.look)})` }} />
            <Lead to={addressOf("scope", [], { names: trace.channel })}>{traceId(trace)}</Lead>{" "}
            <span className="quiet">{channels.get(trace.channel)?.unit ?? ""}</span>
          </li>
        ))}
        {lost > 0 && <li className="wrong">{tr("workspaces.lostValuesLost", { count: lost })}</li>}
      </ul>
      {trouble && <p className="wrong">{trouble}</p>}
      <Refusals of={[...refused.values()].flat()} />
    </div>
  );
}

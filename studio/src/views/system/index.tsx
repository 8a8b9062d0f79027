// SPDX-License-Identifier: Apache-2.0

import { useMemo, useState } from "react";
import type { Statistics } from "../../control/shapes";
import { seconds } from "../../design/numbers";
import { Empty } from "../../design/parts";
import { trNodes } from "../../language/nodes";
import { tr } from "../../language/text";
import { useConfiguration } from "../../shell/configuration";
import { useControl, useTopic } from "../../shell/context";
import { Connections } from "./Connections";
import { Processor } from "./Processor";
import { Rights } from "./Rights";
import { Stops } from "./Stops";
import { type Baseline, sinceBaseline, sourcesOf } from "./sources";
import "./system.css";

/** Processors and their interrupt sources: load, jitter, overruns, connections, privileges. */
export default function System() {
  const control = useControl();
  const now = useTopic(control.topics.statistics);
  const configuration = useConfiguration();
  const [baseline, setBaseline] = useState<Baseline | null>(null);
  const sources = useMemo(() => (now ? sourcesOf(now, configuration) : []), [now, configuration]);
  const shown = useMemo(() => sources.map((source) => sinceBaseline(source, baseline)), [sources, baseline]);
  if (!now) return <p className="quiet wait">{tr("system.waitingForTheFirstStatistics")}</p>;
  const processors = [...new Set([...Object.keys(configuration?.processors ?? {}), ...sources.map((source) => source.processor)])];
  return (
    <div className="stack">
      <Stops now={now} />
      <div className="row">
        <p className="quiet">
          {baseline ? tr("system.countedSinceAtSOnThe", { at_s: seconds(baseline.at_s) }) : tr("system.countedSinceEachSourceBegan")}
          {tr("system.durationIsThatOfAWhole")}
        </p>
        <button type="button" onClick={() => setBaseline({ at_s: now.now_s, of: now.sources })}>
          {tr("system.restartCounting")}
        </button>
        {baseline && (
          <button type="button" onClick={() => setBaseline(null)}>
            {tr("system.countSinceStart")}
          </button>
        )}
      </div>
      {processors.length === 0 && <NoProcessors />}
      {processors.map((name) => (
        <Processor
          key={name}
          name={name}
          about={configuration?.processors[name]}
          sources={shown.filter((source) => source.processor === name)}
        />
      ))}
      <Connections />
      <Rights sources={sources} supervisor={now.supervisor_rights_missing} />
      <DeviceLosses now={now} />
    </div>
  );
}

function NoProcessors() {
  return (
    <Empty title={tr("system.thisSystemHasNoRealTime")}>
      {trNodes("system.aProgramCreatesOneWithCode", {
        code: <code>cell.processor("rtp0")</code>,
        code2: <code>rtp0.timer("fast", period="1 ms", priority=80)</code>,
      })}
    </Empty>
  );
}

function DeviceLosses(props: { now: Statistics }) {
  const limited = Object.entries(props.now.physical_devices).filter(([, device]) => device.slew_limited > 0);
  if (limited.length === 0) return null;
  return (
    <p className="quiet">
      {tr("system.slewLimitsHeldWritesBack")}{" "}
      {limited.map(([name, device]) => tr("system.nameSlewLimitedTimes", { name, count: device.slew_limited })).join(", ")}.
    </p>
  );
}

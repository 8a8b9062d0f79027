// SPDX-License-Identifier: Apache-2.0

import { Fragment } from "react";
import type { Configuration } from "../../control/shapes";
import { count, duration, percent, period } from "../../design/numbers";
import { Panel, Tag } from "../../design/parts";
import { tr } from "../../language/text";
import { Histogram } from "./Histogram";
import { load, type SourceShown } from "./sources";

/** A real-time processor and its interrupt sources, highest priority first. */
export function Processor(props: { name: string; about: Configuration["processors"][string] | undefined; sources: SourceShown[] }) {
  const { about, sources } = props;
  const all = sources.reduce((sum, source) => sum + (load(source) ?? 0), 0);
  const core = about?.core ?? sources.find((source) => source.core != null)?.core;
  return (
    <Panel
      title={props.name}
      end={
        <>
          <span className="quiet">{core == null ? tr("system.noDedicatedCore") : tr("system.coreCore", { core })}</span>
          {about?.supervisor && <Tag title={tr("system.theSupervisorRunsOnTheSame")}>{tr("system.supervisor")}</Tag>}
          <Load of={all} name={`load of ${props.name}`} />
        </>
      }
      flush
    >
      {sources.length === 0 ? (
        <p className="quiet wait">{tr("system.noInterruptSourcesNothingRunsHere")}</p>
      ) : (
        <div className="scroll-x" role="group" aria-label={tr("system.interruptSources")} tabIndex={0}>
          <table className="sources">
            <thead>
              <tr>
                <th scope="col">{tr("system.interruptSource")}</th>
                <th scope="col" className="number">
                  {tr("system.priority")}
                </th>
                <th scope="col" className="number">
                  {tr("system.load")}
                </th>
                <th scope="col" className="number">
                  {tr("system.steps")}
                </th>
                <th scope="col" className="number">
                  {tr("system.firings")}
                </th>
                <th scope="col" className="number">
                  {tr("system.overruns")}
                </th>
                <th scope="col" className="number">
                  {tr("system.late")}
                </th>
                <th scope="col" className="number">
                  {tr("system.faults")}
                </th>
                <th scope="col">{tr("system.state")}</th>
              </tr>
            </thead>
            <tbody>
              {sources.map((source) => (
                <Fragment key={source.name}>
                  <Source of={source} />
                </Fragment>
              ))}
            </tbody>
          </table>
        </div>
      )}
    </Panel>
  );
}

function Source(props: { of: SourceShown }) {
  const { of } = props;
  const taken = load(of);
  return (
    <>
      <tr>
        <th scope="row">
          {of.name}{" "}
          <span className="quiet">{of.period_ns === null ? of.kind : tr("system.timerPeriodNs", { period_ns: period(of.period_ns) })}</span>
        </th>
        <td className="number">{of.priority}</td>
        <td className="number">{taken === null ? "–" : percent(taken)}</td>
        <td className="number">{count(of.steps)}</td>
        <td className="number">{count(of.firings)}</td>
        <td className={`number ${of.overruns > 0 ? "alarming" : ""}`}>{count(of.overruns)}</td>
        <td className={`number ${of.late > 0 ? "alarming" : ""}`}>{count(of.late)}</td>
        <td className={`number ${of.faults > 0 ? "alarming" : ""}`}>{count(of.faults)}</td>
        <td>{of.stopped ? <Tag tone="bad">{tr("system.stopped")}</Tag> : <Tag tone="good">{tr("system.runs")}</Tag>}</td>
      </tr>
      <tr>
        <td colSpan={9}>
          <div className="histograms">
            <Histogram
              title={tr("system.duration")}
              bins={of.duration_bins}
              limit={of.period_ns}
              limitName={tr("system.period")}
              greatest={greatest(of, "duration")}
            />
            <Histogram title={tr("system.jitter")} bins={of.jitter_bins} limit={null} limitName="" greatest={greatest(of, "jitter")} />
          </div>
        </td>
      </tr>
    </>
  );
}

function greatest(of: SourceShown, what: "duration" | "jitter"): string {
  const most = what === "duration" ? of.duration_max_ns : of.jitter_max_ns;
  return of.counted ? tr("system.belowMost", { most: duration(most) }) : duration(most);
}

export function Load(props: { of: number; name: string }) {
  return (
    <span className="load">
      <span className="quiet">{tr("system.load2")}</span>
      <meter min={0} max={1} high={0.7} optimum={0} value={Math.min(props.of, 1)} aria-label={props.name} />
      <span className="figures">{percent(props.of)}</span>
    </span>
  );
}

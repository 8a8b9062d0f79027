// SPDX-License-Identifier: Apache-2.0
import { Fragment } from "react";
import type { Configuration } from "../../control/shapes";
import { count, duration, percent, period } from "../../design/numbers";
import { Panel, Tag } from "../../design/parts";
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
          <span className="quiet">{core == null ? "no dedicated core" : `core ${core}`}</span>
          {about?.supervisor && <Tag title="the supervisor runs on the same core as this processor">supervisor</Tag>}
          <Load of={all} name={`load of ${props.name}`} />
        </>
      }
      flush
    >
      {sources.length === 0 ? (
        <p className="quiet wait">No interrupt sources: nothing runs here.</p>
      ) : (
        <div className="scroll-x" role="group" aria-label="Interrupt sources" tabIndex={0}>
          <table className="sources">
            <thead>
              <tr>
                <th scope="col">Interrupt source</th>
                <th scope="col" className="number">
                  Priority
                </th>
                <th scope="col" className="number">
                  Load
                </th>
                <th scope="col" className="number">
                  Steps
                </th>
                <th scope="col" className="number">
                  Firings
                </th>
                <th scope="col" className="number">
                  Overruns
                </th>
                <th scope="col" className="number">
                  Late
                </th>
                <th scope="col" className="number">
                  Faults
                </th>
                <th scope="col">State</th>
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
          {of.name} <span className="quiet">{of.period_ns === null ? of.kind : `timer, ${period(of.period_ns)}`}</span>
        </th>
        <td className="number">{of.priority}</td>
        <td className="number">{taken === null ? "–" : percent(taken)}</td>
        <td className="number">{count(of.steps)}</td>
        <td className="number">{count(of.firings)}</td>
        <td className={`number ${of.overruns > 0 ? "alarming" : ""}`}>{count(of.overruns)}</td>
        <td className={`number ${of.late > 0 ? "alarming" : ""}`}>{count(of.late)}</td>
        <td className={`number ${of.faults > 0 ? "alarming" : ""}`}>{count(of.faults)}</td>
        <td>{of.stopped ? <Tag tone="bad">stopped</Tag> : <Tag tone="good">runs</Tag>}</td>
      </tr>
      <tr>
        <td colSpan={9}>
          <div className="histograms">
            <Histogram
              title="Duration"
              bins={of.duration_bins}
              limit={of.period_ns}
              limitName="period"
              greatest={greatest(of, "duration")}
            />
            <Histogram title="Jitter" bins={of.jitter_bins} limit={null} limitName="" greatest={greatest(of, "jitter")} />
          </div>
        </td>
      </tr>
    </>
  );
}

function greatest(of: SourceShown, what: "duration" | "jitter"): string {
  const most = what === "duration" ? of.duration_max_ns : of.jitter_max_ns;
  return of.counted ? `below ${duration(most)}` : duration(most);
}

export function Load(props: { of: number; name: string }) {
  return (
    <span className="load">
      <span className="quiet">load</span>
      <meter min={0} max={1} high={0.7} optimum={0} value={Math.min(props.of, 1)} aria-label={props.name} />
      <span className="figures">{percent(props.of)}</span>
    </span>
  );
}

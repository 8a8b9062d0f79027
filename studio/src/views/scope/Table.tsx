// SPDX-License-Identifier: Apache-2.0

import { useEffect, useRef } from "react";
import { count, figure, reading } from "../../design/numbers";
import { Tag } from "../../design/parts";
import { tr } from "../../language/text";
import { useForce } from "../../live/forced";
import { useWatched } from "../../shell/context";
import { colourOf, patternOf } from "./looks";
import type { Row } from "./messages";
import type { Scope } from "./scope";
import { type Setup, type TraceSetup, traceId, unitOf } from "./setup";
import { TraceMenu } from "./TraceMenu";

const COLUMNS = [
  ["newest", tr("scope.now"), tr("scope.theNewestValueOnTheScreen")],
  ["a", tr("scope.atA"), tr("scope.atCursorA")],
  ["b", tr("scope.atB"), tr("scope.atCursorB")],
  ["ba", "B − A", tr("scope.differenceOfTheValuesAtThe")],
  ["min", tr("scope.min"), tr("scope.minimumOnTheScreen")],
  ["max", tr("scope.max"), tr("scope.maximum")],
  ["mean", tr("scope.mean"), tr("scope.meanOfTheValues")],
  ["rms", tr("scope.rms"), tr("scope.rootOfTheMeanSquare")],
  ["deviation", "σ", tr("scope.standardDeviationTheRootOfThe")],
  ["pp", tr("scope.pp"), tr("scope.peakToPeak")],
  ["count", tr("scope.values2"), tr("scope.numberOfMeasuredValues")],
  ["hz", tr("scope.strongest"), tr("scope.theStrongestFrequencyAbove0Hz")],
  ["peak", tr("scope.level2"), tr("scope.levelOfTheStrongestFrequencyIn")],
] as const;

type Column = (typeof COLUMNS)[number][0];

/** The traces and their measurements over the visible span, updated several times per second without React. */
export function Table(props: { scope: Scope; chosen: string | null; choose: (id: string) => void }) {
  const { scope } = props;
  const setup = useWatched(scope.setup);
  const cursors = useWatched(scope.cursors) !== null;
  const status = useWatched(scope.status);
  const beside = useWatched(scope.beside)?.past.name ?? null;
  const body = useRef<HTMLTableSectionElement>(null);
  // biome-ignore lint/correctness/useExhaustiveDependencies: other rows and columns have to be written anew
  useEffect(() => {
    const write = () => {
      if (body.current) writeRows(body.current, scope.rows.get());
    };
    write();
    return scope.rows.watch(write);
  }, [scope, setup, cursors, status.has_reference, beside]);
  if (setup.traces.length === 0) return null;
  const isSpectral = setup.spectrum !== null;
  const columns = COLUMNS.filter(
    ([name]) => (cursors || !["a", "b", "ba"].includes(name)) && (isSpectral || !["hz", "peak"].includes(name)),
  );
  return (
    <section className="traces scroll-x" tabIndex={0} aria-label={tr("scope.traces")}>
      <table>
        <thead>
          <tr>
            <th>{tr("scope.trace")}</th>
            <th>{tr("scope.unit")}</th>
            {columns.map(([name, title, about]) => (
              <th key={name} className="number" title={about}>
                {name === "newest" && scope.past ? tr("scope.last") : title}
              </th>
            ))}
            <th>
              <span className="unseen">{tr("scope.actions")}</span>
            </th>
          </tr>
        </thead>
        <tbody ref={body}>
          {setup.traces.map((trace) => (
            <TraceRows
              key={traceId(trace)}
              {...props}
              trace={trace}
              setup={setup}
              columns={columns}
              reference={beside ?? (status.has_reference ? "reference" : null)}
            />
          ))}
        </tbody>
      </table>
    </section>
  );
}

function TraceRows(props: {
  scope: Scope;
  trace: TraceSetup;
  setup: Setup;
  columns: readonly (readonly [Column, string, string])[];
  /** Recording shown behind this one; null if there is none. */
  reference: string | null;
  chosen: string | null;
  choose: (id: string) => void;
}) {
  const { scope, trace, columns } = props;
  const id = traceId(trace);
  const unit = useWatched(scope.channels).get(trace.channel)?.unit || "";
  const refused = useWatched(scope.feeds.refused).get(trace.channel);
  const force = useForce(trace.channel);
  return (
    <>
      <tr data-trace={id} className={`${trace.hidden ? "hidden-trace" : ""} ${props.chosen === id ? "chosen" : ""}`}>
        <th scope="row">
          <button
            type="button"
            className="plain trace-name"
            aria-pressed={props.chosen === id}
            title={tr("scope.itsScaleIsAtTheLeft")}
            onClick={() => props.choose(id)}
          >
            <Swatch look={trace.look} /> {id}
            {force && (
              <Tag tone="warn" title={force}>
                {tr("scope.forced")}
              </Tag>
            )}
          </button>
          {refused && <div className="bad small">{refused.map((one) => one.message).join("; ")}</div>}
        </th>
        <td className="quiet">{unitOf(trace, unit || null) ?? ""}</td>
        {columns.map(([name]) => (
          <td key={name} className="number" data-cell={name}>
            –
          </td>
        ))}
        <td className="menu">
          <TraceMenu scope={scope} trace={trace} setup={props.setup} />
        </td>
      </tr>
      {props.reference !== null && (
        <tr data-trace={id} data-reference="true" className="quiet">
          <th scope="row" className="earlier">
            {props.reference}
          </th>
          <td />
          {columns.map(([name]) => (
            <td key={name} className="number" data-cell={name}>
              –
            </td>
          ))}
          <td />
        </tr>
      )}
    </>
  );
}

/** Colour and line pattern of a trace. */
export function Swatch(props: { look: number }) {
  return (
    <svg className="swatch" width="26" height="10" aria-hidden="true">
      <line
        x1="0"
        y1="5"
        x2="26"
        y2="5"
        stroke={`var(${colourOf(props.look)})`}
        strokeWidth="2.5"
        strokeDasharray={patternOf(props.look).join(" ")}
      />
    </svg>
  );
}

function writeRows(body: HTMLElement, rows: readonly Row[]): void {
  const known = new Map(rows.map((row) => [`${row.id}${row.reference}`, row]));
  for (const element of body.querySelectorAll<HTMLElement>("tr[data-trace]")) {
    const row = known.get(`${element.dataset.trace}${element.dataset.reference === "true"}`);
    for (const cell of element.querySelectorAll<HTMLElement>("[data-cell]")) {
      const text = row ? said(row, cell.dataset.cell as Column) : "–";
      if (cell.textContent !== text) cell.textContent = text;
    }
  }
}

function said(row: Row, column: Column): string {
  const { measures, a, b } = row;
  switch (column) {
    case "newest":
      return number(row.newest);
    case "a":
      return exactly(a);
    case "b":
      return exactly(b);
    case "ba":
      return exactly(a === null || b === null ? null : b - a);
    case "min":
      return number(measures?.min);
    case "max":
      return number(measures?.max);
    case "mean":
      return number(measures?.mean);
    case "rms":
      return number(measures?.rms);
    case "deviation":
      return number(measures?.deviation);
    case "count":
      return measures ? count(measures.count) : "–";
    case "hz":
      return exactly(row.spectrum?.peak?.hz);
    case "peak":
      return exactly(row.spectrum?.peak?.value);
    case "pp":
      return number(measures?.peak_to_peak);
  }
}

function number(value: number | null | undefined): string {
  return value === null || value === undefined ? "–" : figure(value);
}

/** Formats a number for a readout, with seven digits unless it is an integer; "–" if there is no number. */
function exactly(value: number | null | undefined): string {
  return value === null || value === undefined ? "–" : reading(value);
}

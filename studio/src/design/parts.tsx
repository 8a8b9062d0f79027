// SPDX-License-Identifier: Apache-2.0

import { type ReactNode, useId } from "react";
import { type Refusal, refusalsOf } from "../control/refusals";
import { tr } from "../language/text";
import { nameParts } from "./nameParts";
import "./parts.css";

/** A panel of a view with a heading; `end` is shown at the right of the heading. */
export function Panel(props: { title: ReactNode; end?: ReactNode; children: ReactNode; className?: string; flush?: boolean }) {
  const heading = useId();
  return (
    <section className={`panel ${props.className ?? ""}`} aria-labelledby={heading}>
      <header>
        <h2 id={heading}>{props.title}</h2>
        {props.end && <div className="end">{props.end}</div>}
      </header>
      <div className={props.flush ? "" : "inside"}>{props.children}</div>
    </section>
  );
}

export type Tone = "plain" | "good" | "warn" | "bad" | "critical" | "accent";

export function Tag(props: { tone?: Tone; children: ReactNode; title?: string }) {
  return (
    <span className={`tag ${props.tone ?? "plain"}`} title={props.title}>
      {props.children}
    </span>
  );
}

/** A name from a program, which wraps only between its parts. */
export function Name(props: { of: string }) {
  // biome-ignore lint/suspicious/noArrayIndexKey: a part is known by its place
  return nameParts(props.of).map((part, index) => [index > 0 && <wbr key={index} />, part]);
}

/** Text from a program, with words between backticks shown as code. */
export function Coded(props: { of: string }) {
  // biome-ignore lint/suspicious/noArrayIndexKey: a part is known by its place
  return props.of.split("`").map((part, index) => (index % 2 === 1 ? <code key={index}>{part}</code> : part));
}

/** Refusals of the system, each with its message and remedy. Screen readers announce them when they appear. */
export function Refusals(props: { of: Refusal[]; id?: string }) {
  if (props.of.length === 0) return null;
  return (
    <div className="refusals" role="alert" id={props.id}>
      <ul>
        {props.of.map((refusal) => (
          <li key={`${refusal.class}: ${refusal.message}`}>
            <span className="name">{refusal.class}</span>: {refusal.message}
            {refusal.remedy && <div className="quiet">{refusal.remedy}</div>}
            {refusal.place && (
              <div className="quiet small">{tr("design.atFileLine", { file: refusal.place.file, line: refusal.place.line })}</div>
            )}
          </li>
        ))}
      </ul>
    </div>
  );
}

/** Shows any error. */
export function Trouble(props: { of: unknown }) {
  return props.of ? <Refusals of={refusalsOf(props.of)} /> : null;
}

/** Placeholder for an empty view: states what would be shown there, and how to obtain it. */
export function Empty(props: { title: string; children?: ReactNode }) {
  return (
    <div className="empty">
      <strong>{props.title}</strong>
      {props.children}
    </div>
  );
}

// SPDX-License-Identifier: Apache-2.0
import type { ReactNode } from "react";
import { type Block, spansOf } from "./markdown";
import { helpOf } from "./topics";

/** The page of the docs about a view. */
export default function Help(props: { view: string }) {
  return (
    <article className="help-page" lang="en">
      {helpOf(props.view).map((block, index) => (
        // biome-ignore lint/suspicious/noArrayIndexKey: a page of the docs does not change
        <Part key={index} of={block} />
      ))}
    </article>
  );
}

function Part(props: { of: Block }): ReactNode {
  const { of } = props;
  if (of.kind === "heading") return <h3>{line(of.text)}</h3>;
  if (of.kind === "code") return <pre>{of.text}</pre>;
  if (of.kind === "text") return <p>{line(of.text)}</p>;
  if (of.kind === "list") {
    return (
      <ul>
        {of.items.map((item) => (
          <li key={item}>{line(item)}</li>
        ))}
      </ul>
    );
  }
  return (
    <dl>
      {of.rows.map(([name = "", ...says]) => (
        <div key={name}>
          <dt>{line(name)}</dt>
          <dd>{line(says.join(" · "))}</dd>
        </div>
      ))}
    </dl>
  );
}

function line(text: string): ReactNode[] {
  return spansOf(text).map((span, index) => {
    const key = `${index} ${span.text}`;
    if (span.kind === "code") return <code key={key}>{span.text}</code>;
    if (span.kind === "strong") return <strong key={key}>{span.text}</strong>;
    return span.kind === "emphasis" ? <em key={key}>{span.text}</em> : span.text;
  });
}

// SPDX-License-Identifier: Apache-2.0
import { useState } from "react";
import type { Value } from "../../../control/shapes";

/** A field whose text counts when it is left, or with Enter. */
export function TextField(props: { label: string; value: string; commit: (text: string) => void; placeholder?: string; list?: string }) {
  const [text, setText] = useState<string | null>(null);
  const commit = () => {
    if (text !== null && text.trim() !== props.value) props.commit(text.trim());
    setText(null);
  };
  return (
    <label className="row">
      <span className="quiet">{props.label}</span>
      <input
        value={text ?? props.value}
        placeholder={props.placeholder}
        list={props.list}
        onChange={(event) => setText(event.target.value)}
        onBlur={commit}
        onKeyDown={(event) => {
          if (event.key === "Enter") commit();
          if (event.key === "Escape") setText(null);
        }}
      />
    </label>
  );
}

/** The names in a text: "near.done, near.lost". */
export function words(text: string): string[] {
  return text.split(/[\s,]+/).filter(Boolean);
}

/** What a person writes as a value of a type: a number, a truth, a list. Nothing is the default. */
export function constantOf(text: string, type_text: string): { value: Value | undefined; wrong: string | null } {
  if (text === "") return { value: undefined, wrong: null };
  try {
    return { value: JSON.parse(text) as Value, wrong: null };
  } catch {
    return { value: undefined, wrong: `'${text}' is no ${type_text}: write a number, true, false, or a list [1, 2]` };
  }
}

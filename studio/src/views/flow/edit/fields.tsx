// SPDX-License-Identifier: Apache-2.0
import { useId, useState } from "react";
import type { Value } from "../../../control/shapes";
import { durationNs, type Read } from "../../../design/quantities";

/** A field whose text counts when it is left, or with Enter. What `commit` returns is why it does not: it stays, with the sentence. */
export function TextField(props: {
  label: string;
  value: string;
  // biome-ignore lint/suspicious/noConfusingVoidType: most fields take any text
  commit: (text: string) => string | null | void;
  placeholder?: string;
  list?: string;
}) {
  const [text, setText] = useState<string | null>(null);
  const [wrong, setWrong] = useState<string | null>(null);
  const id = useId();
  const commit = () => {
    const why = text !== null && text.trim() !== props.value ? props.commit(text.trim()) : null;
    setWrong(why ?? null);
    if (!why) setText(null);
  };
  return (
    <label className="row">
      <span className="quiet">{props.label}</span>
      <input
        aria-invalid={wrong !== null}
        aria-describedby={wrong === null ? undefined : id}
        data-typed={text === null ? "no" : "yes"}
        value={text ?? props.value}
        placeholder={props.placeholder}
        list={props.list}
        onChange={(event) => setText(event.target.value)}
        onBlur={commit}
        onKeyDown={(event) => {
          if (event.key === "Enter") commit();
          if (event.key !== "Escape") return;
          setText(null);
          setWrong(null);
        }}
      />
      {wrong && (
        <span className="wrong small" role="alert" id={id}>
          {wrong}
        </span>
      )}
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

/** What a person writes as an interval, ns; null: none. */
export function everyOf(text: string): Read<number | null> {
  if (text === "") return { value: null };
  const read = durationNs(text);
  return read.wrong !== undefined || read.value > 0 ? read : { wrong: `'${text}' is no interval: it must be more than 0` };
}

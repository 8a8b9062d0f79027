// SPDX-License-Identifier: Apache-2.0
import { useContext, useEffect, useId, useState } from "react";
import { Unread } from "./unread";

/**
 * A field whose text is committed when it loses focus or when the person presses Enter. If `commit` returns a reason, the text is kept
 * and the reason is shown.
 */
export function TextField(props: {
  label: string;
  value: string;
  // biome-ignore lint/suspicious/noConfusingVoidType: most fields take any text
  commit: (text: string) => string | null | void;
  placeholder?: string;
  list?: string | undefined;
  /** True if the field fills the available width. */
  wide?: boolean;
}) {
  const [text, setText] = useState<string | null>(null);
  const [wrong, setWrong] = useState<string | null>(null);
  const [id, name, field] = [useId(), useId(), useId()];
  const unread = useContext(Unread);
  const { label } = props;
  useEffect(() => {
    unread?.(field, wrong === null ? null : { id: field, label, wrong });
    return () => unread?.(field, null);
  }, [unread, field, label, wrong]);
  const commit = () => {
    const why = text !== null && text.trim() !== props.value ? props.commit(text.trim()) : null;
    setWrong(why ?? null);
    if (!why) setText(null);
  };
  return (
    <label className={props.wide ? "field wide" : "row"}>
      <span className={props.wide ? "name" : "quiet"} id={name}>
        {props.label}
      </span>
      <input
        id={field}
        // The error text is inside the label, but not part of the name.
        aria-labelledby={name}
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

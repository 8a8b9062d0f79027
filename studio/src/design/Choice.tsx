// SPDX-License-Identifier: Apache-2.0
import { type ReactNode, useId } from "react";

/** Selection of one of several options, with a label. */
export function Choice(props: {
  label: string;
  value: string;
  put: (value: string) => void;
  title?: string | undefined;
  wide?: boolean;
  children: ReactNode;
}) {
  const id = useId();
  return (
    <div className={props.wide ? "field wide" : "field"}>
      <label className="name" htmlFor={id}>
        {props.label}
      </label>
      <select id={id} value={props.value} title={props.title} onChange={(event) => props.put(event.target.value)}>
        {props.children}
      </select>
    </div>
  );
}

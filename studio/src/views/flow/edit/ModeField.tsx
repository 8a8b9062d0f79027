// SPDX-License-Identifier: Apache-2.0
import { TextField } from "../../../design/TextField";
import type { Mode } from "./definition";

/** Relation between a port's values and its block's invocations: either the one that the block declares, or one specified here. */
export function ModeField(props: { of: string; declared: string; mode: Mode | undefined; put: (mode: Mode | undefined) => void }) {
  const { mode, put } = props;
  const kind = mode === undefined ? "" : typeof mode === "string" ? mode : "ratio";
  const chosen = (name: string): Mode | undefined => {
    if (name === "synchronous" || name === "asynchronous") return name;
    return name === "ratio" ? { ratio: 2 } : undefined;
  };
  return (
    <div className="row">
      <select aria-label={`Mode of ${props.of}`} value={kind} onChange={(event) => put(chosen(event.target.value))}>
        <option value="">as declared: {props.declared}</option>
        <option value="synchronous">synchronous</option>
        <option value="asynchronous">asynchronous</option>
        <option value="ratio">ratio</option>
      </select>
      {typeof mode === "object" && (
        <TextField
          label="values per invocation"
          value={String(mode.ratio)}
          commit={(text) => {
            if (!/^[1-9]\d*$/.test(text)) return `'${text}' is not a ratio: write an integer of at least 1`;
            put({ ratio: Number(text) });
          }}
        />
      )}
    </div>
  );
}

// SPDX-License-Identifier: Apache-2.0

import { TextField } from "../../../design/TextField";
import { tr } from "../../../language/text";
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
      <select aria-label={tr("flow.modeOfOf", { of: props.of })} value={kind} onChange={(event) => put(chosen(event.target.value))}>
        <option value="">{tr("flow.asDeclaredDeclared", { declared: props.declared })}</option>
        <option value="synchronous">{tr("flow.synchronous")}</option>
        <option value="asynchronous">{tr("flow.asynchronous")}</option>
        <option value="ratio">{tr("flow.ratio")}</option>
      </select>
      {typeof mode === "object" && (
        <TextField
          label={tr("flow.valuesPerInvocation")}
          value={String(mode.ratio)}
          commit={(text) => {
            if (!/^[1-9]\d*$/.test(text)) return tr("flow.textIsNotARatioWrite", { text });
            put({ ratio: Number(text) });
          }}
        />
      )}
    </div>
  );
}

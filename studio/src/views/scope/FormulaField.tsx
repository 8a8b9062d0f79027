// SPDX-License-Identifier: Apache-2.0

import { useId, useState } from "react";
import { tr } from "../../language/text";
import { useWatched } from "../../shell/context";
import type { Scope } from "./scope";
import { withFormula } from "./setup";

/** Field for defining a trace that is computed from traces on the screen. */
export function FormulaField(props: { scope: Scope }) {
  const { scope } = props;
  const setup = useWatched(scope.setup);
  const [text, setText] = useState("");
  const [wrong, setWrong] = useState("");
  const [field, why] = [useId(), useId()];
  if (!setup.traces.some((trace) => trace.component !== null)) return null;
  return (
    <form
      className="formula"
      onSubmit={(event) => {
        event.preventDefault();
        try {
          scope.change(withFormula(setup, text.trim()));
          setText("");
          setWrong("");
        } catch (refused) {
          setWrong(refused instanceof Error ? refused.message : String(refused));
        }
      }}
    >
      <label htmlFor={field}>{tr("scope.formula")}</label>
      <input
        id={field}
        value={text}
        placeholder="abs(force) - 5"
        aria-invalid={wrong !== ""}
        aria-describedby={wrong === "" ? undefined : why}
        onChange={(event) => setText(event.target.value)}
      />
      <button type="submit" disabled={text.trim() === ""}>
        {tr("scope.add")}
      </button>
      {wrong !== "" && (
        <span id={why} className="wrong small" role="alert">
          {wrong}
        </span>
      )}
    </form>
  );
}

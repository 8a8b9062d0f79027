// SPDX-License-Identifier: Apache-2.0

import { useState } from "react";
import type { Within } from "../../control/shapes";
import { Refusals } from "../../design/parts";
import { tr } from "../../language/text";
import { useAction, useControl } from "../../shell/context";
import { valueFrom, wrongText } from "../verbs/fields";

/** Maximum length of a text that is whole in the empty field. */
const PLACEHOLDER_MAX = 9;

/** Field that writes an SVV with a range, which programming systems may write. */
export function WriteField(props: { name: string; type_text: string; within: Within }) {
  const control = useControl();
  const action = useAction();
  const [text, setText] = useState("");
  const value = valueFrom(text, props.type_text);
  const wrong = wrongText(text, props.type_text);
  const { within } = props;
  const range = typeof within === "string" ? within : tr("devices.withinToWithin2", { within: within[0], within2: within[1] });
  return (
    <form
      className="write"
      data-commands
      onSubmit={(event) => {
        event.preventDefault();
        if (value !== undefined && wrong === null)
          void action.run(() => control.order("write", { name: props.name, value })).then((done) => done && setText(""));
      }}
    >
      <input
        aria-label={tr("devices.newValueOfName", { name: props.name })}
        size={7}
        value={text}
        title={range}
        // A longer range would be cut off.
        placeholder={range.length <= PLACEHOLDER_MAX ? range : ""}
        onChange={(event) => setText(event.target.value)}
      />
      <button type="submit" disabled={action.busy || value === undefined || wrong !== null}>
        {tr("devices.write2")}
      </button>
      {wrong && (
        <p className="wrong" role="alert">
          {wrong}
        </p>
      )}
      <Refusals of={action.refusals} />
    </form>
  );
}

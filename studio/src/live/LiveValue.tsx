// SPDX-License-Identifier: Apache-2.0

import { useEffect, useRef } from "react";
import { isFloat, valueText } from "../design/numbers";
import { unitText } from "../design/units";
import { tr } from "../language/text";
import { useControl } from "../shell/context";
import { useForce } from "./forced";
import { isStored } from "./stored";

/**
 * The current value of an SVV or private cell, written into the page without React. Shows `–` before the first value; if the name does
 * not exist in the system, the title gives the reason.
 */
export function LiveValue(props: {
  name: string;
  type_text?: string | undefined;
  unit?: string | null | undefined;
  /** Display of a value that has never been stored: as the initial value in grey, or as no value. */
  initial?: "grey" | "none";
}) {
  const control = useControl();
  const element = useRef<HTMLSpanElement>(null);
  const { name, type_text, initial = "grey" } = props;
  const force = useForce(name);
  useEffect(() => {
    const float = isFloat(type_text);
    return control.values.watch(name, (reading, missing) => {
      const shown = element.current;
      if (!shown) return;
      const isInitial = reading !== null && !isStored(reading);
      shown.textContent = reading && !(isInitial && initial === "none") ? valueText(reading.value, float) : "–";
      shown.title = missing ? missing.map((refusal) => refusal.message).join("; ") : isInitial ? tr("live.noValueStoredYet") : "";
      shown.classList.toggle("initial", isInitial);
    });
  }, [control, name, type_text, initial]);
  return (
    <span className={`live ${force ? "forced" : ""}`} title={force ?? undefined}>
      {force && <span className="unseen">{force}: </span>}
      <span className="figures" ref={element} data-live={name}>
        –
      </span>
      {props.unit && <span className="quiet">{`\u202f${unitText(props.unit)}`}</span>}
    </span>
  );
}

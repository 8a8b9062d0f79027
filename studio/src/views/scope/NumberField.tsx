// SPDX-License-Identifier: Apache-2.0

import { type ReactNode, useEffect, useId, useState } from "react";
import { numberIn } from "../../design/quantities";
import { tr } from "../../language/text";

/** A numeric field that is committed with Enter or when it loses focus. An invalid or out-of-range number is rejected with the reason. */
export function NumberField(props: {
  label: string;
  unit: string | null;
  value: number;
  minimum?: number;
  maximum?: number;
  disabled?: boolean;
  put: (value: number) => void;
  children?: ReactNode;
}) {
  const { value, minimum = Number.NEGATIVE_INFINITY, maximum = Number.POSITIVE_INFINITY } = props;
  const shown = String(Number(value.toPrecision(6)));
  const id = useId();
  const [typed, setTyped] = useState(shown);
  useEffect(() => setTyped(shown), [shown]);
  const read = numberIn(typed, props.unit ?? "");
  const number = read.value ?? Number.NaN;
  const why =
    read.wrong ?? (number < minimum || number > maximum ? tr("scope.writeMinimum", { minimum: rangeText(minimum, maximum) }) : null);
  const wrong = why !== null;
  const take = () => {
    if (!wrong && typed !== shown) props.put(number);
  };
  return (
    <div className="field wide">
      <label>
        <span className="name">{props.label}</span>
        <input
          className="figure-field"
          inputMode="decimal"
          value={typed}
          disabled={props.disabled}
          aria-invalid={wrong}
          aria-describedby={wrong ? id : undefined}
          onChange={(event) => setTyped(event.target.value)}
          onBlur={take}
          onKeyDown={(event) => {
            if (event.key === "Enter") take();
            if (event.key === "Escape") setTyped(shown);
          }}
        />
      </label>
      {props.unit && <span className="quiet">{props.unit}</span>}
      {wrong && (
        <span className="wrong small" role="alert" id={id}>
          {why}
        </span>
      )}
      {props.children}
    </div>
  );
}

function rangeText(minimum: number, maximum: number): string {
  const bounds = [
    Number.isFinite(minimum) ? tr("scope.atLeastMinimum", { minimum }) : "",
    Number.isFinite(maximum) ? tr("scope.atMostMaximum", { maximum }) : "",
  ].filter(Boolean);
  return [tr("scope.aNumber"), ...bounds].join(", ");
}

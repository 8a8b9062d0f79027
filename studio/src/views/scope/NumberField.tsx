// SPDX-License-Identifier: Apache-2.0
import { type ReactNode, useEffect, useState } from "react";

/** A number that is taken with Enter, or when the field is left; one that is not a number, or out of its range, is marked and not taken. */
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
  const shown = String(Number(value.toPrecision(9)));
  const [typed, setTyped] = useState(shown);
  useEffect(() => setTyped(shown), [shown]);
  const number = Number(typed);
  const wrong = typed.trim() === "" || !Number.isFinite(number) || number < minimum || number > maximum;
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
          title={wrong ? rangeText(minimum, maximum) : undefined}
          onChange={(event) => setTyped(event.target.value)}
          onBlur={take}
          onKeyDown={(event) => {
            if (event.key === "Enter") take();
            if (event.key === "Escape") setTyped(shown);
          }}
        />
      </label>
      {props.unit && <span className="quiet">{props.unit}</span>}
      {props.children}
    </div>
  );
}

function rangeText(minimum: number, maximum: number): string {
  const bounds = [Number.isFinite(minimum) ? `at least ${minimum}` : "", Number.isFinite(maximum) ? `at most ${maximum}` : ""].filter(
    Boolean,
  );
  return ["a number", ...bounds].join(", ");
}

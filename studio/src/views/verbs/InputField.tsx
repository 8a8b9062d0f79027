// SPDX-License-Identifier: Apache-2.0

import { useId } from "react";
import type { Refusal } from "../../control/refusals";
import type { FormInput } from "../../control/shapes";
import { Refusals } from "../../design/parts";
import { unitText } from "../../design/units";
import { tr } from "../../language/text";
import { useControl } from "../../shell/context";
import type { Bounds } from "./bounds";
import { degreesOf, endText, isPosition, limitsAt, limitText } from "./fields";

/** Field for an input, with its unit, limits and default; an array has a field for each element. */
export function InputField(props: {
  of: FormInput;
  texts: string[];
  devices: string[];
  bounds: Bounds | null;
  write: (texts: string[]) => void;
  missing: string | undefined;
  refusals: Refusal[];
}) {
  const { of, texts, devices, bounds, write, missing } = props;
  const id = useId();
  const wrong = missing !== undefined || props.refusals.length > 0;
  const labelled = devices.length === texts.length;
  const one = (index: number) => (
    <input
      id={`${id}-${index}`}
      value={texts[index] ?? ""}
      size={texts.length > 1 ? 8 : 14}
      aria-invalid={wrong}
      aria-describedby={`${id}-about`}
      required={of.required}
      placeholder={placeholder(of, index)}
      onChange={(event) => write(texts.map((text, at) => (at === index ? event.target.value : text)))}
    />
  );
  return (
    <div className="input">
      {texts.length === 1 && !labelled ? (
        <div className="row">
          <label htmlFor={`${id}-0`}>{of.name}</label>
          {one(0)}
          <span className="quiet small">{degreesOf(texts[0] ?? "", of.unit)}</span>
        </div>
      ) : (
        <fieldset className="elements">
          <legend>{of.name}</legend>
          {texts.map((_, index) => (
            // biome-ignore lint/suspicious/noArrayIndexKey: an element is known by its place
            <label key={index} htmlFor={`${id}-${index}`}>
              <span className="quiet small">{labelled ? devices[index]?.split(".").at(-1) : `[${index}]`}</span>
              {one(index)}
              <span className="quiet small">
                {[degreesOf(texts[index] ?? "", of.unit), endsWithin(of, limitsAt(bounds, index, of.unit))].filter(Boolean).join(" · ")}
              </span>
            </label>
          ))}
          {labelled && texts.length > 0 && <Fill of={of} devices={devices} texts={texts} write={write} />}
        </fieldset>
      )}
      <p className="quiet small" id={`${id}-about`}>
        {[
          unitText(of.unit),
          endsWithin(of, range(of, bounds)),
          of.counted_from === null ? "" : tr("verbs.countedFromCountedFrom", { counted_from: of.counted_from }),
          of.default === null || of.default === undefined ? "" : tr("verbs.defaultDefault", { default: limitText(of.default, of.unit) }),
          of.doc,
        ]
          .filter(Boolean)
          .join(" · ")}
      </p>
      {missing && (
        <p className="wrong" role="alert">
          {missing}
        </p>
      )}
      <Refusals of={props.refusals} />
    </div>
  );
}

function placeholder(of: FormInput, index: number): string {
  if (of.default === null || of.default === undefined) return "";
  const shown = Array.isArray(of.default) ? of.default[index] : of.default;
  return typeof shown === "object" ? "" : String(shown);
}

/** Describes a range. For a relative value, its sum with the current value must be within the range. */
function endsWithin(of: FormInput, range: string): string {
  return of.counted_from === null || range === "" ? range : tr("verbs.endsWithinRange", { range });
}

function range(of: FormInput, bounds: Bounds | null): string {
  if (of.minimum === null && of.maximum === null) return "";
  // If elements have different ranges, these are shown at their fields.
  if ((bounds?.minimum.length ?? 0) > 1 || (bounds?.maximum.length ?? 0) > 1) return "";
  const of_ends = (found: Bounds["minimum"] | undefined, said: FormInput["minimum"]) =>
    found && found.length > 0 ? endText(found[0] ?? null, of.unit) : limitText(said, null);
  const low = of_ends(bounds?.minimum, of.minimum);
  const high = of_ends(bounds?.maximum, of.maximum);
  if (low === "") return tr("verbs.upToHigh", { high });
  if (high === "") return tr("verbs.fromLow", { low });
  return tr("verbs.lowToHigh", { low, high });
}

/** Buttons that fill all elements with the first one, or with the current positions of the devices. */
function Fill(props: { of: FormInput; devices: string[]; texts: string[]; write: (texts: string[]) => void }) {
  const control = useControl();
  const { of, devices, texts, write } = props;
  // Present positions are useful only for positions. Those counted from the present one would include it twice.
  const positions = isPosition(of.unit) && of.counted_from === null;
  return (
    <div className="fill row">
      {texts.length > 1 && (
        <button
          type="button"
          title={tr("verbs.useTheFirstValueForAll")}
          disabled={!texts[0]}
          onClick={() => write(texts.map(() => texts[0] ?? ""))}
        >
          {tr("verbs.sameForAll")}
        </button>
      )}
      {positions && (
        <button
          type="button"
          title={tr("verbs.useThePresentValuesOfThe")}
          onClick={() => {
            const names = devices.map((device) => `${device}.sensed`);
            void control.look("read", { names }).then(
              ({ values }) => write(names.map((name) => String(Number(Number(values[name]?.value).toFixed(6))))),
              // Devices without `sensed` have no position to fill in.
              () => undefined,
            );
          }}
        >
          {tr("verbs.present")}
        </button>
      )}
    </div>
  );
}

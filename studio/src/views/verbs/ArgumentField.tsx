// SPDX-License-Identifier: Apache-2.0

import { useId } from "react";
import type { Refusal } from "../../control/refusals";
import type { FormArgument } from "../../control/shapes";
import { Refusals } from "../../design/parts";
import { unitText } from "../../design/units";
import { tr, trWord } from "../../language/text";
import { families } from "./arguments";

/** Field for an argument of the verb: one device, several devices, an SVV or a channel. */
export function ArgumentField(props: {
  of: FormArgument;
  options: string[];
  chosen: string[];
  choose: (names: string[]) => void;
  missing: string | undefined;
  refusals: Refusal[];
}) {
  const { of, options, chosen, choose, missing } = props;
  const id = useId();
  const wrong = missing !== undefined || props.refusals.length > 0;
  const about = (
    <>
      {missing && (
        <p className="wrong" role="alert">
          {missing}
        </p>
      )}
      <Refusals of={props.refusals} />
    </>
  );
  if (of.kind === "group") return <Group {...props} about={about} />;
  return (
    <div>
      <div className="row">
        <label htmlFor={id}>{of.name}</label>
        {of.kind === "svv" ? (
          <>
            <input
              id={id}
              list={`${id}-names`}
              value={chosen[0] ?? ""}
              aria-invalid={wrong}
              onChange={(event) => choose(event.target.value ? [event.target.value] : [])}
            />
            <datalist id={`${id}-names`}>
              {options.map((name) => (
                <option key={name} value={name} />
              ))}
            </datalist>
          </>
        ) : (
          <select
            id={id}
            value={chosen[0] ?? ""}
            aria-invalid={wrong}
            onChange={(event) => choose(event.target.value ? [event.target.value] : [])}
          >
            <option value="">{tr("verbs.chooseAKind", { kind: trWord(of.kind) })}</option>
            {options.map((name) => (
              <option key={name} value={name}>
                {name.replace("/", ": ")}
              </option>
            ))}
          </select>
        )}
        <span className="quiet">{[of.kind, of.of ?? of.type_text, unitText(of.unit), of.doc].filter(Boolean).join(" · ")}</span>
      </div>
      {about}
    </div>
  );
}

function Group(props: {
  of: FormArgument;
  options: string[];
  chosen: string[];
  choose: (names: string[]) => void;
  about: React.ReactNode;
}) {
  const { of, options, chosen, choose } = props;
  return (
    <fieldset className="group">
      <legend>
        {of.name} <span className="quiet">{of.of ? tr("verbs.severalOf", { of: of.of }) : tr("verbs.severalDevices")}</span>
      </legend>
      {options.length === 0 && <p className="quiet">{tr("verbs.thisSystemHasNoLogicalDevice", { of: of.of })}</p>}
      {families(options).map(({ family, names }) => {
        const all = names.every((name) => chosen.includes(name));
        return (
          <div className="row" key={family}>
            {family !== "" && names.length > 1 && (
              <button
                type="button"
                aria-pressed={all}
                onClick={() =>
                  choose(
                    all
                      ? chosen.filter((name) => !names.includes(name))
                      : options.filter((name) => chosen.includes(name) || names.includes(name)),
                  )
                }
              >
                {family}
              </button>
            )}
            {names.map((name) => (
              <label key={name}>
                <input
                  type="checkbox"
                  checked={chosen.includes(name)}
                  onChange={(event) => choose(options.filter((one) => (one === name ? event.target.checked : chosen.includes(one))))}
                />
                {family === "" ? name : name.slice(family.length + 1)}
              </label>
            ))}
          </div>
        );
      })}
      {props.about}
    </fieldset>
  );
}

// SPDX-License-Identifier: Apache-2.0

import { useId, useMemo, useState } from "react";
import { isLate } from "../../control/late";
import { RefusalError } from "../../control/refusals";
import type { InstalledInstance, Value, VerbForm } from "../../control/shapes";
import { Panel, Refusals } from "../../design/parts";
import { durationNs, type ReadResult } from "../../design/quantities";
import { tr } from "../../language/text";
import { useConfiguration } from "../../shell/configuration";
import { useAction, useControl } from "../../shell/context";
import { ArgumentField } from "./ArgumentField";
import { argumentsOf, type Choices, choicesOf, devicesOf, firstChoices } from "./arguments";
import { useBounds } from "./bounds";
import { arrayOf, byField, elements, gaps, valueFrom, wrongText } from "./fields";
import { InputField } from "./InputField";

/** Contents of a form. */
interface FilledForm {
  chosen: Choices;
  texts: Record<string, string[]>;
  source: string;
  limit: string;
}

const EMPTY: FilledForm = { chosen: {}, texts: {}, source: "", limit: "" };

/** Forms of this page by verb, which are kept when another view or verb is shown. */
const written = new Map<string, FilledForm>();

/** Instances, by verb, whose creation took too long for the press that requested them. The next press starts them. */
const kept = new Map<string, { application: string; instance: number }>();

/** Key of the time limit; it cannot be the name of an input. */
const TIME_LIMIT = tr("verbs.timeLimit");

/** Form that starts a verb: its arguments, its inputs, and its placement. Refusals are shown next to the fields concerned. */
export function StartForm(props: { form: VerbForm; instances: InstalledInstance[] }) {
  const { form } = props;
  const control = useControl();
  const action = useAction();
  const configuration = useConfiguration();
  const options = useMemo(() => choicesOf(form, configuration), [form, configuration]);
  const [filled, fillIn] = useState<FilledForm>(() => written.get(form.name) ?? EMPTY);
  const { chosen, texts, source, limit } = filled;
  const write = (change: Partial<FilledForm>) => {
    const next = change === EMPTY ? EMPTY : { ...filled, ...change };
    written.set(form.name, next);
    fillIn(next);
  };
  const [missing, setMissing] = useState<Record<string, string>>({});
  const choices = useMemo(() => ({ ...firstChoices(form, options), ...chosen }), [form, options, chosen]);
  const devices = useMemo(() => devicesOf(form, choices), [form, choices]);
  const bounds = useBounds(form, choices);
  const { of: refused, rest } = byField(
    action.refusals,
    [...form.inputs, ...form.arguments].map((one) => one.name),
  );
  const timeLimit = useId();
  const where = useId();

  const start = async () => {
    const values: Record<string, Value> = {};
    const absent: Record<string, string> = {};
    for (const input of form.inputs) {
      const typed = texts[input.name] ?? [];
      const size = elements(input.type_text, devices.length);
      const wrong = typed.map((text) => wrongText(text, input.type_text)).find((one) => one !== null);
      if (wrong) {
        absent[input.name] = wrong;
        continue;
      }
      const value = size === null ? valueFrom(typed[0] ?? "", input.type_text) : arrayOf(fill(typed, size), input.type_text);
      if (size !== null && gaps(fill(typed, size)).length > 0) absent[input.name] = tr("verbs.enterAValueForEachOr");
      else if (value !== undefined) values[input.name] = value;
      else if (input.required) absent[input.name] = tr("verbs.enterAValue");
    }
    for (const argument of form.arguments) {
      if ((choices[argument.name] ?? []).length === 0)
        absent[argument.name] = tr("verbs.choose", {
          part: argument.kind === "group" ? tr("verbs.devices") : tr("verbs.aKind", { kind: argument.kind }),
        });
    }
    const time = limitOf(limit);
    if (time.wrong !== undefined) absent[TIME_LIMIT] = time.wrong;
    setMissing(absent);
    if (Object.keys(absent).length > 0) return;
    const pressed = control.pressed();
    await action.run(async () => {
      const application = {
        verb: form.name,
        arguments: argumentsOf(form, choices),
        ...(source && { placement: { "*": source } }),
      };
      // Ended instances that this page created are deleted; their reports are kept.
      for (const ended of props.instances) {
        if (ended.state === "ended" && control.started.made(ended.id)) await control.order("delete", { instance: ended.id });
      }
      const asked = JSON.stringify(application);
      const before = kept.get(form.name);
      kept.delete(form.name);
      const isThere = before && props.instances.some((one) => one.id === before.instance && one.state === "created");
      const isSame = isThere && before.application === asked;
      if (isThere && !isSame) await control.order("delete", { instance: before.instance });
      const instance = isSame ? before.instance : await control.order("create", application, undefined, pressed);
      try {
        const limits = time.value !== null && time.value !== undefined ? { limits: { time_limit_ns: time.value } } : {};
        await control.order("start", { instance, values, ...limits }, undefined, pressed);
      } catch (why) {
        if (isLate(control, pressed)) kept.set(form.name, { application: asked, instance });
        else if (why instanceof RefusalError) await control.order("delete", { instance });
        throw why;
      }
    });
  };

  return (
    <Panel title={tr("verbs.startName", { name: form.name })}>
      <form
        className="start stack"
        data-commands
        noValidate
        onSubmit={(event) => {
          event.preventDefault();
          void start();
        }}
      >
        {form.arguments.map((argument) => (
          <ArgumentField
            key={argument.name}
            of={argument}
            options={options[argument.name] ?? []}
            chosen={choices[argument.name] ?? []}
            choose={(names) => write({ chosen: { ...chosen, [argument.name]: names } })}
            missing={missing[argument.name]}
            refusals={refused.get(argument.name) ?? []}
          />
        ))}
        {form.inputs.map((input) => (
          <InputField
            key={input.name}
            of={input}
            texts={fill(texts[input.name] ?? [], elements(input.type_text, devices.length) ?? 1)}
            devices={devices}
            bounds={bounds.get(input.name) ?? null}
            write={(of) => write({ texts: { ...texts, [input.name]: of } })}
            missing={missing[input.name]}
            refusals={refused.get(input.name) ?? []}
          />
        ))}
        <div className="row">
          <label htmlFor={timeLimit}>{tr("verbs.timeLimit2")}</label>
          <input
            id={timeLimit}
            size={6}
            value={limit}
            placeholder={tr("verbs.none")}
            aria-invalid={missing[TIME_LIMIT] !== undefined}
            onChange={(event) => write({ limit: event.target.value })}
          />
          <span className="quiet">{tr("verbs.sOrWithItsUnit500")}</span>
          <label htmlFor={where}>{tr("verbs.runsOn")}</label>
          <select id={where} value={source} onChange={(event) => write({ source: event.target.value })}>
            <option value="">{tr("verbs.chosenByTheSystem")}</option>
            {Object.keys(configuration?.sources ?? {}).map((name) => (
              <option key={name}>{name}</option>
            ))}
          </select>
        </div>
        {missing[TIME_LIMIT] && (
          <p className="wrong" role="alert">
            {tr("verbs.timeLimitMissing", { missing: missing[TIME_LIMIT] })}
          </p>
        )}
        <div className="actions">
          <Refusals of={rest} />
          <div className="row">
            <button type="button" className="clear" disabled={filled === EMPTY} onClick={() => write(EMPTY)}>
              {tr("verbs.clear")}
            </button>
            <button type="submit" className="primary" disabled={action.busy}>
              {tr("verbs.start")}
            </button>
          </div>
        </div>
      </form>
    </Panel>
  );
}

/** Parses the text of the time limit, ns; null if the text is empty. */
export function limitOf(text: string): ReadResult<number | null> {
  if (text.trim() === "") return { value: null };
  const read = durationNs(text, "s");
  if (read.wrong !== undefined || read.value > 0) return read;
  return { wrong: tr("verbs.textIsNotAValidTime", { text: text.trim() }) };
}

function fill(texts: string[], size: number): string[] {
  return Array.from({ length: size }, (_, index) => texts[index] ?? "");
}

// SPDX-License-Identifier: Apache-2.0

import { useId, useState } from "react";
import type { DriverOption, DriverService } from "../../control/shapes";
import { Refusals } from "../../design/parts";
import { tr } from "../../language/text";
import { useAction, useControl } from "../../shell/context";
import { answerText, argumentsOfService } from "./services";

/** Acyclic services of a device's driver, each as a form with fields for its arguments by kind and unit. */
export function Services(props: { device: string; of: DriverService[] }) {
  if (props.of.length === 0) return null;
  return (
    <details>
      <summary>
        {tr("devices.countServices", { count: props.of.length })}: {props.of.map((service) => service.name).join(", ")}
      </summary>
      <ul className="services">
        {props.of.map((service) => (
          <li key={service.name}>
            <Service device={props.device} of={service} />
          </li>
        ))}
      </ul>
    </details>
  );
}

function Service(props: { device: string; of: DriverService }) {
  const { device, of } = props;
  const control = useControl();
  const action = useAction();
  const [texts, setTexts] = useState<Record<string, string>>({});
  const [wrong, setWrong] = useState<Record<string, string>>({});
  const [answer, setAnswer] = useState<string | null>(null);
  const ask = () => {
    const { given, wrong: found } = argumentsOfService(of, texts);
    setWrong(found);
    setAnswer(null);
    if (Object.keys(found).length > 0) return;
    void action.run(async () =>
      setAnswer(answerText(await control.order("device_service", { device, service: of.name, arguments: given }))),
    );
  };
  return (
    <form
      className="service"
      data-commands
      aria-label={tr("devices.serviceNameOfDevice", { name: of.name, device })}
      noValidate
      onSubmit={(event) => {
        event.preventDefault();
        ask();
      }}
    >
      <p>
        <strong>{of.name}</strong> <span className="quiet">{of.moves ? tr("devices.docMovesTheMachine", { doc: of.doc }) : of.doc}</span>
      </p>
      {of.arguments.map((option) => (
        <Argument
          key={option.name}
          of={option}
          text={texts[option.name] ?? ""}
          write={(text) => setTexts({ ...texts, [option.name]: text })}
          wrong={wrong[option.name]}
        />
      ))}
      <div className="row">
        <button
          type="submit"
          disabled={action.busy || !control.may("operate")}
          title={control.may("operate") ? undefined : tr("devices.needsTheRoleOperate")}
        >
          {action.busy ? tr("devices.calling") : tr("devices.call")}
        </button>
        {answer !== null && (
          <output className="figures answer" aria-label={tr("devices.answerOfName", { name: of.name })}>
            {answer}
          </output>
        )}
      </div>
      <Refusals of={action.refusals} />
    </form>
  );
}

function Argument(props: { of: DriverOption; text: string; write: (text: string) => void; wrong: string | undefined }) {
  const { of, text, write, wrong } = props;
  const id = useId();
  return (
    <div>
      <div className="row">
        <label htmlFor={id}>{of.name}</label>
        {of.kind === "bool" ? (
          <select id={id} value={text} aria-invalid={wrong !== undefined} onChange={(event) => write(event.target.value)}>
            <option value="">{of.default === null ? tr("devices.choose") : tr("devices.defaultDefault", { default: of.default })}</option>
            <option>{tr("devices.true")}</option>
            <option>{tr("devices.false")}</option>
          </select>
        ) : (
          <input
            id={id}
            size={of.kind === "text" ? 20 : 10}
            value={text}
            placeholder={of.default ?? ""}
            aria-invalid={wrong !== undefined}
            onChange={(event) => write(event.target.value)}
          />
        )}
        <span className="quiet small">{[of.kind, of.unit, of.doc].filter(Boolean).join(" · ")}</span>
      </div>
      {wrong && (
        <p className="wrong" role="alert">
          {wrong}
        </p>
      )}
    </div>
  );
}

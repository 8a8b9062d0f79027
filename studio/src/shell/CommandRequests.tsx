// SPDX-License-Identifier: Apache-2.0

import { useState } from "react";
import { personOf } from "../control/command";
import type { AskingSession, Holder } from "../control/shapes";
import { Refusals } from "../design/parts";
import { tr, trWord } from "../language/text";
import { useAction, useLive, useWatched } from "./context";

/** Form for entering the name of the person who requests command, and the reason. */
export function RequestForm(props: { done: () => void }) {
  const control = useLive();
  const action = useAction();
  const person = useWatched(control.session.person);
  const [reason, setReason] = useState("");
  const [name, setName] = useState(person);
  const ask = async () => {
    await control.session.open();
    await control.session.introduce(name);
    await control.command.request(reason.trim());
  };
  return (
    <form
      className="request row"
      aria-label={tr("shell.requestCommand")}
      onSubmit={(event) => {
        event.preventDefault();
        void action.run(ask).then((done) => done && props.done());
      }}
    >
      <label>
        {tr("shell.yourName")}{" "}
        <input value={name} maxLength={64} size={14} autoComplete="name" onChange={(event) => setName(event.target.value)} />
      </label>
      <label>
        {tr("shell.reason")} <input value={reason} maxLength={200} size={24} onChange={(event) => setReason(event.target.value)} />
      </label>
      <button type="submit" className="primary" disabled={action.busy}>
        {tr("shell.send")}
      </button>
      <button type="button" onClick={props.done}>
        {tr("shell.cancel")}
      </button>
      <Refusals of={action.refusals} />
    </form>
  );
}

/**
 * Requests for command, over the full width: requests by others if this page has command, its own pending request, and the outcome of
 * that request.
 */
export function CommandRequests() {
  const control = useLive();
  const state = useWatched(control.command.state);
  const name = useWatched(control.session.name);
  const [seen, setSeen] = useState(0);
  if (name === null || !control.may("operate")) return null;
  const own = state.requests.find((one) => one.name === name);
  const over = settledOf(state, name, seen);
  return (
    <>
      {state.holder === name && state.requests.map((one) => <Asked key={one.number} of={one} />)}
      {own && <Waiting of={own} holder={state} />}
      {over && !own && (
        <div className={`notice ${over.outcome === "granted" ? "good" : "warn"}`} role="status">
          <span className="said">{wordsOf(over)}</span>
          <button type="button" onClick={() => setSeen(over.number)}>
            {tr("shell.dismiss")}
          </button>
        </div>
      )}
    </>
  );
}

type SettledRequest = Holder["settled"][number];

/** Returns the latest settled request of a session, unless it was dismissed. */
export function settledOf(state: Holder, name: string, seen: number): SettledRequest | null {
  const last = state.settled.findLast((one) => one.name === name);
  return last && last.number > seen && last.by !== name ? last : null;
}

/** Describes the outcome of a request of this page in one sentence. */
export function wordsOf(of: SettledRequest): string {
  const by = of.by ? ` ${tr("shell.byBy", { by: of.by })}` : "";
  const reason = of.reason ? `: ${of.reason}` : "";
  if (of.outcome === "granted") return tr("shell.commandWasGrantedToThisPagereason", { reason });
  if (of.outcome === "timed_out") return tr("shell.nobodyAnsweredTheRequestForCommandreason", { reason });
  return tr("shell.theRequestForCommandWasOutcomebyreason", { outcome: trWord(of.outcome), by, reason });
}

function Waiting(props: { of: AskingSession; holder: Holder }) {
  const control = useLive();
  const action = useAction();
  return (
    <div className="notice warn" role="status" data-commands>
      <span className="said">
        {tr("shell.waitingFor")} {props.holder.holder ?? tr("shell.nobody")}
        {props.holder.holder !== null && ` (${personOf(props.holder)})`} {tr("shell.toHandOverCommand")}
      </span>{" "}
      <span className="quiet figures">{tr("shell.leftMsSMore", { left_ms: Math.ceil(props.of.left_ms / 1000) })}</span>
      <button type="button" disabled={action.busy} onClick={() => action.run(() => control.command.withdraw())}>
        {tr("shell.withdraw")}
      </button>
      <Refusals of={action.refusals} />
    </div>
  );
}

function Asked(props: { of: AskingSession }) {
  const { of } = props;
  const control = useLive();
  const action = useAction();
  const [reason, setReason] = useState("");
  return (
    <div className="notice warn" role="alert" data-commands>
      <span className="said">
        <strong>{of.person ?? of.name}</strong> {of.person ? `(${of.name}) ` : ""}
        {tr("shell.requestsCommand")}
        {of.reason && `: ${of.reason}`}
      </span>{" "}
      <span className="quiet figures">{tr("shell.leftMsSMore", { left_ms: Math.ceil(of.left_ms / 1000) })}</span>
      <button type="button" className="primary" disabled={action.busy} onClick={() => action.run(() => control.command.handOver(of.name))}>
        {tr("shell.handOver")}
      </button>
      <input
        aria-label={tr("shell.reasonForDecliningTheRequestOf", { name: of.name })}
        placeholder={tr("shell.reasonOptional")}
        maxLength={200}
        size={18}
        value={reason}
        onChange={(event) => setReason(event.target.value)}
      />
      <button type="button" disabled={action.busy} onClick={() => action.run(() => control.command.decline(of.name, reason.trim()))}>
        {tr("shell.decline")}
      </button>
      <Refusals of={action.refusals} />
    </div>
  );
}

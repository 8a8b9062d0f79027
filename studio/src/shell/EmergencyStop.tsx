// SPDX-License-Identifier: Apache-2.0

import { useCallback, useEffect, useRef, useState } from "react";
import { type Refusal, RefusalError } from "../control/refusals";
import type { Statistics } from "../control/shapes";
import { Refusals } from "../design/parts";
import { tr } from "../language/text";
import { useAction, useLive } from "./context";

/** Time within which the page reports whether the system has received a press, ms. */
const HEARD_WITHIN_MS = 250;
/** Time limit of one attempt, and the wait before the next one, ms. */
const TRY_MS = 1000;
const AGAIN_MS = 200;
/** Time for which the button shows that the press was received, ms. */
const SAY_MS = 3000;

/**
 * `unheard`: no answer has arrived in time, and the request is repeated until one arrives. `refused`: the system has answered, but does
 * not stop.
 */
export type Hearing = "none" | "asked" | "heard" | "unheard" | "refused";

/** A press of the emergency stop, and its outcome. */
export interface Press {
  hearing: Hearing;
  refusals: Refusal[];
  press: () => void;
  /** Dismisses the message about the press, and stops repeating the request. */
  putAway: () => void;
}

/** Returns whether an error is an answer of the system that a further attempt would receive again. */
function isFinal(why: unknown): boolean {
  return why instanceof RefusalError && why.status >= 400 && !why.isTemporary;
}

export function useEmergencyStop(now: Statistics | null): Press {
  const control = useLive();
  const [hearing, setHearing] = useState<Hearing>("none");
  const [refusals, setRefusals] = useState<Refusal[]>([]);
  const present = useRef<AbortController | null>(null);
  const isLatched = now !== null && now.emergency !== null;

  const end = useCallback((as: Hearing) => {
    present.current?.abort();
    present.current = null;
    setHearing(as);
  }, []);
  const putAway = useCallback(() => end("none"), [end]);
  // The system reports the latched stop: then the press was heard, even if the answer was lost.
  useEffect(() => {
    if (!isLatched) return;
    setHearing((before) => (before === "asked" || before === "heard" ? "heard" : "none"));
    present.current?.abort();
  }, [isLatched]);
  useEffect(() => {
    if (hearing !== "heard") return;
    const over = setTimeout(putAway, SAY_MS);
    return () => clearTimeout(over);
  }, [hearing, putAway]);
  useEffect(() => () => present.current?.abort(), []);

  const press = () => {
    present.current?.abort();
    const pressed = new AbortController();
    present.current = pressed;
    setRefusals([]);
    setHearing((before) => (before === "unheard" ? before : "asked"));
    setTimeout(() => {
      if (present.current === pressed && !pressed.signal.aborted) setHearing((before) => (before === "asked" ? "unheard" : before));
    }, HEARD_WITHIN_MS);
    const name = control.session.name.get();
    const said = `pressed in the studio${name ? ` (${name})` : ""}`;
    const send = async () => {
      while (!pressed.signal.aborted) {
        try {
          await control.emergencyStop(said, AbortSignal.any([pressed.signal, AbortSignal.timeout(TRY_MS)]));
          if (present.current === pressed) end("heard");
          return;
        } catch (why) {
          if (pressed.signal.aborted) return;
          setRefusals(why instanceof RefusalError ? why.refusals : []);
          if (isFinal(why)) return end("refused");
          setHearing("unheard");
        }
        await new Promise((again) => setTimeout(again, AGAIN_MS));
      }
    };
    void send();
  };
  return { hearing, refusals, press, putAway };
}

const SAID: Record<Hearing, string> = {
  none: tr("shell.emergencyStop"),
  asked: tr("shell.stopping"),
  heard: tr("shell.stopReceived"),
  unheard: tr("shell.notReceived"),
  refused: tr("shell.notAccepted"),
};

/**
 * Emergency stop button. Requires a single press, without confirmation or command, and has the same position in every view, state and
 * window width.
 */
export function EmergencyStop(props: { press: Press }) {
  const control = useLive();
  if (!control.may("operate")) return null;
  const { hearing, press } = props.press;
  return (
    <button
      type="button"
      className={`stop ${hearing}`}
      aria-label={hearing === "none" ? tr("shell.emergencyStop") : tr("shell.emergencyStopSAID", { SAID: SAID[hearing] })}
      onClick={press}
    >
      {SAID[hearing]}
    </button>
  );
}

/**
 * Message about a press that the system has not received or has refused. It is shown above everything else until the press is received
 * or the message is dismissed, and does not shift other elements.
 */
export function StopUnheard(props: { press: Press }) {
  const { hearing, refusals, putAway } = props.press;
  if (hearing !== "unheard" && hearing !== "refused") return null;
  return (
    <div className="shout" role="alert">
      <p>
        <strong>{hearing === "unheard" ? tr("shell.theEmergencyStopWasNotReceived") : tr("shell.theEmergencyStopWasNotAccepted")}</strong>
      </p>
      <p>
        <strong>{tr("shell.useTheStopButtonOfThe")}</strong> {hearing === "unheard" && tr("shell.thePageRepeatsTheStopUntil")}
      </p>
      {hearing === "refused" && <Refusals of={refusals} />}
      <button type="button" onClick={putAway}>
        {hearing === "unheard" ? tr("shell.stopSending") : tr("shell.dismiss")}
      </button>
    </div>
  );
}

/** The cause of the latched emergency stop, and controls to reset it. */
export function Stopped(props: { now: Statistics | null }) {
  const control = useLive();
  const action = useAction();
  const cause = props.now?.emergency ?? null;
  if (cause === null) return null;
  return (
    <div className="notice bad stopped" role="alert" data-commands>
      <strong>{tr("shell.emergencyStop2")}</strong> <span>{cause}</span>
      {control.may("operate") && (
        <button type="button" disabled={action.busy} onClick={() => action.run(() => control.order("reset", {}))}>
          {tr("shell.reset")}
        </button>
      )}
      <Refusals of={action.refusals} />
    </div>
  );
}

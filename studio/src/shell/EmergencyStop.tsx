// SPDX-License-Identifier: Apache-2.0
import { useCallback, useEffect, useRef, useState } from "react";
import { type Refusal, RefusalError } from "../control/refusals";
import type { Statistics } from "../control/shapes";
import { Refusals } from "../design/parts";
import { useAction, useLive } from "./context";

/** Within this time the page says whether a press was heard, ms. */
const HEARD_WITHIN_MS = 250;
/** Time limit of one try, and the time after it until the next one, ms. */
const TRY_MS = 1000;
const AGAIN_MS = 200;
/** Time for which the button says that it was heard, ms. */
const SAY_MS = 3000;

/** `unheard`: no answer has come in time; it is sent again until one does. `refused`: the system has answered, and does not stop. */
export type Hearing = "none" | "asked" | "heard" | "unheard" | "refused";

/** A press of the emergency stop, and what became of it. */
export interface Press {
  hearing: Hearing;
  refusals: Refusal[];
  press: () => void;
  /** Puts its message away; it is sent no more. */
  putAway: () => void;
}

/** Returns whether the next try would be answered the same. One that finds no room, or that something between page and system answers, may be heard. */
function isFinal(status: number): boolean {
  return status >= 400 && status < 500 && status !== 408 && status !== 429;
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
  // The system says that it is latched: that is heard too, whatever became of the answer.
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
          if (why instanceof RefusalError && isFinal(why.status)) return end("refused");
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
  none: "Emergency stop",
  asked: "Stopping…",
  heard: "Stop heard",
  unheard: "Not heard",
  refused: "Not taken",
};

/** The button: one press, no question, no command. It stands at the same place in every view, state and width. */
export function EmergencyStop(props: { press: Press }) {
  const control = useLive();
  if (!control.may("operate")) return null;
  const { hearing, press } = props.press;
  return (
    <button
      type="button"
      className={`stop ${hearing}`}
      aria-label={hearing === "none" ? "Emergency stop" : `Emergency stop: ${SAID[hearing]}`}
      onClick={press}
    >
      {SAID[hearing]}
    </button>
  );
}

/** A press that the system has not heard, or has refused: over all that is shown, until it is heard or put away. It moves nothing. */
export function StopUnheard(props: { press: Press }) {
  const { hearing, refusals, putAway } = props.press;
  if (hearing !== "unheard" && hearing !== "refused") return null;
  return (
    <div className="shout" role="alert">
      <p>
        <strong>{hearing === "unheard" ? "The emergency stop was not heard." : "The emergency stop was not taken."}</strong>
      </p>
      <p>
        <strong>Use the stop button of the machine.</strong>{" "}
        {hearing === "unheard" && "The page sends the stop again until the system hears it: the machine may stop then."}
      </p>
      {hearing === "refused" && <Refusals of={refusals} />}
      <button type="button" onClick={putAway}>
        {hearing === "unheard" ? "Send it no more" : "Put away"}
      </button>
    </div>
  );
}

/** While it is latched: its cause, and the reset. */
export function Stopped(props: { now: Statistics | null }) {
  const control = useLive();
  const action = useAction();
  const cause = props.now?.emergency ?? null;
  if (cause === null) return null;
  return (
    <div className="notice bad stopped" role="alert" data-commands>
      <strong>Emergency stop:</strong> <span>{cause}</span>
      {control.may("operate") && (
        <button type="button" disabled={action.busy} onClick={() => action.run(() => control.order("reset", {}))}>
          Reset
        </button>
      )}
      <Refusals of={action.refusals} />
    </div>
  );
}

// SPDX-License-Identifier: Apache-2.0

import { useEffect, useRef, useState } from "react";
import type { LogEntry } from "../control/shapes";
import { seconds } from "../design/numbers";
import { Refusals } from "../design/parts";
import { tr } from "../language/text";
import { useAction, useLive } from "./context";
import { runAt, runUntil } from "./virtual";

const RATES = [0.01, 0.1, 0.25, 0.5, 1, 2, 5, 10];

/** The system's virtual clock, which the page advances by one firing, at a rate, or until a verb reports a condition. */
export function VirtualClock() {
  const live = useLive();
  const action = useAction();
  const [moving, setMoving] = useState<AbortController | null>(null);
  const [rate, setRate] = useState(1);
  const [words, setWords] = useState("");
  const [found, setFound] = useState<{ entry: LogEntry | null } | null>(null);
  const present = useRef(rate);
  present.current = rate;
  // The clock stops when its controls are closed.
  useEffect(() => () => moving?.abort(), [moving]);
  const move = async (run: (signal: AbortSignal) => Promise<void>) => {
    const over = new AbortController();
    setMoving(over);
    setFound(null);
    await action.run(() => run(over.signal));
    setMoving(null);
  };
  const toCondition = () =>
    move(async (signal) => {
      const entry = await runUntil(live, words.trim(), signal);
      if (!signal.aborted) setFound({ entry });
    });
  const isBusy = moving !== null || action.busy;
  return (
    <fieldset className="row virtual" data-commands>
      <legend className="unseen">{tr("shell.virtualClock")}</legend>
      <button
        type="button"
        aria-pressed={moving !== null}
        onClick={() => (moving ? moving.abort() : void move((signal) => runAt(live, () => present.current, signal)))}
      >
        {moving ? tr("shell.holdClock") : tr("shell.runClock")}
      </button>
      <select aria-label={tr("shell.rateOfTheClock")} value={rate} onChange={(event) => setRate(Number(event.target.value))}>
        {RATES.map((one) => (
          <option key={one} value={one}>
            {one} ×
          </option>
        ))}
      </select>
      <button type="button" disabled={isBusy} onClick={() => void action.run(() => live.order("step", {}))}>
        {tr("shell.nextFiring")}
      </button>
      <form
        className="row"
        onSubmit={(event) => {
          event.preventDefault();
          if (!isBusy) void toCondition();
        }}
      >
        <input
          type="search"
          aria-label={tr("shell.condition")}
          placeholder={tr("shell.anyCondition")}
          value={words}
          onChange={(event) => setWords(event.target.value)}
        />
        <button type="submit" disabled={isBusy} title={tr("shell.runFiringByFiringUntilA")}>
          {tr("shell.runToCondition")}
        </button>
      </form>
      {found && (
        <span role="status" className="small">
          {found.entry ? (
            <>
              <strong>{found.entry.about}</strong>{" "}
              {tr("shell.textAtTimeS", { text: found.entry.text, time_s: seconds(found.entry.time_s) })}
            </>
          ) : (
            tr("shell.noEventIsPendingStartSomething")
          )}
        </span>
      )}
      <Refusals of={action.refusals} />
    </fieldset>
  );
}

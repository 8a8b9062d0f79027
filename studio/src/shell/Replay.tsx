// SPDX-License-Identifier: Apache-2.0

import { useState } from "react";
import type { Recording } from "../control/recorded/recording";
import type { Replay as State } from "../control/recorded/replaying";
import type { Differs } from "../control/source";
import { count, percent } from "../design/numbers";
import { Refusals, Tag } from "../design/parts";
import { trNodes } from "../language/nodes";
import { tr } from "../language/text";
import { useAction, useLive, useWatched } from "./context";

/** Replay of the recording by the system, which compares every value; the first difference is marked on the time axis. */
export function Replay(props: { of: Recording }) {
  const { of } = props;
  const live = useLive();
  const state = useWatched(of.replayed.state);
  const action = useAction();
  const [present, setPresent] = useState(false);
  if (!of.about.replay || !live.may("configure")) return null;
  return (
    <div className="replay row" role="group" aria-label={tr("shell.replay")}>
      {state.kind === "runs" ? (
        <>
          <Progress of={of} state={state} />
          <button type="button" onClick={() => action.run(() => of.replayed.cancel())}>
            {tr("shell.cancel")}
          </button>
        </>
      ) : (
        <>
          <button type="button" title={tr("shell.repeatsTheRecordedRunAndCompares")} onClick={() => void of.replayed.run(present)}>
            {tr("shell.replay")}
          </button>
          <label title={tr("shell.usesThePresentCodeModulesOf")}>
            <input type="checkbox" checked={present} onChange={(event) => setPresent(event.target.checked)} /> {tr("shell.withPresentCode")}
          </label>
        </>
      )}
      {state.kind === "over" && <Found of={of} state={state} />}
      <Refusals of={[...(state.kind === "failed" ? state.refusals : []), ...action.refusals]} />
    </div>
  );
}

function Progress(props: { of: Recording; state: Extract<State, { kind: "runs" }> }) {
  const { of, state } = props;
  const part = state.time_ns === null ? 0 : (state.time_ns - of.begins_ns) / Math.max(1, of.ends_ns - of.begins_ns);
  return (
    <>
      <progress aria-label={tr("shell.progressOfTheReplay")} max={1} value={Math.min(1, Math.max(0, part))} />
      <span className="figures small">{tr("shell.firingsFirings", { part: percent(part), count: count(state.firings) })}</span>
    </>
  );
}

function Found(props: { of: Recording; state: Extract<State, { kind: "over" }> }) {
  const { firings, differs, message, isWhole } = props.state;
  if (differs) return <Difference of={props.of} differs={differs} />;
  return (
    <span role="status">
      <Tag tone={isWhole ? "good" : "warn"}>{isWhole ? tr("shell.equal") : tr("shell.toTheEndOfItsData")}</Tag>{" "}
      {tr("shell.firingsFiringsAllValuesEqualTo", { count: count(firings) })}
      {message && `; ${message}`}
    </span>
  );
}

function Difference(props: { of: Recording; differs: Differs }) {
  const { time_ns, signal, recorded, replayed, where } = props.differs;
  return (
    <span role="status" title={where}>
      <Tag tone="bad">{tr("shell.firstDifference")}</Tag>{" "}
      <button type="button" className="plain" onClick={() => props.of.go(time_ns)} title={tr("shell.moveTheCursorThere")}>
        {(time_ns / 1e9).toFixed(6)} s
      </button>{" "}
      {signal === null ? where : <a href={`#/scope?names=${encodeURIComponent(signal)}`}>{signal}</a>}
      {(recorded !== "–" || replayed !== "–") && (
        <>
          {trNodes("shell.recordedStrongNow", { strong: <strong className="figures">{recorded}</strong> })}{" "}
          <strong className="figures">{replayed}</strong>
        </>
      )}
    </span>
  );
}

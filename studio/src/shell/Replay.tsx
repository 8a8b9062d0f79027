// SPDX-License-Identifier: Apache-2.0
import { useState } from "react";
import type { Recording } from "../control/recorded/recording";
import type { Replay as State } from "../control/recorded/replaying";
import type { Differs } from "../control/source";
import { count, percent } from "../design/numbers";
import { Refusals, Tag } from "../design/parts";
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
    <div className="replay row" role="group" aria-label="Replay">
      {state.kind === "runs" ? (
        <>
          <Progress of={of} state={state} />
          <button type="button" onClick={() => action.run(() => of.replayed.cancel())}>
            Cancel
          </button>
        </>
      ) : (
        <>
          <button type="button" title="Repeats the recorded run and compares every value" onClick={() => void of.replayed.run(present)}>
            Replay
          </button>
          <label title="Uses the present code modules of the system in place of the recorded ones">
            <input type="checkbox" checked={present} onChange={(event) => setPresent(event.target.checked)} /> with present code
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
      <progress aria-label="Progress of the replay" max={1} value={Math.min(1, Math.max(0, part))} />
      <span className="figures small">
        {percent(part)}, {count(state.firings)} firings
      </span>
    </>
  );
}

function Found(props: { of: Recording; state: Extract<State, { kind: "over" }> }) {
  const { firings, differs, message, isWhole } = props.state;
  if (differs) return <Difference of={props.of} differs={differs} />;
  return (
    <span role="status">
      <Tag tone={isWhole ? "good" : "warn"}>{isWhole ? "equal" : "to the end of its data"}</Tag> {count(firings)} firings, all values equal
      to the recorded ones{message && `; ${message}`}
    </span>
  );
}

function Difference(props: { of: Recording; differs: Differs }) {
  const { time_ns, signal, recorded, replayed, where } = props.differs;
  return (
    <span role="status" title={where}>
      <Tag tone="bad">first difference</Tag>{" "}
      <button type="button" className="plain" onClick={() => props.of.go(time_ns)} title="Move the cursor there">
        {(time_ns / 1e9).toFixed(6)} s
      </button>{" "}
      {signal === null ? where : <a href={`#/scope?names=${encodeURIComponent(signal)}`}>{signal}</a>}
      {(recorded !== "–" || replayed !== "–") && (
        <>
          : recorded <strong className="figures">{recorded}</strong>, now <strong className="figures">{replayed}</strong>
        </>
      )}
    </span>
  );
}

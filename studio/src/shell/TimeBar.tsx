// SPDX-License-Identifier: Apache-2.0

import { useId } from "react";
import type { Recording } from "../control/recorded/recording";
import type { Differs } from "../control/source";
import { seconds } from "../design/numbers";
import { Refusals, Tag } from "../design/parts";
import { tr, trWord } from "../language/text";
import { foremost } from "./AlarmBar";
import { type Axis, useAxis } from "./axis";
import { useAction, useLive, useWatched } from "./context";
import { Replay } from "./Replay";
import { VirtualClock } from "./VirtualClock";

const RATES = [0.01, 0.1, 0.25, 0.5, 1, 2, 5, 10, 60];
/** Number of slider steps over the whole recording. */
const STEPS = 100_000;

/** Time that the views show: live, paused, or at the cursor of a recording. */
export function TimeBar() {
  const axis = useAxis();
  const live = useLive();
  const source = useWatched(axis.source);
  const recording = axis.recording;
  if (recording) return <Recorded key={recording.name} axis={axis} of={recording} />;
  const isStill = source !== axis.live;
  return (
    <section className={`time-bar ${isStill ? "still" : ""}`} aria-label={tr("shell.time")}>
      <button type="button" aria-pressed={isStill} onClick={() => (isStill ? axis.goLive() : axis.pause())}>
        {isStill ? tr("shell.live") : tr("shell.pausePage")}
      </button>
      {isStill ? (
        <span role="status">
          <strong>{tr("shell.paused")}</strong> {tr("shell.at")} <PausedAt />{" "}
          <span className="quiet">{tr("shell.theDisplayIsFrozenTheSystem")}</span>
        </span>
      ) : (
        <span className="quiet small">{tr("shell.thePageFollowsTheSystem")}</span>
      )}
      {!isStill && live.version.clock === "virtual" && live.may("operate") && <VirtualClock />}
    </section>
  );
}

function PausedAt() {
  const now = useWatched(useAxis().source).topics.statistics.get();
  return <span className="figures">{now ? seconds(now.now_s) : "–"}</span>;
}

function Recorded(props: { axis: Axis; of: Recording }) {
  const { axis, of } = props;
  const live = useLive();
  const cursor = useWatched(of.cursor);
  const shown = useWatched(of.shown);
  const playing = useWatched(axis.playing);
  const trouble = useWatched(of.trouble);
  const differs = useWatched(of.differs);
  const action = useAction();
  const slider = useId();
  const span = Math.max(1, of.ends_ns - of.begins_ns);
  const step = (back: boolean) => action.run(() => of.step(back));
  const moved = (cursor - of.begins_ns) / 1e9;
  return (
    <section className="time-bar recorded" aria-label={tr("shell.time")} data-cursor={cursor} data-shown={shown}>
      <button
        type="button"
        className="primary"
        onClick={() => axis.goLive()}
        title={tr("shell.returnToTheRunningSystemSystem", { system: live.version.system })}
      >
        {tr("shell.live")}
      </button>
      <span className="what" title={of.name}>
        <Tag tone="accent">{tr("shell.recording")}</Tag> <strong>{of.name}</strong>
      </span>
      <span className="row steps">
        <Steps name={tr("shell.logEntry")} back={() => of.toEntry(true)} on={() => of.toEntry(false)} marks={["|◀", "▶|"]} />
        <Steps
          name={tr("shell.condition2")}
          back={() => of.toEntry(true, (entry) => entry.kind === "condition")}
          on={() => of.toEntry(false, (entry) => entry.kind === "condition")}
          marks={["◀◆", "◆▶"]}
        />
        <Steps name={tr("shell.firing")} back={() => void step(true)} on={() => void step(false)} marks={["◀", "▶"]} />
      </span>
      <button type="button" aria-pressed={playing !== null} onClick={() => axis.play(playing === null ? 1 : null)}>
        {playing === null ? tr("shell.play") : tr("shell.stop")}
      </button>
      <select aria-label={tr("shell.rate")} value={playing ?? 1} onChange={(event) => axis.play(Number(event.target.value))}>
        {RATES.map((rate) => (
          <option key={rate} value={rate}>
            {rate} ×
          </option>
        ))}
      </select>
      <label className="unseen" htmlFor={slider}>
        {tr("shell.timeInTheRecording")}
      </label>
      <span className="slide">
        <input
          id={slider}
          type="range"
          min={0}
          max={STEPS}
          value={Math.round(((cursor - of.begins_ns) / span) * STEPS)}
          aria-valuetext={seconds(cursor / 1e9)}
          onChange={(event) => of.go(of.begins_ns + (Number(event.target.value) / STEPS) * span)}
        />
        {differs && <Mark part={(differs.time_ns - of.begins_ns) / span} differs={differs} />}
      </span>
      <span
        className="figures time"
        data-testid="cursor"
        title={tr("shell.movedSAfterTheStartClock", { moved: moved.toFixed(9), clock: trWord(of.about.clock) })}
      >
        {(cursor / 1e9).toFixed(6)} s
      </span>
      <Replay of={of} />
      <Alarms of={of} />
      <Refusals of={[...trouble, ...action.refusals]} />
    </section>
  );
}

/** Mark of the replay's first difference on the slider. The centre of the slider's thumb stays half a thumb width away from both ends. */
function Mark(props: { part: number; differs: Differs }) {
  const { signal, recorded, replayed } = props.differs;
  const left = `calc(8px + (100% - 16px) * ${Math.min(1, Math.max(0, props.part))})`;
  return (
    <span
      className="mark"
      style={{ left }}
      title={tr("shell.firstDifferenceRecordedRecordedNowReplayed", { part: signal ?? "", recorded, replayed })}
      data-testid="difference"
    />
  );
}

function Steps(props: { name: string; back: () => void; on: () => void; marks: [string, string] }) {
  return (
    <span className="pair">
      <button
        type="button"
        aria-label={tr("shell.previousName", { name: props.name })}
        title={tr("shell.toThePreviousName", { name: props.name })}
        onClick={props.back}
      >
        {props.marks[0]}
      </button>
      <button
        type="button"
        aria-label={tr("shell.nextName", { name: props.name })}
        title={tr("shell.toTheNextName", { name: props.name })}
        onClick={props.on}
      >
        {props.marks[1]}
      </button>
    </span>
  );
}

/** The alarms that were active at the cursor. */
function Alarms(props: { of: Recording }) {
  const alarms = useWatched(props.of.alarms.latest)?.current ?? [];
  const first = foremost(alarms);
  if (!first) return null;
  return (
    <span className="then" role="status" aria-label={tr("shell.alarmsAtTheCursor")}>
      <Tag tone={first.active ? "bad" : "warn"}>{trWord(first.severity)}</Tag> <strong>{first.code}</strong> {first.text}
      {alarms.length > 1 && <span className="quiet"> {tr("shell.andCountMore", { count: alarms.length - 1 })}</span>}
    </span>
  );
}

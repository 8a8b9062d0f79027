// SPDX-License-Identifier: Apache-2.0

import { useEffect, useState } from "react";
import { askUntilAnswered } from "../../control/asking";
import { type Refusal, refusalsOf } from "../../control/refusals";
import type { DamagedPart, RecordingContents, RecordingFile } from "../../control/shapes";
import { count, seconds } from "../../design/numbers";
import { Empty, Panel, Refusals, Tag } from "../../design/parts";
import { tr } from "../../language/text";
import { useAxis } from "../../shell/axis";
import { useAction, useLive, useWatched } from "../../shell/context";
import { go } from "../../shell/route";
import { freeText, type RunningRecording, recordingOf, sizeText, sumOf } from "./begun";

/** Interval at which the list of recordings is read, ms. */
const LOOK_MS = 2000;
/** Maximum number of recordings listed; others are found by name. */
const SHOWN_MAX = 200;

/** The recordings in the system's recordings folder, newest first, each with a description and a button that opens it. */
export function Files(props: { begun: RunningRecording[]; changed: (one: RunningRecording, now: RunningRecording) => void }) {
  const live = useLive();
  const { files, refusals } = useFiles();
  const [text, setText] = useState("");
  // Without the right to record, a page has no folder either, which is not an error.
  const isWithout = !live.may("operate") && refusals.some((one) => one.class === "NotAllowed");
  const found = (files ?? []).filter((file) => file.name.toLowerCase().includes(text.toLowerCase()));
  return (
    <Panel
      title={tr("recordings.recordings")}
      end={
        <input
          type="search"
          aria-label={tr("recordings.findARecording")}
          placeholder={tr("recordings.find")}
          value={text}
          onChange={(event) => setText(event.target.value)}
        />
      }
    >
      {isWithout ? <p className="quiet">{tr("recordings.thisPageHasNoFolder")}</p> : <Refusals of={refusals} />}
      {files !== null && files.length === 0 && (
        <Empty title={tr("recordings.noRecordingsYet")}>{tr("recordings.startOneAboveOrInA")}</Empty>
      )}
      {found.length > 0 && (
        <div className="scroll-x" role="group" aria-label={tr("recordings.recordings")} tabIndex={0}>
          <table className="recordings">
            <thead>
              <tr>
                <th scope="col">{tr("recordings.file")}</th>
                <th scope="col">
                  <span className="unseen">{tr("recordings.openOrStop")}</span>
                </th>
                <th scope="col">{tr("recordings.when")}</th>
                <th scope="col" className="number">
                  {tr("recordings.length")}
                </th>
                <th scope="col">{tr("recordings.verbs")}</th>
                <th scope="col">{tr("recordings.ends")}</th>
                <th scope="col">{tr("recordings.state")}</th>
                <th scope="col" className="number">
                  {tr("recordings.size")}
                </th>
              </tr>
            </thead>
            <tbody>
              {found.slice(0, SHOWN_MAX).map((file) => (
                <Row key={file.name} of={file} recording={recordingOf(file.name, props.begun)} changed={props.changed} />
              ))}
            </tbody>
          </table>
        </div>
      )}
      {found.length > SHOWN_MAX && (
        <p className="quiet">{tr("recordings.countMoreSearchForThemBy", { count: count(found.length - SHOWN_MAX) })}</p>
      )}
    </Panel>
  );
}

function Row(props: {
  of: RecordingFile;
  recording: ReturnType<typeof recordingOf>;
  changed: (one: RunningRecording, now: RunningRecording) => void;
}) {
  const { of } = props;
  const begun = props.recording?.isLast ? props.recording.begun : null;
  const running = begun !== null && begun.summary?.running !== false;
  const live = useLive();
  const axis = useAxis();
  const action = useAction();
  const { about, refusals } = useAbout(of);
  const isShown = useWatched(axis.source) === axis.recording && axis.recording?.name === of.name;
  const stop = async () => {
    if (!begun) return;
    let now = await live.order("stop_recording", { recording: begun.recording });
    // The file is closed when all pending data is written.
    while (now.running) {
      await new Promise((again) => setTimeout(again, 100));
      now = await live.order("stop_recording", { recording: begun.recording });
    }
    props.changed(begun, { ...begun, summary: now });
  };
  const lost = sumOf(begun?.summary?.lost ?? about?.lost ?? {});
  return (
    <tr>
      <th scope="row">
        {of.name}
        {about?.system && about.system !== live.version.system && (
          <div className="quiet small">{tr("recordings.ofSystem", { system: about.system })}</div>
        )}
      </th>
      {/* Beside the name: the other columns are beyond the edge of a narrow window. */}
      <td className="row">
        <button
          type="button"
          className="primary"
          disabled={action.busy || about === null || isShown}
          onClick={() => action.run(() => axis.open(of.name).then(() => go("log")))}
        >
          {isShown ? tr("recordings.opened") : tr("recordings.open")}
        </button>
        {running && (
          <button type="button" disabled={action.busy} onClick={() => action.run(stop)}>
            {tr("recordings.stop")}
          </button>
        )}
        <Refusals of={action.refusals} />
      </td>
      <td className="figures">{about ? whenText(about) : ""}</td>
      <td className="number">{about ? seconds((about.ends_ns - about.begins_ns) / 1e9) : ""}</td>
      <td className="few" title={about?.verbs.join(", ")}>
        {about?.verbs.join(", ")}
      </td>
      <td className="few" title={about ? endsText(about) : undefined}>
        {about && endsText(about)}
      </td>
      <td>
        {begun?.summary?.failure ? (
          <Tag tone="bad">{tr("recordings.failedFailure", { failure: begun.summary.failure })}</Tag>
        ) : running ? (
          <Tag tone="accent" title={freeText(begun?.summary?.free_bytes ?? null)}>
            {tr("recordings.records")}
          </Tag>
        ) : about?.complete ? (
          <Tag>{tr("recordings.complete")}</Tag>
        ) : (
          about && <Tag tone="warn">{tr("recordings.withoutAnEnd")}</Tag>
        )}{" "}
        {about?.replay && <Tag tone="good">{tr("recordings.replay")}</Tag>}{" "}
        {lost > 0 && <Tag tone="bad">{tr("recordings.lostLost", { lost: count(lost) })}</Tag>}{" "}
        {!running && about !== null && about.damage.length > 0 && (
          <Tag tone="bad" title={about.damage.map(damageText).join("\n")}>
            {tr("recordings.damagedInCount", { count: count(about.damage.length) })}{" "}
            {tr("recordings.places", { count: about.damage.length })}
          </Tag>
        )}
        <Refusals of={refusals} />
      </td>
      <td className="number">
        {sizeText(running && begun?.summary?.files.length === 1 ? Math.max(of.bytes, begun.summary.bytes) : of.bytes)}
      </td>
    </tr>
  );
}

/** Describes an unreadable section of a file: its location and the lost messages. */
function damageText(of: DamagedPart): string {
  const lost = of.lost == null ? tr("recordings.unknown") : `${count(sumOf(of.lost))} (${Object.keys(of.lost).join(", ")})`;
  const when =
    of.from_ns == null || of.to_ns == null
      ? ""
      : tr("recordings.fromNsToToNs", { from_ns: seconds(of.from_ns / 1e9), to_ns: seconds(of.to_ns / 1e9) });
  return tr("recordings.bytesBeginsToEndswhenWhatMessages", { begins: of.begins, ends: of.ends, when, what: of.what, lost });
}

/** Formats the wall-clock time at which a recording started. */
function whenText(about: RecordingContents): string {
  const at = new Date((about.epoch_unix_s + about.begins_ns / 1e9) * 1000);
  return at.toLocaleString(undefined, { dateStyle: "short", timeStyle: "medium" });
}

/** Describes the ends of instances, one entry per condition: "halted 2 ×, over". */
export function endsText(about: RecordingContents): string {
  const counts = new Map<string, number>();
  for (const { condition } of about.ends) counts.set(condition, (counts.get(condition) ?? 0) + 1);
  return [...counts].map(([condition, times]) => (times > 1 ? `${condition} ${times} ×` : condition)).join(", ");
}

function useFiles(): { files: RecordingFile[] | null; refusals: Refusal[] } {
  const live = useLive();
  const [files, setFiles] = useState<RecordingFile[] | null>(null);
  const [refusals, setRefusals] = useState<Refusal[]>([]);
  useEffect(() => {
    let over = false;
    const look = () =>
      live.look("recordings", {}).then(
        (found) => {
          if (over) return;
          setFiles((before) => (JSON.stringify(before) === JSON.stringify(found) ? before : found));
          setRefusals([]);
        },
        (why) => over || setRefusals(refusalsOf(why)),
      );
    void look();
    const again = setInterval(look, LOOK_MS);
    return () => {
      over = true;
      clearInterval(again);
    };
  }, [live]);
  return { files, refusals };
}

/** Returns the description of a recording, which is read again when its file has grown. */
function useAbout(file: RecordingFile): { about: RecordingContents | null; refusals: Refusal[] } {
  const live = useLive();
  const [about, setAbout] = useState<RecordingContents | null>(null);
  const [refusals, setRefusals] = useState<Refusal[]>([]);
  // biome-ignore lint/correctness/useExhaustiveDependencies: of a file that grows it is asked again
  useEffect(() => {
    return askUntilAnswered(live, {
      ask: (signal) => live.look("recorded", { path: file.name }, signal),
      take: (found) => {
        setAbout(found);
        setRefusals([]);
      },
      failed: (why) => setRefusals(refusalsOf(why)),
    });
  }, [live, file.name, file.bytes]);
  return { about, refusals };
}

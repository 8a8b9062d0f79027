// SPDX-License-Identifier: Apache-2.0

import { useCallback, useEffect, useId, useState } from "react";
import { Empty, Panel, Refusals } from "../../design/parts";
import { trNodes } from "../../language/nodes";
import { tr } from "../../language/text";
import { useAction, useLive, useTopic } from "../../shell/context";
import { completedName, freshName, keepRecordings, keptRecordings, namesIn, type RunningRecording, sizeText } from "./begun";
import { Files } from "./Files";
import "./recordings.css";

/** Sizes at which a new file is started, bytes. */
const SPLITS = [10, 100, 1000].map((mega) => mega * 2 ** 20);

/** Interval at which the states of recordings in progress are read, ms. */
const LOOK_MS = 1000;

/**
 * Recordings view: starts recordings from this page, with every value at full rate, the log, ends and timing, and opens those in the
 * system's recordings folder.
 */
export default function Recordings() {
  const control = useLive();
  const { all, put } = useRecordings();
  return (
    <div className="stack">
      {control.may("operate") ? (
        <Begin begun={(one) => put([one, ...all])} />
      ) : (
        <Empty title={tr("recordings.recordingIsNotAllowed")}>
          {trNodes("recordings.itsRoleIsRoleRecordingNeeds", { role: control.role, code: <code>--role operate</code> })}
        </Empty>
      )}
      <Files begun={all} changed={(one, now) => put(all.map((other) => (other === one ? now : other)))} />
    </div>
  );
}

function Begin(props: { begun: (one: RunningRecording) => void }) {
  const control = useLive();
  const action = useAction();
  const [name, setName] = useState(() => freshName(control.version.system, new Date()));
  const [svvs, setSvvs] = useState("");
  const [cells, setCells] = useState(false);
  const [replay, setReplay] = useState(false);
  const [split, setSplit] = useState(0);
  const [keep, setKeep] = useState("");
  const [file, names, sizes, kept] = [useId(), useId(), useId(), useId()];
  const now = useTopic(control.topics.statistics);
  // For a replay, external inputs must be recorded from the first interrupt source on.
  const isNew = now !== null && Object.keys(now.sources).length === 0;
  const path = completedName(name);
  const begin = () =>
    action.run(async () => {
      const bounds = split === 0 ? {} : { split_bytes: split, keep: keep === "" ? null : Number(keep) };
      const { recording } = await control.order("record", {
        path,
        svvs: namesIn(svvs),
        cells,
        replay: replay && isNew && split === 0,
        ...bounds,
      });
      props.begun({ recording, run: control.version.run, name: path, summary: null });
      setName(freshName(control.version.system, new Date()));
    });
  return (
    <Panel title={tr("recordings.record")}>
      <form
        className="stack record"
        onSubmit={(event) => {
          event.preventDefault();
          void begin();
        }}
      >
        <div className="row">
          <label htmlFor={file}>{tr("recordings.file")}</label>
          <input id={file} size={34} value={name} required onChange={(event) => setName(event.target.value)} />
          <span className="quiet">
            {path === name.trim() ? "" : `${tr("recordings.isPath", { path })} `}
            {tr("recordings.inTheSystemSFolderFor")}
          </span>
        </div>
        <div className="row">
          <label htmlFor={names}>{tr("recordings.sVVs")}</label>
          <input
            id={names}
            size={34}
            value={svvs}
            placeholder={tr("recordings.allOrArmForce")}
            onChange={(event) => setSvvs(event.target.value)}
          />
        </div>
        <div className="row">
          <label htmlFor={sizes}>{tr("recordings.split")}</label>
          <select id={sizes} value={split} onChange={(event) => setSplit(Number(event.target.value))}>
            <option value={0}>{tr("recordings.no")}</option>
            {SPLITS.map((bytes) => (
              <option key={bytes} value={bytes}>
                {tr("recordings.everyBytes", { bytes: sizeText(bytes) })}
              </option>
            ))}
          </select>
          {split > 0 && (
            <>
              <label htmlFor={kept}>{tr("recordings.newestFilesToKeep")}</label>
              <input
                id={kept}
                type="number"
                min={2}
                step={1}
                placeholder={tr("recordings.all")}
                value={keep}
                onChange={(event) => setKeep(event.target.value)}
              />
            </>
          )}
        </div>
        <div className="row">
          <label>
            <input type="checkbox" checked={cells} onChange={(event) => setCells(event.target.checked)} />{" "}
            {tr("recordings.includePrivateCells")}
          </label>
          {isNew && split === 0 && (
            <label>
              <input type="checkbox" checked={replay} onChange={(event) => setReplay(event.target.checked)} />{" "}
              {tr("recordings.includeExternalInputsForReplay")}
            </label>
          )}
          <button type="submit" className="primary" disabled={action.busy || path === ""}>
            {tr("recordings.record")}
          </button>
        </div>
        <Refusals of={action.refusals} />
      </form>
    </Panel>
  );
}

/** Returns the recordings of this tab, with the states of running ones. */
export function useRecordings(): { all: RunningRecording[]; put: (all: RunningRecording[]) => void } {
  const control = useLive();
  const [all, show] = useState(() => keptRecordings(control.version.run));
  const put = useCallback((next: RunningRecording[]) => {
    keepRecordings(next);
    show(next);
  }, []);
  useEffect(() => {
    let over = false;
    const look = async () => {
      const now = await Promise.all(
        all.map(async (one) => {
          if (one.summary && !one.summary.running) return one;
          // If the system does not report a recording, its last known state is kept.
          const summary = await control.look("recording", { recording: one.recording }).catch(() => one.summary);
          return { ...one, summary };
        }),
      );
      if (!over && JSON.stringify(now) !== JSON.stringify(all)) put(now);
    };
    void look();
    const again = setInterval(look, LOOK_MS);
    return () => {
      over = true;
      clearInterval(again);
    };
  }, [control, all, put]);
  return { all, put };
}

// SPDX-License-Identifier: Apache-2.0
import { useCallback, useEffect, useId, useState } from "react";
import { count } from "../../design/numbers";
import { Empty, Panel, Refusals, Tag } from "../../design/parts";
import { useAction, useControl } from "../../shell/context";
import { type Begun, freshName, keepRecordings, keptRecordings, namesIn, sizeText, sumOf } from "./begun";

/** How often it is looked how the recordings stand that run, ms. */
const LOOK_MS = 1000;

/** Recordings that this page begins: every value at full rate, the log, ends and timing, in a file of the system. */
export default function Recordings() {
  const control = useControl();
  const { all, put } = useRecordings();
  return (
    <div className="stack">
      {control.may("configure") ? (
        <Begin begun={(one) => put([one, ...all])} />
      ) : (
        <Empty title="This page may not record">Its role is '{control.role}'; recording needs 'configure'.</Empty>
      )}
      <Panel title="Recordings of this tab">
        {all.length === 0 ? (
          <p className="quiet">None since the system was started.</p>
        ) : (
          <div className="scroll-x" role="group" aria-label="Recordings" tabIndex={0}>
            <table>
              <thead>
                <tr>
                  <th scope="col">File</th>
                  <th scope="col">State</th>
                  <th scope="col" className="number">
                    Size
                  </th>
                  <th scope="col" className="number">
                    Messages
                  </th>
                  <th scope="col" className="number">
                    Lost
                  </th>
                  <th scope="col">
                    <span className="unseen">Stop</span>
                  </th>
                </tr>
              </thead>
              <tbody>
                {all.map((one) => (
                  <Row key={one.recording} of={one} changed={(now) => put(all.map((other) => (other === one ? now : other)))} />
                ))}
              </tbody>
            </table>
          </div>
        )}
      </Panel>
    </div>
  );
}

function Row(props: { of: Begun; changed: (now: Begun) => void }) {
  const { of } = props;
  const control = useControl();
  const action = useAction();
  const { summary } = of;
  const stop = async () => {
    let now = await control.order("stop_recording", { recording: of.recording });
    // Its file is closed when all that was on its way is in it.
    while (now.running) {
      await new Promise((again) => setTimeout(again, 100));
      now = await control.order("stop_recording", { recording: of.recording });
    }
    props.changed({ ...of, summary: now });
  };
  return (
    <tr>
      <th scope="row" title={summary?.path}>
        {of.name}
      </th>
      <td>
        {summary?.failure ? (
          <Tag tone="bad">failed: {summary.failure}</Tag>
        ) : summary && !summary.running ? (
          <Tag>complete</Tag>
        ) : (
          <Tag tone="accent">records</Tag>
        )}
      </td>
      <td className="number">{summary ? sizeText(summary.bytes) : "–"}</td>
      <td className="number">{summary ? count(sumOf(summary.counts)) : "–"}</td>
      <td className="number">{summary ? count(sumOf(summary.lost)) : "–"}</td>
      <td>
        {summary?.running !== false && (
          <button type="button" disabled={action.busy} onClick={() => action.run(stop)}>
            Stop
          </button>
        )}
        <Refusals of={action.refusals} />
      </td>
    </tr>
  );
}

function Begin(props: { begun: (one: Begun) => void }) {
  const control = useControl();
  const action = useAction();
  const [name, setName] = useState(() => freshName(control.version.system, new Date()));
  const [svvs, setSvvs] = useState("");
  const [cells, setCells] = useState(false);
  const [replay, setReplay] = useState(false);
  const [file, names] = [useId(), useId()];
  const begin = () =>
    action.run(async () => {
      const { recording } = await control.order("record", { path: name.trim(), svvs: namesIn(svvs), cells, replay });
      props.begun({ recording, run: control.version.run, name: name.trim(), summary: null });
      setName(freshName(control.version.system, new Date()));
    });
  return (
    <Panel title="Record">
      <form
        className="stack"
        onSubmit={(event) => {
          event.preventDefault();
          void begin();
        }}
      >
        <div className="row">
          <label htmlFor={file}>File</label>
          <input id={file} size={34} value={name} required onChange={(event) => setName(event.target.value)} />
          <span className="quiet">in the system's folder for recordings</span>
        </div>
        <div className="row">
          <label htmlFor={names}>SVVs</label>
          <input id={names} size={34} value={svvs} placeholder="all; or arm.*, force" onChange={(event) => setSvvs(event.target.value)} />
        </div>
        <div className="row">
          <label>
            <input type="checkbox" checked={cells} onChange={(event) => setCells(event.target.checked)} /> private cells too
          </label>
          <label>
            <input type="checkbox" checked={replay} onChange={(event) => setReplay(event.target.checked)} /> what comes from outside too,
            for replay
          </label>
          <button type="submit" className="primary" disabled={action.busy || name.trim() === ""}>
            Record
          </button>
        </div>
        <Refusals of={action.refusals} />
      </form>
    </Panel>
  );
}

/** The recordings of this tab, with how those stand that run. */
function useRecordings(): { all: Begun[]; put: (all: Begun[]) => void } {
  const control = useControl();
  const [all, show] = useState(() => keptRecordings(control.version.run));
  const put = useCallback((next: Begun[]) => {
    keepRecordings(next);
    show(next);
  }, []);
  useEffect(() => {
    let over = false;
    const look = async () => {
      const now = await Promise.all(
        all.map(async (one) => {
          if (one.summary && !one.summary.running) return one;
          // One that the system does not tell of stays as it was known.
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

// SPDX-License-Identifier: Apache-2.0

import { useCallback, useMemo, useRef, useState, useSyncExternalStore } from "react";
import { toNs } from "../../control/recorded/state";
import type { Past, Topic } from "../../control/source";
import type { KeptEntries } from "../../control/topics";
import { count } from "../../design/numbers";
import { Empty, Refusals } from "../../design/parts";
import { saveText } from "../../design/saveText";
import { tr, trWord } from "../../language/text";
import { useControl, useWatched } from "../../shell/context";
import { useRoute } from "../../shell/route";
import { LineDetail } from "./LineDetail";
import { Lines } from "./Lines";
import { asCsv, asJsonLines, BAD_KINDS, kindsOf, type Line, linesOf, shownLines, WARN_KINDS } from "./lines";
import "./log.css";

/** Log of the system: conditions, faults, transitions, ends with their reports, and commands with their callers. */
export default function Log() {
  const control = useControl();
  const { past } = control;
  const log = useTold(control.topics.log, past);
  const ends = useTold(control.topics.ends, past);
  const logTrouble = useWatched(control.topics.log.trouble);
  const endsTrouble = useWatched(control.topics.ends.trouble);
  const asked = useRoute().query.get("text");
  const [text, setText] = useState(asked ?? "");
  const [hidden, setHidden] = useState<ReadonlySet<string>>(new Set());
  const [paused, setPaused] = useState<Line[] | null>(null);
  const [chosen, setChosen] = useState<Line | null>(null);
  const latest = useMemo(() => linesOf(log, ends), [log, ends]);
  const lines = paused ?? latest;
  const kinds = useMemo(() => kindsOf(lines), [lines]);
  const shown = useMemo(() => shownLines(lines, { hidden, text }), [lines, hidden, text]);
  const choose = useCallback(
    (line: Line) => {
      setChosen(line);
      past?.go(toNs(line.time_s));
    },
    [past],
  );
  const dropped = (log?.dropped ?? 0) + (ends?.dropped ?? 0);
  const newer = latest.length - lines.length;

  const toggle = (kind: string) => {
    const next = new Set(hidden);
    if (!next.delete(kind)) next.add(kind);
    setHidden(next);
  };

  return (
    <div className="log">
      <div className="row tools">
        <label className="row">
          <span className="quiet">{tr("log.text")}</span>
          <input type="search" value={text} placeholder={tr("log.move1Halted")} onChange={(event) => setText(event.target.value)} />
        </label>
        <fieldset className="row kinds">
          <legend className="unseen">{tr("log.kindsShown")}</legend>
          {[...kinds].map(([kind, counted]) => (
            <button key={kind} type="button" aria-pressed={!hidden.has(kind)} className={tone(kind)} onClick={() => toggle(kind)}>
              {trWord(kind)} <span className="figures small">{count(counted)}</span>
            </button>
          ))}
        </fieldset>
        <div className="row last">
          {!past && (
            <button type="button" aria-pressed={paused !== null} onClick={() => setPaused(paused ? null : latest)}>
              {paused ? tr("log.resume") : tr("log.pause")}
            </button>
          )}
          {newer > 0 && <span className="quiet">{tr("log.newerNewer", { newer: count(newer) })}</span>}
          <button
            type="button"
            disabled={shown.length === 0}
            onClick={() => saveText(`${control.version.system}.log.csv`, "text/csv", asCsv(shown))}
          >
            {tr("log.saveCSV")}
          </button>
          <button
            type="button"
            disabled={shown.length === 0}
            onClick={() => saveText(`${control.version.system}.log.jsonl`, "application/jsonl", asJsonLines(shown))}
          >
            {tr("log.saveJSONLines")}
          </button>
        </div>
      </div>
      <Refusals of={[...logTrouble, ...endsTrouble]} />
      {dropped > 0 && <p className="dropped">{tr("log.droppedEntriesWereDiscardedBeforeThey", { dropped: count(dropped) })}</p>}
      {shown.length > 0 ? (
        <Lines of={shown} chosen={chosen?.key ?? null} choose={choose} still={paused !== null} past={past} />
      ) : lines.length > 0 ? (
        <Empty title={tr("log.noEntryMatchesTheFilter")}>{tr("log.showMoreKindsOrShortenThe")}</Empty>
      ) : (
        <Empty title={past ? tr("log.nothingWasLoggedInThisRecording") : tr("log.nothingHasHappenedYet")}>
          {past ? tr("log.itsValuesAreInTheScope") : tr("log.startsConditionsTransitionsEndsAndCommands")}
        </Empty>
      )}
      {chosen && <LineDetail of={chosen} close={() => setChosen(null)} />}
    </div>
  );
}

/** Returns the entries so far; in a recording, always all entries, so that the lines are the same for any cursor position. */
function useTold<T>(topic: Topic<KeptEntries<T>>, past: Past | null): KeptEntries<T> | null {
  const first = useRef<{ of: Topic<KeptEntries<T>>; told: KeptEntries<T> } | null>(null);
  return useSyncExternalStore(topic.watch, () => {
    const told = topic.get();
    if (!past || !told) return told;
    if (first.current?.of !== topic) first.current = { of: topic, told };
    return first.current.told;
  });
}

function tone(kind: string): string {
  return BAD_KINDS.has(kind) ? "bad" : WARN_KINDS.has(kind) ? "warn" : "";
}

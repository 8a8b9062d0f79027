// SPDX-License-Identifier: Apache-2.0

import { type KeyboardEvent, memo, useCallback, useEffect, useLayoutEffect, useRef, useState, useSyncExternalStore } from "react";
import type { Past } from "../../control/source";
import { seconds } from "../../design/numbers";
import { tr, trWord } from "../../language/text";
import { BAD_KINDS, type Line, linesUntil, WARN_KINDS } from "./lines";
import { BEYOND, broughtIntoSight, rowsInSight, type Sight } from "./sight";

/** Height of a line, px; in a narrow window, a line takes two rows. */
const [WIDE, NARROW] = [24, 44];

/**
 * The visible lines of a long list. The view follows the latest line while the end of the list is visible, or, in a recording, the
 * cursor.
 */
export function Lines(props: { of: Line[]; chosen: string | null; choose: (line: Line) => void; still: boolean; past: Past | null }) {
  const { of: lines, chosen, choose, past } = props;
  const passed = usePassed(past, lines);
  // In a recording, the line at the cursor stays visible instead of the newest one.
  const still = props.still || past !== null;
  const LINE = useNarrow() ? NARROW : WIDE;
  const box = useRef<HTMLDivElement>(null);
  const [sight, setSight] = useState<Sight>({ top: 0, height: 600 });
  const [following, setFollowing] = useState(true);
  const [brought, setBrought] = useState<{ passed: number | null; line: number }>({ passed: null, line: LINE });

  // During rendering, so that after a jump of the cursor the lines are rendered and laid out only once.
  if (brought.passed !== passed || brought.line !== LINE) {
    setBrought({ passed, line: LINE });
    if (passed) setSight(broughtIntoSight(sight, passed - 1, lines.length, LINE));
  }

  const see = useCallback((there: HTMLElement) => {
    const [top, height] = [there.scrollTop, there.clientHeight];
    setSight((before) => (before.top === top && before.height === height ? before : { top, height }));
  }, []);
  const look = () => {
    const there = box.current;
    if (!there) return;
    see(there);
    setFollowing(there.scrollTop + there.clientHeight >= there.scrollHeight - LINE);
  };

  // biome-ignore lint/correctness/useExhaustiveDependencies: it follows when lines come
  useLayoutEffect(() => {
    if (following && !still && box.current) box.current.scrollTop = box.current.scrollHeight;
  }, [lines, following, still]);

  // biome-ignore lint/correctness/useExhaustiveDependencies: where a person scrolls to, it is already
  useLayoutEffect(() => {
    if (passed !== null && box.current) box.current.scrollTop = sight.top;
  }, [passed, LINE]);

  useEffect(() => {
    const there = box.current;
    if (!there) return;
    const resized = new ResizeObserver(() => see(there));
    resized.observe(there);
    return () => resized.disconnect();
  }, [see]);

  const [first, last] = rowsInSight(sight, lines.length, LINE, past ? BEYOND.jumped : BEYOND.scrolled);

  const step = (event: KeyboardEvent) => {
    const by = { ArrowDown: 1, ArrowUp: -1 }[event.key];
    if (!by) return;
    event.preventDefault();
    const at = lines.findIndex((line) => line.key === chosen);
    const next = lines[at < 0 ? lines.length - 1 : Math.min(lines.length - 1, Math.max(0, at + by))];
    if (!next || !box.current) return;
    choose(next);
    const place = lines.indexOf(next) * LINE;
    if (place < box.current.scrollTop) box.current.scrollTop = place;
    if (place + LINE > box.current.scrollTop + box.current.clientHeight) box.current.scrollTop = place + LINE - box.current.clientHeight;
  };

  return (
    <div className="panel lines" role="group" aria-label={tr("log.linesOfTheLog")} tabIndex={0} ref={box} onScroll={look} onKeyDown={step}>
      <div style={{ height: lines.length * LINE, position: "relative" }}>
        {lines.slice(first, last).map((line, index) => (
          <Row
            // biome-ignore lint/suspicious/noArrayIndexKey: a jump writes other words into the same elements, instead of making new ones
            key={index}
            of={line}
            top={(first + index) * LINE}
            height={LINE}
            isChosen={line.key === chosen}
            at={passed === null ? "" : first + index >= passed ? "later" : first + index === passed - 1 ? "present" : ""}
            choose={choose}
          />
        ))}
      </div>
      {!following && !still && (
        <button
          type="button"
          className="newest"
          onClick={() => {
            if (box.current) box.current.scrollTop = box.current.scrollHeight;
          }}
        >
          {tr("log.goToNewest")}
        </button>
      )}
    </div>
  );
}

/** A line; `at` is its position relative to the cursor of a recording. */
const Row = memo(function Row(props: {
  of: Line;
  top: number;
  height: number;
  isChosen: boolean;
  at: "" | "later" | "present";
  choose: (line: Line) => void;
}) {
  const { of: line, top, height } = props;
  const tone = BAD_KINDS.has(line.kind) ? "bad" : WARN_KINDS.has(line.kind) ? "warn" : "";
  const isBare = line.text === "" && !line.who && line.times <= 1 && !line.isEarlier;
  return (
    <button
      type="button"
      tabIndex={-1}
      className={`line ${height === NARROW ? "two" : ""} ${isBare ? "bare" : ""} ${line.isEarlier ? "earlier" : ""} ${props.at} ${tone}`}
      aria-pressed={props.isChosen}
      style={{ top, height }}
      onClick={() => props.choose(line)}
    >
      <span className="figures time">{seconds(line.time_s)}</span>
      <span className="kind">{trWord(line.kind)}</span>
      <span className="about">{line.about}</span>
      <span className="what">
        {line.isEarlier && <span className="tag">{tr("log.earlierRun")}</span>}
        {line.times > 1 && <span className="tag">{line.times}×</span>} {line.text}
        {line.who && <span className="quiet"> {tr("log.byWho", { who: line.who })}</span>}
      </span>
    </button>
  );
});

/** Returns the number of lines that are not later than the cursor of a recording; null if the lines are live. */
function usePassed(past: Past | null, lines: readonly Line[]): number | null {
  return useSyncExternalStore(
    (changed) => past?.cursor.watch(changed) ?? (() => undefined),
    () => (past ? linesUntil(lines, past.cursor.get()) : null),
  );
}

const NARROW_WINDOW = "(max-width: 700px)";

function useNarrow(): boolean {
  return useSyncExternalStore(
    (changed) => {
      const window_ = window.matchMedia(NARROW_WINDOW);
      window_.addEventListener("change", changed);
      return () => window_.removeEventListener("change", changed);
    },
    () => window.matchMedia(NARROW_WINDOW).matches,
  );
}

// SPDX-License-Identifier: Apache-2.0
import { type KeyboardEvent, useEffect, useLayoutEffect, useRef, useState, useSyncExternalStore } from "react";
import { seconds } from "../../design/numbers";
import { BAD_KINDS, type Line, WARN_KINDS } from "./lines";

/** The height of a line, px; where there is little room it has two rows. */
const [WIDE, NARROW] = [24, 44];
/** Lines drawn beyond what is seen. */
const BEYOND = 20;

/** The lines that are in sight, of as many as there are; follows the newest while its end is in sight. */
export function Lines(props: { of: Line[]; chosen: string | null; choose: (line: Line) => void; still: boolean; passed: number | null }) {
  const { of: lines, chosen, choose, passed } = props;
  // Of a recording the line at the cursor stays in sight, and not the newest one.
  const still = props.still || passed !== null;
  const LINE = useNarrow() ? NARROW : WIDE;
  const box = useRef<HTMLDivElement>(null);
  const [sight, setSight] = useState({ top: 0, height: 600 });
  const [following, setFollowing] = useState(true);

  const look = () => {
    const there = box.current;
    if (!there) return;
    setSight({ top: there.scrollTop, height: there.clientHeight });
    setFollowing(there.scrollTop + there.clientHeight >= there.scrollHeight - LINE);
  };

  // biome-ignore lint/correctness/useExhaustiveDependencies: it follows when lines come
  useLayoutEffect(() => {
    if (following && !still && box.current) box.current.scrollTop = box.current.scrollHeight;
  }, [lines, following, still]);

  useLayoutEffect(() => {
    const there = box.current;
    if (!there || passed === null || passed === 0) return;
    const place = (passed - 1) * LINE;
    if (place < there.scrollTop || place + LINE > there.scrollTop + there.clientHeight) {
      there.scrollTop = place - there.clientHeight / 2;
      setSight({ top: there.scrollTop, height: there.clientHeight });
    }
  }, [passed, LINE]);

  useEffect(() => {
    const there = box.current;
    if (!there) return;
    const resized = new ResizeObserver(() => setSight({ top: there.scrollTop, height: there.clientHeight }));
    resized.observe(there);
    return () => resized.disconnect();
  }, []);

  const first = Math.max(0, Math.floor(sight.top / LINE) - BEYOND);
  const last = Math.min(lines.length, Math.ceil((sight.top + sight.height) / LINE) + BEYOND);

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
    <div className="panel lines" role="group" aria-label="Lines of the log" tabIndex={0} ref={box} onScroll={look} onKeyDown={step}>
      <div style={{ height: lines.length * LINE, position: "relative" }}>
        {lines.slice(first, last).map((line, index) => (
          <button
            // biome-ignore lint/suspicious/noArrayIndexKey: a jump writes other words into the same elements, instead of making new ones
            key={index}
            type="button"
            tabIndex={-1}
            className={`line ${LINE === NARROW ? "two" : ""} ${line.isEarlier ? "earlier" : ""} ${passed !== null && first + index >= passed ? "later" : ""} ${passed !== null && first + index === passed - 1 ? "present" : ""} ${BAD_KINDS.has(line.kind) ? "bad" : WARN_KINDS.has(line.kind) ? "warn" : ""}`}
            aria-pressed={line.key === chosen}
            style={{ top: (first + index) * LINE, height: LINE }}
            onClick={() => choose(line)}
          >
            <span className="figures time">{seconds(line.time_s)}</span>
            <span className="kind">{line.kind}</span>
            <span className="about">{line.about}</span>
            <span className="what">
              {line.isEarlier && <span className="tag">earlier run</span>}
              {line.times > 1 && <span className="tag">{line.times}×</span>} {line.text}
              {line.who && <span className="quiet"> by {line.who}</span>}
            </span>
          </button>
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
          To the newest
        </button>
      )}
    </div>
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

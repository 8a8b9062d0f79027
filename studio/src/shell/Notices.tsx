// SPDX-License-Identifier: Apache-2.0
import { type ReactNode, useEffect, useRef, useState } from "react";
import { watchAim } from "./aim";

/** Time for which the page tells of a refused press, ms. */
const TOLD_MS = 4000;

/** The place of messages, in every view. Its height is fixed, so that nothing below it moves; what does not fit unfolds over the view. */
export function Notices(props: { children: ReactNode }) {
  const content = useRef<HTMLDivElement>(null);
  const [isMore, setMore] = useState(false);
  const [isOpen, setOpen] = useState(false);
  useEffect(() => {
    const inner = content.current;
    const outer = inner?.parentElement;
    if (!inner || !outer) return;
    const look = () => setMore(inner.offsetHeight > (outer.parentElement?.clientHeight ?? 0) + 1);
    const observer = new ResizeObserver(look);
    observer.observe(inner);
    observer.observe(outer);
    return () => observer.disconnect();
  }, []);
  useEffect(() => {
    if (!isMore) setOpen(false);
  }, [isMore]);
  return (
    <section className="notices-place" aria-label="Messages">
      <div className={`notices ${isOpen ? "open" : ""}`} tabIndex={0}>
        <div ref={content}>{props.children}</div>
      </div>
      {isMore && (
        <button type="button" className="unfold" aria-expanded={isOpen} onClick={() => setOpen(!isOpen)}>
          {isOpen ? "Fold" : "All messages"}
        </button>
      )}
    </section>
  );
}

/** Refuses presses that would hit another control than the one that was aimed at, and says so. */
export function Aim() {
  const [count, setCount] = useState(0);
  useEffect(() => watchAim(() => setCount((before) => before + 1)), []);
  useEffect(() => {
    if (count === 0) return;
    const over = setTimeout(() => setCount(0), TOLD_MS);
    return () => clearTimeout(over);
  }, [count]);
  if (count === 0) return null;
  return (
    <div className="toast" role="status">
      The page changed under your press, so nothing was done. Press again.
    </div>
  );
}

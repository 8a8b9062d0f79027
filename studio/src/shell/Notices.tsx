// SPDX-License-Identifier: Apache-2.0

import { type ReactNode, useEffect, useRef, useState } from "react";
import { tr } from "../language/text";
import { watchAim } from "./aim";

/** Time for which a refused press is reported, ms. */
const TOLD_MS = 4000;

/** Area for messages, in every view. Its height is fixed, so that nothing below it moves; longer content expands over the view. */
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
    <section className="notices-place" aria-label={tr("shell.messages")}>
      <div className={`notices ${isOpen ? "open" : ""}`} tabIndex={0}>
        <div ref={content}>{props.children}</div>
      </div>
      {isMore && (
        <button type="button" className="unfold" aria-expanded={isOpen} onClick={() => setOpen(!isOpen)}>
          {isOpen ? tr("shell.showFewer") : tr("shell.allMessages")}
        </button>
      )}
    </section>
  );
}

/** Refuses and reports presses that would hit a control other than the one at which the person aimed. */
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
    <div className="toast" role="status" data-count={count}>
      {tr("shell.thePageChangedAsYouPressed")}
    </div>
  );
}

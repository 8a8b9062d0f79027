// SPDX-License-Identifier: Apache-2.0
import { useEffect, useRef } from "react";

/** Ctrl+Z takes back the last change of the draft, Ctrl+Y or Ctrl+Shift+Z makes it again; while somebody types, they are the field's. */
export function useUndoKeys(back: (() => void) | null, again: (() => void) | null): void {
  const ways = useRef({ back, again });
  ways.current = { back, again };
  useEffect(() => {
    const press = (event: KeyboardEvent) => {
      const way = undoOf(event);
      if (way === null || (event.target instanceof HTMLElement && event.target.dataset.typed === "yes")) return;
      // The browser would take back what was typed last, in a field that nobody looks at.
      event.preventDefault();
      ways.current[way]?.();
    };
    window.addEventListener("keydown", press);
    return () => window.removeEventListener("keydown", press);
  }, []);
}

export function undoOf(event: { ctrlKey: boolean; metaKey: boolean; shiftKey: boolean; key: string }): "back" | "again" | null {
  if (!event.ctrlKey && !event.metaKey) return null;
  const key = event.key.toLowerCase();
  if (key === "z") return event.shiftKey ? "again" : "back";
  return key === "y" ? "again" : null;
}

// SPDX-License-Identifier: Apache-2.0
import { useEffect, useRef } from "react";

/**
 * Handles Ctrl+Z (undo), and Ctrl+Y and Ctrl+Shift+Z (redo), for the draft. While a person is typing in a field, these shortcuts apply
 * to the field.
 */
export function useUndoKeys(back: (() => void) | null, again: (() => void) | null): void {
  const ways = useRef({ back, again });
  ways.current = { back, again };
  useEffect(() => {
    const press = (event: KeyboardEvent) => {
      const way = undoOf(event);
      if (way === null || (event.target instanceof HTMLElement && event.target.dataset.typed === "yes")) return;
      // Otherwise, the browser would undo the latest input in an unrelated field.
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

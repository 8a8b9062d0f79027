// SPDX-License-Identifier: Apache-2.0
import { useEffect, useRef } from "react";
import { copied, type Piece, pieceOf, textOf } from "./clipboard";
import type { Draft } from "./definition";

/** Draft and functions for copying and pasting. */
export interface Copying {
  draft: Draft;
  /** Labels of the blocks to be copied. */
  labels: string[];
  paste: (piece: Piece) => void;
  remove: (labels: string[]) => void;
}

/**
 * Handles Ctrl+C, Ctrl+X and Ctrl+V for blocks through the clipboard, also between drafts and tabs. In text fields, these shortcuts keep
 * their usual function.
 */
export function useCopyKeys(of: Copying): void {
  const latest = useRef(of);
  latest.current = of;
  useEffect(() => {
    const isText = (event: ClipboardEvent) =>
      event.target instanceof HTMLInputElement || event.target instanceof HTMLTextAreaElement || !document.getSelection()?.isCollapsed;
    const copy = (event: ClipboardEvent) => {
      const { draft, labels, remove } = latest.current;
      if (isText(event) || labels.length === 0 || !event.clipboardData) return;
      event.clipboardData.setData("text/plain", textOf(copied(draft, labels)));
      event.preventDefault();
      if (event.type === "cut") remove(labels);
    };
    const paste = (event: ClipboardEvent) => {
      const piece = isText(event) ? null : pieceOf(event.clipboardData?.getData("text/plain") ?? "");
      if (!piece) return;
      event.preventDefault();
      latest.current.paste(piece);
    };
    document.addEventListener("copy", copy);
    document.addEventListener("cut", copy);
    document.addEventListener("paste", paste);
    return () => {
      document.removeEventListener("copy", copy);
      document.removeEventListener("cut", copy);
      document.removeEventListener("paste", paste);
    };
  }, []);
}

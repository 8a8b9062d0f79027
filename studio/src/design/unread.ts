// SPDX-License-Identifier: Apache-2.0
import { createContext, useCallback, useMemo, useState } from "react";

/** A field whose text cannot be read: what it is called, and why not. */
export interface UnreadField {
  id: string;
  label: string;
  wrong: string;
}

/** Receives the text of a field that cannot be read; null: it can be read again, or the field is gone. */
export const Unread = createContext<((id: string, field: UnreadField | null) => void) | null>(null);

/** The fields within a provider whose text cannot be read, in the order in which that was found. */
export function useUnread(): { fields: UnreadField[]; tell: (id: string, field: UnreadField | null) => void } {
  const [of, set] = useState<ReadonlyMap<string, UnreadField>>(new Map());
  const tell = useCallback((id: string, field: UnreadField | null) => {
    set((before) => {
      if (field === null && !before.has(id)) return before;
      const next = new Map(before);
      if (field === null) next.delete(id);
      else next.set(id, field);
      return next;
    });
  }, []);
  const fields = useMemo(() => [...of.values()], [of]);
  return { fields, tell };
}

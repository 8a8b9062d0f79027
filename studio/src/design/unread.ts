// SPDX-License-Identifier: Apache-2.0
import { createContext, useCallback, useMemo, useState } from "react";

/** A field with invalid text: its label, and the reason. */
export interface UnreadField {
  id: string;
  label: string;
  wrong: string;
}

/** Callback that receives a field with invalid text, or null when its text is valid again or the field is removed. */
export const Unread = createContext<((id: string, field: UnreadField | null) => void) | null>(null);

/** Returns the fields within a provider that have invalid text, in the order in which they became invalid. */
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

// SPDX-License-Identifier: Apache-2.0
import { useEffect, useMemo, useState } from "react";

/** Number of boxes or wires added per animation frame. */
const SLICE = 25;

/** Returns the first items, and more in each animation frame, so that the page stays responsive while a large drawing loads. */
export function useSlices<T>(all: T[]): T[] {
  const [shown, setShown] = useState(SLICE);
  const isAll = shown >= all.length;
  useEffect(() => {
    if (isAll) return;
    const frame = requestAnimationFrame(() => setShown(shown + SLICE));
    return () => cancelAnimationFrame(frame);
  }, [shown, isAll]);
  return useMemo(() => (isAll ? all : all.slice(0, shown)), [all, shown, isAll]);
}

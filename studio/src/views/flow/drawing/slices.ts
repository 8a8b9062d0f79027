// SPDX-License-Identifier: Apache-2.0
import { useEffect, useMemo, useState } from "react";

/** So many boxes or wires are put into the page at once. */
const SLICE = 25;

/** The first ones of many, more with each animation frame: the page answers while a large drawing comes. */
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

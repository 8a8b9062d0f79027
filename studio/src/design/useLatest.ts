// SPDX-License-Identifier: Apache-2.0
import { type RefObject, useRef } from "react";

/**
 * Returns a reference to the value of the latest render, for code that continues after an asynchronous answer. By then, the value at the
 * time of the request is outdated, and writing it back would discard later changes.
 */
export function useLatest<T>(value: T): RefObject<T> {
  const latest = useRef(value);
  latest.current = value;
  return latest;
}

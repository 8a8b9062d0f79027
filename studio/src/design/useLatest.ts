// SPDX-License-Identifier: Apache-2.0
import { type RefObject, useRef } from "react";

/**
 * A reference to the value with which a part was drawn last: for what goes on when an answer comes. The value that was there when the
 * question was asked is out of date by then, and to write it back would take away what was done meanwhile.
 */
export function useLatest<T>(value: T): RefObject<T> {
  const latest = useRef(value);
  latest.current = value;
  return latest;
}

// SPDX-License-Identifier: Apache-2.0
import { createElement, Fragment, type ReactNode } from "react";
import { type Arguments, type Key, parts } from "./text";

/** Returns a text as `tr` does, but placeholders may also be replaced by elements. */
export function trNodes<K extends Key>(key: K, ...given: Arguments<K, ReactNode>): ReactNode {
  return createElement(Fragment, null, ...parts<ReactNode>(key, given[0]));
}

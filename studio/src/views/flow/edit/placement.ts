// SPDX-License-Identifier: Apache-2.0
// On which sources blocks of a draft run. That is of the system, not of the definition: it is kept beside the draft, and in no file.
import type { Draft, DrawnDefinition } from "./definition";
import { renamedKey } from "./nested";

/** Label, in a graph within `outer.inner`, → interrupt source. */
export type Placement = Readonly<Record<string, string>>;

/** The placement after a change of the draft: what names a block that has another label follows, what names none is gone. */
export function followed(placement: Placement, before: DrawnDefinition, next: DrawnDefinition): Placement {
  if (before.kind === "composition" || next.kind === "composition" || Object.keys(placement).length === 0) return placement;
  const renamed = renamedKey(before.of.blocks, next.of.blocks);
  const lines = Object.entries(placement).flatMap(([label, source]) => {
    const [first = "", ...rest] = label.split(".");
    const now = renamed?.[0] === first ? renamed[1] : first;
    return Object.hasOwn(next.of.blocks, now) ? [[[now, ...rest].join("."), source]] : [];
  });
  const made = Object.fromEntries(lines) as Placement;
  return JSON.stringify(made) === JSON.stringify(placement) ? placement : made;
}

/** The placement with a block on a source; null: where a start says. */
export function placedOn(placement: Placement, label: string, source: string | null): Placement {
  const rest = Object.entries(placement).filter(([one]) => one !== label);
  return Object.fromEntries(source === null ? rest : [...rest, [label, source]]);
}

/** The same as the call `place` takes it: patterns of labels behind the name of the verb. */
export function patternsOf(draft: Draft, placement: Placement): Record<string, string> {
  return Object.fromEntries(Object.entries(placement).map(([label, source]) => [`${draft.of.name}.${label}`, source]));
}

// SPDX-License-Identifier: Apache-2.0
// Sources on which blocks of a draft run. They belong to the system, not to the definition: they are stored separately from the draft, and
// never in a file.
import type { Draft, DrawnDefinition } from "./definition";
import { renamedKey } from "./nested";

/** Interrupt source of each block, by label; a block in nested graphs has the label `outer.inner`. */
export type Placement = Readonly<Record<string, string>>;

/** Returns the placement after a change of the draft: entries follow renamed blocks, and those of removed blocks are dropped. */
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

/** Places a block on a source; null restores the placement specified at the start of the verb. */
export function placedOn(placement: Placement, label: string, source: string | null): Placement {
  const rest = Object.entries(placement).filter(([one]) => one !== label);
  return Object.fromEntries(source === null ? rest : [...rest, [label, source]]);
}

/** Converts a placement to the patterns of the call `place`. Each pattern consists of the name of the verb and a label. */
export function patternsOf(draft: Draft, placement: Placement): Record<string, string> {
  return Object.fromEntries(Object.entries(placement).map(([label, source]) => [`${draft.of.name}.${label}`, source]));
}

// SPDX-License-Identifier: Apache-2.0

import { useState } from "react";
import { type Refusal, refusalsOf } from "../../../control/refusals";
import { Refusals } from "../../../design/parts";
import { tr } from "../../../language/text";
import { useLive } from "../../../shell/context";
import type { PortSide } from "../drawing/drawing";
import { allSets, connect, disconnect, type NamedSet, setWith } from "./change";
import { type Draft, definitionOf } from "./definition";
import type { Faces } from "./faces";
import type { PortAnswer, WireStart } from "./offered";

/** Returns the possible other ends of a wire from a port: those in the system's answer, and every unbound boundary. */
export function otherEnds(draft: Draft, side: PortSide, answered: PortAnswer[]): Map<string, string | NamedSet> {
  const ends = new Map<string, string | NamedSet>();
  for (const { block, port, reason } of answered) if (block !== "" && reason === null) ends.set(`${block}.${port}`, `${block}.${port}`);
  const refused = new Set(answered.filter((one) => one.block === "" && one.reason !== null).map((one) => one.port));
  for (const set of allSets(draft)) {
    const fits = set.kind === "instantiation_parameters" || set.kind === (side === "output" ? "outputs" : "inputs");
    if (fits && (set.ports.length === 0 || !refused.has(set.name))) ends.set(set.name, set);
  }
  // A cell may have several writers, one in each command list.
  if (side === "output")
    for (const set of allSets(draft)) if (set.kind === "cells") ends.set(tr("flow.theCellName", { name: set.name }), set);
  return ends;
}

/** Field for drawing a wire without a mouse: the system is queried for possible ends, one of which is selected. */
export function WireField(props: {
  draft: Draft;
  label: string;
  port: string;
  side: PortSide;
  faces: Faces;
  change: (draft: Draft) => void;
  /** Offers new blocks. */
  offer: (from: WireStart) => void;
}) {
  const { draft, label, port, side, faces } = props;
  const control = useLive();
  const [ends, setEnds] = useState<Map<string, string | NamedSet> | null>(null);
  const [refusals, setRefusals] = useState<Refusal[]>([]);
  const name = `${label}.${port}`;
  const present = setWith(draft, name);
  const ask = () => {
    control.look("compatible", { [draft.kind]: definitionOf(draft), from: { block: label, port } }).then(
      (found) => {
        setEnds(otherEnds(draft, side, found as PortAnswer[]));
        setRefusals([]);
      },
      (why) => setRefusals(refusalsOf(why)),
    );
  };
  return (
    <div className="row">
      <select
        aria-label={side === "output" ? tr("flow.wireNameTo", { name }) : tr("flow.wireNameFrom", { name })}
        value=""
        onFocus={ask}
        onChange={(event) => {
          const other = ends?.get(event.target.value);
          if (other !== undefined)
            props.change(side === "output" ? connect(draft, name, other, faces) : connect(draft, other, name, faces));
        }}
      >
        <option value="">{side === "output" ? tr("flow.wireTo") : tr("flow.wireFrom")}</option>
        {[...(ends?.keys() ?? [])].map((end) => (
          <option key={end}>{end}</option>
        ))}
      </select>
      <button type="button" aria-label={tr("flow.newBlockAtName", { name })} onClick={() => props.offer({ box: label, port, side })}>
        {tr("flow.new")}
      </button>
      {side === "input" && present && (
        <button type="button" aria-label={tr("flow.disconnectName", { name })} onClick={() => props.change(disconnect(draft, name, faces))}>
          {tr("flow.disconnect")}
        </button>
      )}
      <Refusals of={refusals} />
    </div>
  );
}

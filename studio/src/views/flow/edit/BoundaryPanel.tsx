// SPDX-License-Identifier: Apache-2.0

import { Panel } from "../../../design/parts";
import { TextField } from "../../../design/TextField";
import { tr } from "../../../language/text";
import type { Wire } from "../drawing/drawing";
import * as change from "./change";
import { type Draft, setsOf } from "./definition";
import { boundaryOf } from "./drawn";
import { freePlace } from "./places";

/** Buttons that add ports to a graph, or instantiation parameters to a verb. */
export function Boundaries(props: { draft: Draft; put: (draft: Draft) => void }) {
  const { draft, put } = props;
  const kinds = draft.kind === "graph" ? (["inputs", "outputs"] as const) : (["instantiation_parameters"] as const);
  const words = { inputs: tr("flow.input"), outputs: tr("flow.output"), instantiation_parameters: tr("flow.instantiationParameter") };
  const names = { inputs: "input", outputs: "output", instantiation_parameters: "instantiation" };
  return kinds.map((kind) => (
    <button key={kind} type="button" onClick={() => put(change.addBoundary(draft, kind, names[kind], freePlace(draft)))}>
      {tr("flow.addWords", { words: words[kind] })}
    </button>
  ));
}

/** Panel for the name of the selected port of the graph or instantiation parameter. */
export function BoundaryPanel(props: { draft: Draft; box: string; put: (draft: Draft) => void; choose: (box: string) => void }) {
  const { draft, box, put } = props;
  const set = boundaryOf(draft, box);
  if (!set) return null;
  return (
    <Panel
      title={set.name}
      end={
        <button type="button" onClick={() => put(change.removeSet(draft, set.kind, set.name))}>
          {tr("flow.remove")}
        </button>
      }
    >
      <TextField
        label={tr("flow.name")}
        value={set.name}
        commit={(to) => {
          put(change.renameSet(draft, set.kind, set.name, to));
          props.choose(`${set.kind}:${to}`);
        }}
      />
      <p className="quiet">
        {set.ports.length > 0 ? tr("flow.bindsPorts", { ports: set.ports.join(", ") }) : tr("flow.notBoundYetDrawAWire")}
      </p>
    </Panel>
  );
}

/** Panel for the target of the selected wire: a port of the graph, an instantiation parameter, or a cell. */
export function WirePanel(props: { draft: Draft; wire: Wire | undefined; put: (draft: Draft) => void; choose: (box: string) => void }) {
  const { draft, wire, put, choose } = props;
  const box = wire && [wire.from.box, wire.to.box].find((one) => boundaryOf(draft, one));
  if (box) return <BoundaryPanel draft={draft} box={box} put={put} choose={choose} />;
  return <CellPanel draft={draft} wire={wire} put={put} />;
}

/** Panel for the name of a wire's cell. */
function CellPanel(props: { draft: Draft; wire: Wire | undefined; put: (draft: Draft) => void }) {
  const { draft, wire, put } = props;
  const ports = wire && setsOf(draft, "cells")[wire.cell];
  if (!wire || !ports) return null;
  return (
    <Panel title={tr("flow.wireCell", { cell: wire.cell })}>
      <TextField label={tr("flow.cell")} value={wire.cell} commit={(to) => put(change.renameSet(draft, "cells", wire.cell, to))} />
      <p className="quiet">{ports.join(", ")}</p>
    </Panel>
  );
}

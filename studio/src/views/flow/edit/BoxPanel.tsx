// SPDX-License-Identifier: Apache-2.0

import type { Value } from "../../../control/shapes";
import { own } from "../../../design/own";
import { Panel } from "../../../design/parts";
import { TextField } from "../../../design/TextField";
import { unitText } from "../../../design/units";
import { tr, trWord } from "../../../language/text";
import { portText } from "../drawing/drawing";
import { freeName, removeBlock, renameBlock, setConstant, setDivide, setMode } from "./change";
import type { Draft } from "./definition";
import { type Faces, type Item, itemsOf, modeText, sideOf } from "./faces";
import { ModeField } from "./ModeField";
import { ownGraph } from "./nested";
import type { WireStart } from "./offered";
import { WireField } from "./WireField";
import { constantOf, constantText } from "./written";

/** Panel of a block of the draft: its label, constants, ports and conditions. */
export function BoxPanel(props: {
  draft: Draft;
  label: string;
  faces: Faces;
  change: (draft: Draft) => void;
  choose: (label: string) => void;
  /** Offers the possible ends of a wire from a port. */
  offer: (from: WireStart) => void;
  /** Opens a nested graph. */
  enter: (label: string) => void;
  /** Names of existing graphs, so that a copy made for one use can be given an unused name. */
  graphs: string[];
  /** Interrupt sources of the system, and the source on which the block is to run; null for the source specified at the start. */
  sources: string[];
  source: string | null;
  runOn: (source: string | null) => void;
}) {
  const { draft, label, faces, change } = props;
  const use = own(draft.of.blocks, label);
  if (!use) return null;
  const items = itemsOf(use, faces);
  const set = items.filter((item) => item.kind === "parameter" || item.kind === "size" || (item.kind === "input" && item.has_default));
  const name = "subroutine" in use.block ? use.block.subroutine : tr("flow.graphName", { name: use.block.graph.name });
  const graphName = "graph" in use.block ? use.block.graph.name : "";
  const doc = "subroutine" in use.block ? faces.get(use.block.subroutine)?.doc : use.block.graph.doc;
  return (
    <Panel
      title={label}
      end={
        <button type="button" onClick={() => change(removeBlock(draft, label))}>
          {tr("flow.remove")}
        </button>
      }
    >
      <div className="stack">
        <TextField
          label={tr("flow.label")}
          value={label}
          commit={(to) => {
            const next = renameBlock(draft, label, to);
            if (next !== draft) props.choose(to);
            change(next);
          }}
        />
        <p className="quiet">
          {name}. {doc}
        </p>
        {props.sources.length > 0 && (
          <label className="row">
            <span className="quiet">{tr("flow.runsOn")}</span>
            <select value={props.source ?? ""} onChange={(event) => props.runOn(event.target.value || null)}>
              <option value="">{tr("flow.theSourceChosenAtStart")}</option>
              {[...new Set([...(props.source === null ? [] : [props.source]), ...props.sources])].map((name) => (
                <option key={name}>{name}</option>
              ))}
            </select>
          </label>
        )}
        {"graph" in use.block && (
          <div className="row">
            <button type="button" onClick={() => props.enter(label)}>
              {tr("flow.openGraph")}
            </button>
            <button type="button" onClick={() => change(ownGraph(draft, label, freeName(graphName, props.graphs)))}>
              {tr("flow.makeIndependent")}
            </button>
          </div>
        )}
        {draft.kind === "graph" && (
          <TextField
            label={tr("flow.onceIn")}
            placeholder={tr("flow.1Invocation")}
            value={String(own(draft.of.divide, label) ?? "")}
            commit={(text) => {
              if (text !== "" && !/^[1-9]\d*$/.test(text)) return tr("flow.textIsNotANumberOf", { text });
              change(setDivide(draft, label, text === "" ? undefined : Number(text)));
            }}
          />
        )}
        {set.map((item) => (
          <ConstantField
            key={item.name}
            item={item}
            value={own(use.constants, item.name)}
            commit={(value) => change(setConstant(draft, label, item.name, value))}
          />
        ))}
        <dl>
          {items
            .filter((item) => item.kind !== "parameter" && item.kind !== "state" && item.kind !== "size")
            .map((item) => [
              <dt key={`${item.name} name`}>{item.name}</dt>,
              <dd key={item.name} title={item.doc} data-place={`item:${item.name}`}>
                {trWord(item.kind)}
                {item.type_text && `, ${portText({ ...item, mode: item.kind === "condition" ? "" : modeText(item.mode) })}`}
                <Wiring item={item} draft={draft} label={label} faces={faces} change={change} offer={props.offer} />
                {(item.kind === "input" || item.kind === "output") && (
                  <ModeField
                    of={`${label}.${item.name}`}
                    declared={modeText(item.mode)}
                    mode={own(draft.of.modes, `${label}.${item.name}`)}
                    put={(mode) => change(setMode(draft, `${label}.${item.name}`, mode))}
                  />
                )}
              </dd>,
            ])}
        </dl>
      </div>
    </Panel>
  );
}

function Wiring(props: {
  item: Item;
  draft: Draft;
  label: string;
  faces: Faces;
  change: (draft: Draft) => void;
  offer: (from: WireStart) => void;
}) {
  const { item, ...more } = props;
  const side = sideOf(item);
  return side && <WireField {...more} port={item.name} side={side} />;
}

function ConstantField(props: { item: Item; value: Value | undefined; commit: (value: Value | undefined) => void }) {
  const { item, value } = props;
  return (
    <div title={item.doc} data-place={`item:${item.name}`}>
      <TextField
        label={item.unit ? `${item.name} (${unitText(item.unit)})` : item.name}
        value={constantText(value)}
        placeholder={tr("flow.default")}
        commit={(text) => {
          const read = constantOf(text, item.type_text);
          if (read.wrong === null) props.commit(read.value);
          return read.wrong;
        }}
      />
    </div>
  );
}

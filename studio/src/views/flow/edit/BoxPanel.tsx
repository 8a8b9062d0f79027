// SPDX-License-Identifier: Apache-2.0
import type { Value } from "../../../control/shapes";
import { Panel } from "../../../design/parts";
import { TextField } from "../../../design/TextField";
import { portText } from "../drawing/drawing";
import { removeBlock, renameBlock, setConstant, setMode } from "./change";
import type { Draft } from "./definition";
import { type Faces, type Item, itemsOf, modeText, sideOf } from "./faces";
import { ModeField } from "./ModeField";
import { WireField } from "./WireField";
import { constantOf, constantText } from "./written";

/** A block of the draft: its label, its constants, its ports and conditions. */
export function BoxPanel(props: {
  draft: Draft;
  label: string;
  faces: Faces;
  change: (draft: Draft) => void;
  choose: (label: string) => void;
}) {
  const { draft, label, faces, change } = props;
  const use = draft.of.blocks[label];
  if (!use) return null;
  const items = itemsOf(use, faces);
  const set = items.filter((item) => item.kind === "parameter" || item.kind === "size" || (item.kind === "input" && item.has_default));
  const name = "subroutine" in use.block ? use.block.subroutine : `graph ${use.block.graph.name}`;
  const doc = "subroutine" in use.block ? faces.get(use.block.subroutine)?.doc : use.block.graph.doc;
  return (
    <Panel
      title={label}
      end={
        <button type="button" onClick={() => change(removeBlock(draft, label))}>
          Remove
        </button>
      }
    >
      <div className="stack">
        <TextField
          label="Label"
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
        {set.map((item) => (
          <ConstantField
            key={item.name}
            item={item}
            value={use.constants[item.name]}
            commit={(value) => change(setConstant(draft, label, item.name, value))}
          />
        ))}
        <dl>
          {items
            .filter((item) => item.kind !== "parameter" && item.kind !== "state" && item.kind !== "size")
            .map((item) => [
              <dt key={`${item.name} name`}>{item.name}</dt>,
              <dd key={item.name} title={item.doc}>
                {item.kind.replace("_", " ")}
                {item.type_text && `, ${portText({ ...item, mode: item.kind === "condition" ? "" : modeText(item.mode) })}`}
                <Wiring item={item} draft={draft} label={label} faces={faces} change={change} />
                {(item.kind === "input" || item.kind === "output") && (
                  <ModeField
                    of={`${label}.${item.name}`}
                    declared={modeText(item.mode)}
                    mode={draft.of.modes?.[`${label}.${item.name}`]}
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

function Wiring(props: { item: Item; draft: Draft; label: string; faces: Faces; change: (draft: Draft) => void }) {
  const { item, ...more } = props;
  const side = sideOf(item);
  return side && <WireField {...more} port={item.name} side={side} />;
}

function ConstantField(props: { item: Item; value: Value | undefined; commit: (value: Value | undefined) => void }) {
  const { item, value } = props;
  return (
    <div title={item.doc}>
      <TextField
        label={item.unit ? `${item.name} (${item.unit})` : item.name}
        value={constantText(value)}
        placeholder="default"
        commit={(text) => {
          const read = constantOf(text, item.type_text);
          if (read.wrong === null) props.commit(read.value);
          return read.wrong;
        }}
      />
    </div>
  );
}

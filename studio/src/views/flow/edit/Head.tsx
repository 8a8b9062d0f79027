// SPDX-License-Identifier: Apache-2.0

import type { ReactNode } from "react";
import type { Refusal } from "../../../control/refusals";
import { Refusals } from "../../../design/parts";
import { TextField } from "../../../design/TextField";
import { tr } from "../../../language/text";
import { UnreadDraft } from "./DraftBoundary";
import type { DrawnDefinition } from "./definition";
import { FileTools } from "./FileTools";
import type { useDraft } from "./history";

export type Working = ReturnType<typeof useDraft>;

const KINDS: Record<DrawnDefinition["kind"], string> = {
  graph: tr("flow.graph"),
  verb: tr("flow.verb"),
  composition: tr("flow.composition"),
};

/** The toolbar above the drawing: name, purpose, undo and redo, files. `children` are the tools of the specific editor. */
export function Head(props: {
  work: Working;
  /** Definition whose name is shown: the whole, or the open nested graph. */
  of: DrawnDefinition;
  put: (text: { name?: string; doc?: string }) => void;
  trouble: Refusal[];
  opened: () => void;
  children: ReactNode;
}) {
  const { work, of, put } = props;
  return (
    <div className="tools stack">
      <div className="row">
        <TextField
          label={KINDS[of.kind]}
          value={of.of.name}
          commit={(name) => {
            if (name === "") return tr("flow.enterAName");
            put({ name });
          }}
        />
        <TextField label={tr("flow.purpose")} value={of.of.doc} placeholder={tr("flow.description")} commit={(doc) => put({ doc })} />
        <button type="button" disabled={!work.back} onClick={() => work.back?.()}>
          {tr("flow.undo")}
        </button>
        <button type="button" disabled={!work.again} onClick={() => work.again?.()}>
          {tr("flow.redo")}
        </button>
        {props.children}
      </div>
      <FileTools
        draft={work.draft}
        file={work.file}
        open={(to, from) => {
          work.open(to, from);
          props.opened();
        }}
      />
      <UnreadDraft />
      <Refusals of={props.trouble} />
    </div>
  );
}

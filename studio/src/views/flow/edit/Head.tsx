// SPDX-License-Identifier: Apache-2.0
import type { ReactNode } from "react";
import type { Refusal } from "../../../control/refusals";
import { Refusals } from "../../../design/parts";
import { TextField } from "../../../design/TextField";
import { UnreadDraft } from "./DraftBoundary";
import type { DrawnDefinition } from "./definition";
import { FileTools } from "./FileTools";
import type { useDraft } from "./history";

export type Working = ReturnType<typeof useDraft>;

const KINDS: Record<DrawnDefinition["kind"], string> = { graph: "Graph", verb: "Verb", composition: "Composition" };

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
            if (name === "") return "enter a name";
            put({ name });
          }}
        />
        <TextField label="purpose" value={of.of.doc} placeholder="description" commit={(doc) => put({ doc })} />
        <button type="button" disabled={!work.back} onClick={() => work.back?.()}>
          Undo
        </button>
        <button type="button" disabled={!work.again} onClick={() => work.again?.()}>
          Redo
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

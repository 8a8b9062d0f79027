// SPDX-License-Identifier: Apache-2.0
import { CompositionEditor } from "./CompositionEditor";
import { FlowEditor } from "./FlowEditor";
import { useDraft } from "./history";
import { useUndoKeys } from "./undoKeys";

/** Editor of graphs, verbs and compositions. The system receives only queries until a person installs the definition. */
export default function Editor() {
  const work = useDraft();
  useUndoKeys(work.back, work.again);
  const { draft } = work;
  return (
    <div className="flow editing">
      {draft.kind === "composition" ? <CompositionEditor work={work} draft={draft} /> : <FlowEditor work={work} whole={draft} />}
    </div>
  );
}

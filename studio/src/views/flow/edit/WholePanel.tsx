// SPDX-License-Identifier: Apache-2.0
import { period } from "../../../design/numbers";
import { Panel } from "../../../design/parts";
import { TextField } from "../../../design/TextField";
import { setWhole } from "./change";
import type { Draft } from "./definition";
import type { VerbDraft } from "./NamedPanel";
import { everyOf } from "./written";

const CUT_OFF = ["halt", "continue", "safe"];

/** What a verb says of itself as a whole: where it begins and ends, what happens when its program is gone, manual mode. */
export function WholePanel(props: { draft: VerbDraft; change: (draft: Draft) => void }) {
  const { draft, change } = props;
  const { command_lists, initial, ending, ending_limit_ns, if_cut_off, manual } = draft.of;
  const lists = Object.keys(command_lists);
  return (
    <Panel title="The whole">
      <div className="stack">
        <label className="row">
          <span className="quiet">begins with</span>
          <select
            value={initial ?? ""}
            onChange={(event) => change({ ...draft, of: { ...draft.of, initial: event.target.value || null } })}
          >
            <option value="">the first command list</option>
            {lists.map((name) => (
              <option key={name}>{name}</option>
            ))}
          </select>
        </label>
        <label className="row">
          <span className="quiet">at every end runs</span>
          <select value={ending ?? ""} onChange={(event) => change(setWhole(draft, { ending: event.target.value || null }))}>
            <option value="">nothing</option>
            {lists.map((name) => (
              <option key={name}>{name}</option>
            ))}
          </select>
        </label>
        {ending && (
          <TextField
            label="for at most"
            placeholder="2 s"
            value={ending_limit_ns ? period(ending_limit_ns) : ""}
            commit={(text) => {
              const read = everyOf(text);
              if (read.wrong !== undefined) return read.wrong;
              change(setWhole(draft, { ending_limit_ns: read.value }));
            }}
          />
        )}
        <label className="row">
          <span className="quiet">where its program is gone</span>
          <select value={if_cut_off ?? ""} onChange={(event) => change(setWhole(draft, { if_cut_off: event.target.value || null }))}>
            <option value="">as every verb of its kind</option>
            {CUT_OFF.map((name) => (
              <option key={name}>{name}</option>
            ))}
          </select>
        </label>
        <label className="row">
          <input
            type="checkbox"
            checked={manual === true}
            onChange={(event) => change(setWhole(draft, { manual: event.target.checked }))}
          />
          may be started in manual mode
        </label>
      </div>
    </Panel>
  );
}

// SPDX-License-Identifier: Apache-2.0

import { period } from "../../../design/numbers";
import { Panel } from "../../../design/parts";
import { TextField } from "../../../design/TextField";
import { tr, trWord } from "../../../language/text";
import { WHOLE } from "./aim";
import { setWhole } from "./change";
import type { Draft, Holding } from "./definition";
import type { VerbDraft } from "./NamedPanel";
import { holdingOf } from "./reading";
import { everyOf } from "./written";

const CUT_OFF = ["halt", "continue", "safe"];

/** Properties of the whole verb: its initial list and ending, its behaviour when cut off, manual mode. */
export function WholePanel(props: { draft: VerbDraft; change: (draft: Draft) => void }) {
  const { draft, change } = props;
  const { command_lists, initial, ending, ending_limit_ns, if_cut_off, manual } = draft.of;
  const lists = Object.keys(command_lists);
  return (
    <Panel title={tr("flow.execution")}>
      <div className="stack" data-place={WHOLE}>
        <label className="row">
          <span className="quiet">{tr("flow.beginsWith")}</span>
          <select
            value={initial ?? ""}
            onChange={(event) => change({ ...draft, of: { ...draft.of, initial: event.target.value || null } })}
          >
            <option value="">{tr("flow.theFirstCommandList")}</option>
            {lists.map((name) => (
              <option key={name}>{name}</option>
            ))}
          </select>
        </label>
        <label className="row">
          <span className="quiet">{tr("flow.atEveryEndRuns")}</span>
          <select value={ending ?? ""} onChange={(event) => change(setWhole(draft, { ending: event.target.value || null }))}>
            <option value="">{tr("flow.nothing")}</option>
            {lists.map((name) => (
              <option key={name}>{name}</option>
            ))}
          </select>
        </label>
        {ending && (
          <TextField
            label={tr("flow.forAtMost")}
            placeholder="2 s"
            value={ending_limit_ns ? period(ending_limit_ns) : ""}
            commit={(text) => {
              const read = everyOf(text);
              if (read.wrong !== undefined) return read.wrong;
              change(setWhole(draft, { ending_limit_ns: read.value }));
            }}
          />
        )}
        <SuspendField draft={draft} change={change} />
        <label className="row">
          <span className="quiet">{tr("flow.ifItsProgramIsLost")}</span>
          <select value={if_cut_off ?? ""} onChange={(event) => change(setWhole(draft, { if_cut_off: event.target.value || null }))}>
            <option value="">{tr("flow.asUsualForItsKind")}</option>
            {CUT_OFF.map((name) => (
              <option key={name} value={name}>
                {trWord(name)}
              </option>
            ))}
          </select>
        </label>
        <label className="row">
          <input
            type="checkbox"
            checked={manual === true}
            onChange={(event) => change(setWhole(draft, { manual: event.target.checked }))}
          />
          {tr("flow.mayBeStartedInManualMode")}
        </label>
      </div>
    </Panel>
  );
}

/** Field for the suspension of the verb: immediately, with safe outputs, or after its blocks have come to rest. */
function SuspendField(props: { draft: VerbDraft; change: (draft: Draft) => void }) {
  const { draft, change } = props;
  const ways = holdingOf(draft.of.suspend);
  const how = ways ? "holding" : typeof draft.of.suspend === "string" ? draft.of.suspend : "idle";
  const put = (holding: Holding[]) => change(setWhole(draft, { suspend: { holding } }));
  const set = (index: number, way: Partial<Holding>) => put((ways ?? []).map((one, at) => (at === index ? { ...one, ...way } : one)));
  return (
    <>
      <label className="row">
        <span className="quiet">{tr("flow.whenItIsSuspended")}</span>
        <select
          value={how}
          onChange={(event) => {
            if (event.target.value === "holding") put([{ set: "", until: "" }]);
            else change(setWhole(draft, { suspend: event.target.value }));
          }}
        >
          <option value="idle">{tr("flow.effortsAndSpeedsBecomeIdlePositions")}</option>
          <option value="hold">{tr("flow.itsLastCommandsAreHeldNone")}</option>
          <option value="hold_last">{tr("flow.itsLastCommandsAreHeldIncluding")}</option>
          <option value="safe">{tr("flow.itsOutputsBecomeSafe")}</option>
          <option value="holding">{tr("flow.itsBlocksComeToRestFirst")}</option>
        </select>
      </label>
      {ways?.map((way, index) => (
        // biome-ignore lint/suspicious/noArrayIndexKey: a way is known by its place
        <fieldset key={index} aria-label={tr("flow.comingToRestIndex", { index: index + 1 })}>
          <TextField label={tr("flow.sets")} placeholder="block.hold" value={way.set} commit={(to) => set(index, { set: to })} />
          <TextField label={tr("flow.until")} placeholder="block.held" value={way.until} commit={(until) => set(index, { until })} />
          {ways.length > 1 && (
            <button
              type="button"
              aria-label={tr("flow.removeComingToRestIndex", { index: index + 1 })}
              onClick={() => put(ways.filter((_, at) => at !== index))}
            >
              ×
            </button>
          )}
        </fieldset>
      ))}
      {ways && (
        <div className="row">
          <button type="button" onClick={() => put([...ways, { set: "", until: "" }])}>
            {tr("flow.addComingToRest")}
          </button>
        </div>
      )}
    </>
  );
}

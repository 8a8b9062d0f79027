// SPDX-License-Identifier: Apache-2.0

import { useEffect, useId, useState } from "react";
import { askUntilAnswered } from "../../control/asking";
import type { Names, PanelKind, Region } from "../../control/shapes";
import { tr } from "../../language/text";
import { useControl } from "../../shell/context";
import { KINDS, kindWord } from "./layout";
import { buttonsText, panelOf, valuesText, type WrittenPanel } from "./written";

/** Form for a panel's content, which suggests names in the system. */
export function PanelForm(props: { of: Region | null; done: (panel: Region) => void; cancel: () => void }) {
  const { of } = props;
  const names = useNames();
  const list = useId();
  const [kind, setKind] = useState<PanelKind>(of?.panel ?? "plot");
  const [written, setWritten] = useState<WrittenPanel>(() => ({
    title: of?.title ?? "",
    names: (of?.names ?? []).join("\n"),
    seconds: String(of?.seconds ?? 10),
    values: valuesText(of?.values ?? []),
    device: of?.device ?? "",
    verb: of?.verb ?? "",
    buttons: buttonsText(of?.buttons ?? []),
  }));
  const [wrong, setWrong] = useState<string | null>(null);
  const write = (change: Partial<WrittenPanel>) => setWritten({ ...written, ...change });
  const offered = { plot: names?.svvs, values: names?.svvs, scene: names?.devices, verb: names?.verbs, buttons: names?.instances };
  const choices = kind === "alarms" ? [] : (offered[kind] ?? []);
  const add = (name: string) => {
    if (kind === "plot") write({ names: `${written.names}\n${name}`.trim() });
    else if (kind === "values") write({ values: `${written.values}\n${name}`.trim() });
    else if (kind === "buttons") write({ buttons: `${written.buttons}\n${name}: ${name}`.trim() });
    else if (kind === "scene") write({ device: name });
    else write({ verb: name });
  };
  return (
    <form
      className="panel panel-form"
      aria-label={of ? tr("workspaces.editPanel") : tr("workspaces.newPanel")}
      onSubmit={(event) => {
        event.preventDefault();
        const read = panelOf(kind, written, of);
        if (typeof read === "string") setWrong(read);
        else props.done(read);
      }}
    >
      <label>
        {tr("workspaces.shows")}{" "}
        <select value={kind} onChange={(event) => setKind(event.target.value as PanelKind)}>
          {KINDS.map((one) => (
            <option key={one} value={one}>
              {kindWord(one)}
            </option>
          ))}
        </select>
      </label>
      <label>
        {tr("workspaces.heading")}{" "}
        <input value={written.title} maxLength={100} onChange={(event) => write({ title: event.target.value })} />
      </label>
      {kind === "plot" && (
        <>
          <Area label={tr("workspaces.sVVsOnePerLine")} value={written.names} write={(text) => write({ names: text })} />
          <label>
            {tr("workspaces.seconds")}{" "}
            <input size={5} value={written.seconds} onChange={(event) => write({ seconds: event.target.value })} />
          </label>
        </>
      )}
      {kind === "values" && (
        <Area label={tr("workspaces.sVVsOnePerLineNAMELabel")} value={written.values} write={(text) => write({ values: text })} />
      )}
      {kind === "buttons" && (
        <Area label={tr("workspaces.buttonsOnePerLineLabelINSTANCE")} value={written.buttons} write={(text) => write({ buttons: text })} />
      )}
      {kind === "scene" && (
        <label>
          {tr("workspaces.physicalDevice")}{" "}
          <input list={list} value={written.device} onChange={(event) => write({ device: event.target.value })} />
        </label>
      )}
      {kind === "verb" && (
        <label>
          {tr("workspaces.verb")} <input list={list} value={written.verb} onChange={(event) => write({ verb: event.target.value })} />
        </label>
      )}
      <datalist id={list}>
        {choices.map((name) => (
          <option key={name} value={name} />
        ))}
      </datalist>
      {choices.length > 0 && (
        <select aria-label={tr("workspaces.existingNames")} value="" onChange={(event) => event.target.value && add(event.target.value)}>
          <option value="">{tr("workspaces.choose")}</option>
          {choices.map((name) => (
            <option key={name}>{name}</option>
          ))}
        </select>
      )}
      {wrong && (
        <p className="wrong" role="alert">
          {wrong}
        </p>
      )}
      <div className="row">
        <button type="submit" className="primary">
          {of ? tr("workspaces.changePanel") : tr("workspaces.add")}
        </button>
        <button type="button" onClick={props.cancel}>
          {tr("workspaces.cancel")}
        </button>
      </div>
    </form>
  );
}

function Area(props: { label: string; value: string; write: (text: string) => void }) {
  return (
    <label className="area">
      {props.label}
      <textarea rows={4} value={props.value} spellCheck={false} onChange={(event) => props.write(event.target.value)} />
    </label>
  );
}

function useNames(): Names | null {
  const control = useControl();
  const [names, setNames] = useState<Names | null>(null);
  useEffect(() => {
    // Without suggestions, names are typed.
    return askUntilAnswered(control, { ask: (signal) => control.look("names", {}, signal), take: setNames });
  }, [control]);
  return names;
}

// SPDX-License-Identifier: Apache-2.0
import { useEffect, useId, useState } from "react";
import type { Names, PanelKind, Region } from "../../control/shapes";
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
      aria-label={of ? "Edit panel" : "New panel"}
      onSubmit={(event) => {
        event.preventDefault();
        const read = panelOf(kind, written, of);
        if (typeof read === "string") setWrong(read);
        else props.done(read);
      }}
    >
      <label>
        Shows{" "}
        <select value={kind} onChange={(event) => setKind(event.target.value as PanelKind)}>
          {KINDS.map((one) => (
            <option key={one} value={one}>
              {kindWord(one)}
            </option>
          ))}
        </select>
      </label>
      <label>
        Heading <input value={written.title} maxLength={100} onChange={(event) => write({ title: event.target.value })} />
      </label>
      {kind === "plot" && (
        <>
          <Area label="SVVs, one per line" value={written.names} write={(text) => write({ names: text })} />
          <label>
            Seconds <input size={5} value={written.seconds} onChange={(event) => write({ seconds: event.target.value })} />
          </label>
        </>
      )}
      {kind === "values" && (
        <Area
          label="SVVs, one per line: NAME | label | minimum | maximum"
          value={written.values}
          write={(text) => write({ values: text })}
        />
      )}
      {kind === "buttons" && (
        <Area
          label={'Buttons, one per line: label: INSTANCE {"input": value}'}
          value={written.buttons}
          write={(text) => write({ buttons: text })}
        />
      )}
      {kind === "scene" && (
        <label>
          Physical device <input list={list} value={written.device} onChange={(event) => write({ device: event.target.value })} />
        </label>
      )}
      {kind === "verb" && (
        <label>
          Verb <input list={list} value={written.verb} onChange={(event) => write({ verb: event.target.value })} />
        </label>
      )}
      <datalist id={list}>
        {choices.map((name) => (
          <option key={name} value={name} />
        ))}
      </datalist>
      {choices.length > 0 && (
        <select aria-label="Existing names" value="" onChange={(event) => event.target.value && add(event.target.value)}>
          <option value="">Choose…</option>
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
          {of ? "Change panel" : "Add"}
        </button>
        <button type="button" onClick={props.cancel}>
          Cancel
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
    let over = false;
    // Without suggestions, names are typed.
    control.look("names", {}).then(
      (found) => over || setNames(found),
      () => undefined,
    );
    return () => {
      over = true;
    };
  }, [control]);
  return names;
}

// SPDX-License-Identifier: Apache-2.0

import { type KeyboardEvent, useEffect, useId, useMemo, useRef, useState } from "react";
import { askUntilAnswered } from "../../control/asking";
import { type Refusal, refusalsOf } from "../../control/refusals";
import { found } from "../../design/fuzzy";
import { Refusals } from "../../design/parts";
import { tr } from "../../language/text";
import { useConfiguration } from "../../shell/configuration";
import { useControl, useTopic, useWatched } from "../../shell/context";
import { asDeclared, grouped, inside, NO_DEVICE } from "./groups";
import type { Scope } from "./scope";
import { withChannel } from "./setup";

/** Maximum number of names in the list; others are found by typing. */
const SHOWN_MAX = 120;

interface Choice {
  names: string[];
  groupOf: Map<string, string>;
  devices: ReadonlySet<string>;
  trouble: Refusal[];
}

/** Field for finding values to show: SVVs by device, private cells by instance. `/` focuses the field, Enter takes the first match. */
export function Picker(props: { scope: Scope }) {
  const { scope } = props;
  const setup = useWatched(scope.setup);
  const { names, groupOf, devices, trouble } = useChoice();
  const [typed, setTyped] = useState("");
  const [at, setAt] = useState(0);
  const field = useRef<HTMLInputElement>(null);
  const list = useId();
  const hits = useMemo(() => found(typed, names, SHOWN_MAX), [typed, names]);
  const groups = useMemo(() => grouped(hits, groupOf, typed !== "", devices), [hits, groupOf, typed, devices]);
  const order = groups.flatMap((group) => group.names);
  const chosen = new Set(setup.traces.map((trace) => trace.channel));
  const toggle = (name: string) => {
    scope.change((before) =>
      chosen.has(name) ? { ...before, traces: before.traces.filter((trace) => trace.channel !== name) } : withChannel(before, name),
    );
  };
  useSlash(field);
  const press = (event: KeyboardEvent) => {
    if (event.key === "ArrowDown" || event.key === "ArrowUp") {
      event.preventDefault();
      setAt((now) => Math.min(order.length - 1, Math.max(0, now + (event.key === "ArrowDown" ? 1 : -1))));
    } else if (event.key === "Enter") {
      const name = order[at];
      if (name !== undefined) toggle(name);
      setTyped("");
      setAt(0);
    } else if (event.key === "Escape") {
      setTyped("");
      setAt(0);
      field.current?.blur();
    }
  };
  const shown = order[at];
  useEffect(() => {
    if (shown !== undefined) document.getElementById(`${list}-${shown}`)?.scrollIntoView({ block: "nearest" });
  }, [list, shown]);
  return (
    <div className="picker">
      <input
        ref={field}
        className="find"
        type="search"
        role="combobox"
        aria-label={tr("scope.valuesToPlot")}
        aria-expanded="true"
        aria-controls={list}
        aria-activedescendant={typed && shown !== undefined ? `${list}-${shown}` : undefined}
        aria-autocomplete="list"
        placeholder={tr("scope.findAValue")}
        value={typed}
        onChange={(event) => {
          setTyped(event.target.value);
          setAt(0);
        }}
        onKeyDown={press}
      />
      <Refusals of={trouble} />
      <div id={list} className="choices" role="listbox" aria-label={tr("scope.values")} aria-multiselectable="true" tabIndex={-1}>
        {groups.map((group) => (
          <div key={group.title} role="group" aria-label={group.title}>
            <div className="group-title quiet small" aria-hidden="true">
              {group.title}
            </div>
            {group.names.map((name) => (
              // biome-ignore lint/a11y/useKeyWithClickEvents: the field that controls the list takes the keys
              <div
                key={name}
                id={`${list}-${name}`}
                className={`choice ${typed && name === shown ? "at" : ""}`}
                role="option"
                aria-selected={chosen.has(name)}
                tabIndex={-1}
                title={name}
                onClick={() => toggle(name)}
              >
                {shortOf(name, group.title)}
              </div>
            ))}
          </div>
        ))}
        {order.length === 0 && (
          // biome-ignore lint/a11y/useFocusableInteractive: it cannot be chosen
          <div className="choice quiet" role="option" aria-disabled="true" aria-selected="false">
            {names.length === 0 ? tr("scope.theSystemHasNoSVVsYet") : tr("scope.noMatchForTyped", { typed })}
          </div>
        )}
      </div>
    </div>
  );
}

function useChoice(): Choice {
  const control = useControl();
  const installed = useTopic(control.topics.installed);
  const configuration = useConfiguration();
  const [choice, setChoice] = useState<Choice>({ names: [], groupOf: new Map(), devices: new Set(), trouble: [] });
  // After an installation, there may be further values.
  useEffect(() => {
    return askUntilAnswered(control, {
      ask: (signal) => control.look("names", {}, signal),
      take: (names) => {
        const groupOf = new Map<string, string>();
        for (const svv of asDeclared(names.svvs, configuration)) groupOf.set(svv, deviceOf(svv, names.logical_devices));
        for (const instance of installed?.instances ?? []) {
          for (const cell of instance.cells) if (cell.kind === "private") groupOf.set(cell.name, inside(instance.name));
        }
        setChoice({ names: [...groupOf.keys()], groupOf, devices: new Set(names.logical_devices), trouble: [] });
      },
      failed: (why) => setChoice((before) => ({ ...before, trouble: refusalsOf(why) })),
    });
  }, [control, installed, configuration]);
  return choice;
}

function deviceOf(svv: string, devices: readonly string[]): string {
  return devices.filter((device) => svv.startsWith(`${device}.`)).sort((a, b) => b.length - a.length)[0] ?? prefixOf(svv);
}

function prefixOf(svv: string): string {
  return svv.includes(".") ? svv.slice(0, svv.lastIndexOf(".")) : NO_DEVICE;
}

function shortOf(name: string, group: string): string {
  if (name.startsWith(`${group}.`)) return name.slice(group.length + 1);
  const instance = group.slice(inside("").length);
  return name.startsWith(`${instance}:`) ? name.slice(instance.length + 1) : name;
}

/** Focuses the field on `/`, from anywhere on the page. */
function useSlash(field: { current: HTMLInputElement | null }): void {
  useEffect(() => {
    const press = (event: globalThis.KeyboardEvent) => {
      const typing = event.target instanceof HTMLElement && event.target.closest("input, select, textarea");
      if (event.key !== "/" || typing || event.ctrlKey || event.metaKey) return;
      event.preventDefault();
      field.current?.focus();
    };
    window.addEventListener("keydown", press);
    return () => window.removeEventListener("keydown", press);
  }, [field]);
}

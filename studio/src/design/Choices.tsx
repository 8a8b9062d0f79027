// SPDX-License-Identifier: Apache-2.0

import { type KeyboardEvent, useEffect, useId, useMemo, useRef, useState } from "react";
import { tr } from "../language/text";
import { score } from "./fuzzy";

export interface Choice {
  key: string;
  text: string;
  /** Short description, which is also searched. */
  about: string;
}

/** Maximum number of rows shown; further ones are found by typing. */
const SHOWN_MAX = 60;

/** A search field with its matches, best first. Arrow keys move, Enter or a click selects, Escape closes. */
export function Choices(props: { label: string; choices: Choice[]; empty: string; take: (choice: Choice) => void; close: () => void }) {
  const { choices, take, close } = props;
  const [typed, setTyped] = useState("");
  const [at, setAt] = useState(0);
  const list = useId();
  const field = useRef<HTMLInputElement>(null);
  const hits = useMemo(() => foundChoices(typed, choices).slice(0, SHOWN_MAX), [typed, choices]);
  useEffect(() => {
    field.current?.focus({ preventScroll: true });
  }, []);
  useEffect(() => {
    // A promise that it may return must not become the cleanup of the effect.
    document.getElementById(`${list}-${at}`)?.scrollIntoView({ block: "nearest" });
  }, [list, at]);
  const press = (event: KeyboardEvent) => {
    if (event.key === "ArrowDown" || event.key === "ArrowUp") {
      event.preventDefault();
      setAt((now) => Math.max(0, Math.min(hits.length - 1, now + (event.key === "ArrowDown" ? 1 : -1))));
    } else if (event.key === "Enter") {
      event.preventDefault();
      const hit = hits[at];
      if (hit) take(hit);
    } else if (event.key === "Escape") {
      event.stopPropagation();
      close();
    }
  };
  return (
    <div className="choices-field">
      <input
        ref={field}
        type="search"
        role="combobox"
        aria-label={props.label}
        aria-expanded="true"
        aria-controls={list}
        aria-activedescendant={hits[at] ? `${list}-${at}` : undefined}
        aria-autocomplete="list"
        placeholder={props.label}
        value={typed}
        onChange={(event) => {
          setTyped(event.target.value);
          setAt(0);
        }}
        onKeyDown={press}
      />
      <div id={list} className="choices" role="listbox" aria-label={props.label} tabIndex={-1}>
        {hits.map((hit, row) => (
          // biome-ignore lint/a11y/useKeyWithClickEvents: the field that controls the list takes the keys
          <div
            key={hit.key}
            id={`${list}-${row}`}
            className={`choice ${row === at ? "at" : ""}`}
            role="option"
            aria-selected={row === at}
            tabIndex={-1}
            onClick={() => take(hit)}
          >
            {hit.text} <span className="quiet">{hit.about}</span>
          </div>
        ))}
        {hits.length === 0 && (
          // biome-ignore lint/a11y/useFocusableInteractive: it cannot be chosen
          <div className="choice quiet" role="option" aria-disabled="true" aria-selected="false">
            {typed === "" ? props.empty : tr("design.noMatchForTyped", { typed })}
          </div>
        )}
      </div>
    </div>
  );
}

/** Returns the choices that match `typed`, best first; if nothing is typed, all choices in their original order. */
export function foundChoices(typed: string, choices: readonly Choice[]): Choice[] {
  if (typed.trim() === "") return [...choices];
  const scored = choices.flatMap((choice) => {
    // A match of the name ranks above one of the description.
    const [own, beside] = [score(typed, choice.text), score(typed, `${choice.text} ${choice.about}`)];
    return own === null && beside === null ? [] : [{ choice, score: own ?? (beside ?? 0) - 1000 }];
  });
  return scored.sort((one, other) => other.score - one.score).map(({ choice }) => choice);
}

// SPDX-License-Identifier: Apache-2.0
// List of the page's keys; `?` opens it in every view.
import { useEffect, useRef } from "react";

const KEYS: [string, [string, string][]][] = [
  [
    "Everywhere",
    [
      ["?", "this list"],
      ["Tab", "to the next control; the first control skips to the view"],
      ["Esc", "closes this list"],
    ],
  ],
  ["Devices", [["Space, held", "jogs the joint whose + or − has the focus, until it is released"]]],
  [
    "Data flow",
    [
      ["/ or Ctrl+F", "find a block, a port, an SVV"],
      ["Enter", "selects, or opens the selected graph"],
      ["Ctrl+Z, Ctrl+Y", "undo, redo"],
      ["Ctrl+C, Ctrl+X, Ctrl+V", "copy, cut, paste"],
      ["Delete", "removes the selection"],
    ],
  ],
  [
    "Scope",
    [
      ["/", "search for a value"],
      ["← →, + −", "move, and zoom"],
      ["Home", "fits the view to the data"],
    ],
  ],
];

/** Button and list of the keyboard shortcuts; `?` also opens the list. */
export function Keys() {
  const list = useRef<HTMLDialogElement>(null);
  useEffect(() => {
    const press = (event: KeyboardEvent) => {
      if (event.key !== "?" || isWritten(event.target) || list.current?.open) return;
      event.preventDefault();
      list.current?.showModal();
    };
    window.addEventListener("keydown", press);
    return () => window.removeEventListener("keydown", press);
  }, []);
  return (
    <>
      <button type="button" className="plain keys-button" aria-haspopup="dialog" onClick={() => list.current?.showModal()}>
        Keys <kbd>?</kbd>
      </button>
      <dialog ref={list} className="keys" aria-label="Keys">
        {KEYS.map(([where, keys]) => (
          <section key={where}>
            <h2>{where}</h2>
            <dl>
              {keys.map(([key, does]) => (
                <div key={key}>
                  <dt>
                    <kbd>{key}</kbd>
                  </dt>
                  <dd>{does}</dd>
                </div>
              ))}
            </dl>
          </section>
        ))}
        <form method="dialog">
          <button type="submit">Close</button>
        </form>
      </dialog>
    </>
  );
}

/** Returns whether the target accepts keys as text input. */
function isWritten(target: EventTarget | null): boolean {
  return target instanceof HTMLElement && (target.isContentEditable || /^(INPUT|TEXTAREA|SELECT)$/.test(target.tagName));
}

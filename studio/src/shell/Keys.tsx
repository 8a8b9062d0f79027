// SPDX-License-Identifier: Apache-2.0
// List of the page's keys; `?` opens it in every view.

import { useEffect, useRef } from "react";
import { trNodes } from "../language/nodes";
import { tr } from "../language/text";

const KEYS: [string, [string, string][]][] = [
  [
    tr("shell.everywhere"),
    [
      ["?", tr("shell.thisList")],
      [tr("shell.tab"), tr("shell.toTheNextControlTheFirst")],
      [tr("shell.esc"), tr("shell.closesThisList")],
    ],
  ],
  [tr("shell.devices"), [[tr("shell.spaceHeld"), tr("shell.jogsTheJointWhoseOrHas")]]],
  [
    tr("shell.dataFlow"),
    [
      [tr("shell.orCtrlF"), tr("shell.findABlockAPortAn")],
      [tr("shell.enter"), tr("shell.selectsOrOpensTheSelectedGraph")],
      [tr("shell.ctrlZCtrlY"), tr("shell.undoRedo")],
      [tr("shell.ctrlCCtrlXCtrlV"), tr("shell.copyCutPaste")],
      [tr("shell.delete"), tr("shell.removesTheSelection")],
    ],
  ],
  [
    tr("shell.scope"),
    [
      ["/", tr("shell.searchForAValue")],
      ["← →, + −", tr("shell.moveAndZoom")],
      [tr("shell.home"), tr("shell.fitsTheViewToTheData")],
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
        {trNodes("shell.keysKbd", { kbd: <kbd>?</kbd> })}
      </button>
      <dialog ref={list} className="keys" aria-label={tr("shell.keys")}>
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
          <button type="submit">{tr("shell.close")}</button>
        </form>
      </dialog>
    </>
  );
}

/** Returns whether the target accepts keys as text input. */
function isWritten(target: EventTarget | null): boolean {
  return target instanceof HTMLElement && (target.isContentEditable || /^(INPUT|TEXTAREA|SELECT)$/.test(target.tagName));
}

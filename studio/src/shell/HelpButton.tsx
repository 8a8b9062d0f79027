// SPDX-License-Identifier: Apache-2.0

import { lazy, Suspense, useEffect, useRef, useState } from "react";
import { tr } from "../language/text";
import type { View } from "./views";

// The docs are loaded on first use.
const Help = lazy(() => import("../help/Help"));

/** Button that opens the docs of the current view next to it. */
export function HelpButton(props: { view: View | undefined }) {
  const { view } = props;
  const page = useRef<HTMLDialogElement>(null);
  const [isOpen, setOpen] = useState(false);
  // Other views have other docs.
  useEffect(() => {
    if (view) page.current?.close();
  }, [view]);
  if (!view) return null;
  return (
    <>
      <button
        type="button"
        className="plain"
        aria-haspopup="dialog"
        onClick={() => {
          setOpen(true);
          page.current?.showModal();
        }}
      >
        {tr("shell.help")}
      </button>
      <dialog ref={page} className="help" aria-label={tr("shell.helpTitle", { title: view.title })} onClose={() => setOpen(false)}>
        <header>
          <h2>{view.title}</h2>
          <form method="dialog">
            <button type="submit">{tr("shell.close")}</button>
          </form>
        </header>
        {isOpen && (
          <Suspense fallback={<p className="quiet wait">{tr("shell.loading")}</p>}>
            <Help view={view.name} />
          </Suspense>
        )}
      </dialog>
    </>
  );
}

// SPDX-License-Identifier: Apache-2.0

import { Component, type ReactNode, useEffect, useRef } from "react";
import { refusalsOf } from "../control/refusals";
import { Refusals } from "../design/parts";
import { tr } from "../language/text";
import { useLive, useWatched } from "./context";
import { reload } from "./cutOff";

/** Messages of browsers, and of the loader, about a part of the page that could not be fetched. */
const UNFETCHED = /dynamically imported module|preload CSS|Importing a module script failed/i;

/** Shows the error of a failed view in place of the view, so that the rest of the page keeps working. */
export class Boundary extends Component<{ children: ReactNode }, { failure: unknown }> {
  override state: { failure: unknown } = { failure: null };

  static getDerivedStateFromError(failure: unknown) {
    return { failure };
  }

  override render() {
    const { failure } = this.state;
    if (failure === null) return this.props.children;
    if (failure instanceof Error && UNFETCHED.test(failure.message)) return <Unfetched />;
    return (
      <div className="stack">
        <p>{tr("shell.thisViewHasFailedTheSystem")}</p>
        <Refusals of={refusalsOf(failure)} />
        <div className="row">
          <button type="button" onClick={() => this.setState({ failure: null })}>
            {tr("shell.tryAgain")}
          </button>
        </div>
      </div>
    );
  }
}

/**
 * Message about a view that could not be fetched. A browser does not fetch a failed part of a page again: the page is loaded again when a
 * lost connection returns; with a connection, the user is asked to load it.
 */
function Unfetched() {
  const connection = useWatched(useLive().stream.connection);
  const wasLost = useRef(false);
  useEffect(() => {
    if (connection !== "open") wasLost.current = true;
    else if (wasLost.current) reload();
  }, [connection]);
  return (
    <div className="stack">
      <p>{tr(connection === "open" ? "shell.thisViewCouldNotBeLoadedLoad" : "shell.thisViewCouldNotBeLoaded")}</p>
      <div className="row">
        <button type="button" onClick={reload}>
          {tr("shell.loadThePageAgain")}
        </button>
      </div>
    </div>
  );
}

// SPDX-License-Identifier: Apache-2.0

import { Component, type ReactNode } from "react";
import { refusalsOf } from "../control/refusals";
import { Refusals } from "../design/parts";
import { tr } from "../language/text";

/** Shows the error of a failed view in place of the view, so that the rest of the page keeps working. */
export class Boundary extends Component<{ children: ReactNode }, { failure: unknown }> {
  override state: { failure: unknown } = { failure: null };

  static getDerivedStateFromError(failure: unknown) {
    return { failure };
  }

  override render() {
    if (this.state.failure === null) return this.props.children;
    return (
      <div className="stack">
        <p>{tr("shell.thisViewHasFailedTheSystem")}</p>
        <Refusals of={refusalsOf(this.state.failure)} />
        <div className="row">
          <button type="button" onClick={() => this.setState({ failure: null })}>
            {tr("shell.tryAgain")}
          </button>
        </div>
      </div>
    );
  }
}

// SPDX-License-Identifier: Apache-2.0

import { Component, type ReactNode, useState } from "react";
import { refusalsOf } from "../../../control/refusals";
import { Refusals } from "../../../design/parts";
import { tr } from "../../../language/text";
import { download } from "./file";
import { forgetKept, forgetUnread, keptText, unreadText } from "./history";

/** Error boundary for a draft that cannot be shown: offers it as a file, and starts a new draft. */
export class DraftBoundary extends Component<{ children: ReactNode }, { failure: unknown }> {
  override state: { failure: unknown } = { failure: null };

  static getDerivedStateFromError(failure: unknown) {
    return { failure };
  }

  override render() {
    if (this.state.failure === null) return this.props.children;
    const text = keptText();
    return (
      <div className="stack" role="alert">
        <p>{tr("flow.thisDraftCannotBeDisplayedThe")}</p>
        <Refusals of={refusalsOf(this.state.failure)} />
        <div className="row">
          {text !== null && (
            <button type="button" onClick={() => download("draft.json", text)}>
              {tr("flow.saveTheDraftAsAFile")}
            </button>
          )}
          <button type="button" onClick={() => this.setState({ failure: null })}>
            {tr("flow.tryAgain")}
          </button>
          <button
            type="button"
            onClick={() => {
              forgetKept();
              this.setState({ failure: null });
            }}
          >
            {tr("flow.startOver")}
          </button>
        </div>
      </div>
    );
  }
}

/** Notice about a stored draft that could not be read. */
export function UnreadDraft() {
  const [text, setText] = useState(unreadText);
  if (text === null) return null;
  return (
    <div className="row" role="status">
      <span>{tr("flow.aStoredDraftCannotBeRead")}</span>
      <button type="button" onClick={() => download("draft.json", text)}>
        {tr("flow.saveItAsAFile")}
      </button>
      <button
        type="button"
        onClick={() => {
          forgetUnread();
          setText(null);
        }}
      >
        {tr("flow.dismiss")}
      </button>
    </div>
  );
}

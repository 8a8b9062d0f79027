// SPDX-License-Identifier: Apache-2.0
import { Component, type ReactNode, useState } from "react";
import { refusalsOf } from "../../../control/refusals";
import { Refusals } from "../../../design/parts";
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
        <p>This draft cannot be displayed. The system is not affected; save the draft before you start over.</p>
        <Refusals of={refusalsOf(this.state.failure)} />
        <div className="row">
          {text !== null && (
            <button type="button" onClick={() => download("draft.json", text)}>
              Save the draft as a file
            </button>
          )}
          <button type="button" onClick={() => this.setState({ failure: null })}>
            Try again
          </button>
          <button
            type="button"
            onClick={() => {
              forgetKept();
              this.setState({ failure: null });
            }}
          >
            Start over
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
      <span>A stored draft cannot be read by this page.</span>
      <button type="button" onClick={() => download("draft.json", text)}>
        Save it as a file
      </button>
      <button
        type="button"
        onClick={() => {
          forgetUnread();
          setText(null);
        }}
      >
        Dismiss
      </button>
    </div>
  );
}

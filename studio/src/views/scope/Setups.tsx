// SPDX-License-Identifier: Apache-2.0

import { useState } from "react";
import { Panel } from "../../design/parts";
import { tr } from "../../language/text";
import { useWatched } from "../../shell/context";
import { addressOf } from "../../shell/route";
import { forget, keepAs, named } from "./keeping";
import type { Scope } from "./scope";
import { EMPTY, toLink } from "./setup";

/** Named setups stored in this browser, and the current setup as a link. */
export function Setups(props: { scope: Scope }) {
  const { scope } = props;
  const setup = useWatched(scope.setup);
  const [setups, setSetups] = useState(named);
  const [name, setName] = useState("");
  const [said, setSaid] = useState("");
  const known = setups.has(name.trim());
  const copy = async () => {
    const address = `${window.location.origin}${window.location.pathname}${addressOf("scope", [], { setup: toLink(setup) })}`;
    try {
      await navigator.clipboard.writeText(address);
      setSaid(tr("scope.copiedWithoutTheToken"));
    } catch {
      window.location.hash = addressOf("scope", [], { setup: toLink(setup) });
      setSaid(tr("scope.theBrowserDoesNotAllowCopying"));
    }
  };
  return (
    <Panel
      title={tr("scope.setups")}
      end={
        <button type="button" onClick={() => void copy()}>
          {tr("scope.copyLink")}
        </button>
      }
    >
      <div className="stack tight">
        {said && (
          <p className="quiet small" role="status">
            {said}
          </p>
        )}
        <form
          className="row nowrap"
          onSubmit={(event) => {
            event.preventDefault();
            if (name.trim() === "") return;
            keepAs(name.trim(), setup);
            setSetups(named());
          }}
        >
          <input
            aria-label={tr("scope.nameOfTheSetup")}
            placeholder={tr("scope.name")}
            value={name}
            onChange={(event) => setName(event.target.value)}
          />
          <button type="submit" disabled={name.trim() === ""}>
            {known ? tr("scope.saveAgain") : tr("scope.save")}
          </button>
          <button type="button" title={tr("scope.removeAllTraces")} onClick={() => scope.change(EMPTY)}>
            {tr("scope.clear")}
          </button>
        </form>
        {[...setups].map(([one, of]) => (
          <div className="row nowrap" key={one}>
            <button
              type="button"
              className="plain setup-name"
              onClick={() => {
                scope.change(of);
                setName(one);
              }}
            >
              {one}
            </button>
            <button
              type="button"
              className="plain"
              onClick={() => {
                forget(one);
                setSetups(named());
              }}
            >
              {tr("scope.delete")}
              <span className="unseen"> {one}</span>
            </button>
          </div>
        ))}
      </div>
    </Panel>
  );
}

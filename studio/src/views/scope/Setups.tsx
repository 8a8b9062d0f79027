// SPDX-License-Identifier: Apache-2.0
import { useState } from "react";
import { Panel } from "../../design/parts";
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
      setSaid("copied, without the token");
    } catch {
      window.location.hash = addressOf("scope", [], { setup: toLink(setup) });
      setSaid("the browser does not allow copying; use the address of the page instead");
    }
  };
  return (
    <Panel
      title="Setups"
      end={
        <button type="button" onClick={() => void copy()}>
          Copy link
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
          <input aria-label="Name of the setup" placeholder="name" value={name} onChange={(event) => setName(event.target.value)} />
          <button type="submit" disabled={name.trim() === ""}>
            {known ? "Save again" : "Save"}
          </button>
          <button type="button" title="Remove all traces" onClick={() => scope.change(EMPTY)}>
            Clear
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
              Delete<span className="unseen"> {one}</span>
            </button>
          </div>
        ))}
      </div>
    </Panel>
  );
}

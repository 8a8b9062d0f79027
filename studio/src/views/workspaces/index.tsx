// SPDX-License-Identifier: Apache-2.0
import { useState } from "react";
import type { WorkspaceAbout } from "../../control/shapes";
import { Empty, Refusals, Tag } from "../../design/parts";
import { useLive } from "../../shell/context";
import { addressOf, useRoute } from "../../shell/route";
import { Import } from "./Import";
import { useWorkspaces } from "./kept";
import { Opened } from "./Opened";
import "./workspaces.css";

/** Workspaces view: layouts of panels that programs ship, and those that people compose and store in the system. */
export default function Workspaces() {
  const control = useLive();
  const { all, refusals, look } = useWorkspaces();
  const { path } = useRoute();
  const [name, setName] = useState("");
  if (!all) return refusals.length > 0 ? <Refusals of={refusals} /> : <p className="quiet wait">Waiting for the workspaces…</p>;
  const chosen = path[0] ?? null;
  const about = all.find((one) => one.name === chosen) ?? null;
  const taken = all.some((one) => one.name === name.trim());
  return (
    <div className="workspaces">
      <Refusals of={refusals} />
      <div className="row">
        <ul className="row workspace-list" aria-label="Workspaces of the system">
          {all.map((one) => (
            <li key={one.name}>
              <a
                className="button"
                href={addressOf("workspaces", [one.name])}
                title={one.doc}
                aria-current={one.name === chosen ? "page" : undefined}
              >
                {one.title || one.name}
                <Kind of={one} />
              </a>
            </li>
          ))}
        </ul>
        <form
          className="row"
          onSubmit={(event) => {
            event.preventDefault();
            window.location.hash = addressOf("workspaces", [name.trim()]);
            setName("");
          }}
        >
          <input
            aria-label="Name of a new workspace"
            placeholder="new workspace"
            maxLength={100}
            size={16}
            value={name}
            onChange={(event) => setName(event.target.value)}
          />
          <button type="submit" disabled={name.trim() === "" || taken}>
            Create
          </button>
        </form>
        <Import />
      </div>
      {chosen === null ? (
        <Empty title={all.length === 0 ? "No workspaces yet" : "Choose a workspace"}>
          A workspace is a layout of plots, values, machines, state diagrams, alarms and buttons. Create one here
          {control.may("operate") ? "" : " (saving it requires the role 'operate')"}, or ship one with a program:{" "}
          <code>cell.workspaces.ship("tank.workspace.json")</code>.
        </Empty>
      ) : (
        <Opened key={chosen} name={chosen} about={about} look={look} />
      )}
    </div>
  );
}

function Kind(props: { of: WorkspaceAbout }) {
  return (
    <>
      {props.of.operator && <Tag tone="accent">for operators</Tag>}
      {props.of.shipped && <Tag title="Shipped by a program: save it under another name to change it.">shipped</Tag>}
    </>
  );
}

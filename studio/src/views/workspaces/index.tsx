// SPDX-License-Identifier: Apache-2.0

import { useState } from "react";
import type { WorkspaceAbout } from "../../control/shapes";
import { Empty, Refusals, Tag } from "../../design/parts";
import { trNodes } from "../../language/nodes";
import { tr } from "../../language/text";
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
  if (!all)
    return refusals.length > 0 ? <Refusals of={refusals} /> : <p className="quiet wait">{tr("workspaces.waitingForTheWorkspaces")}</p>;
  const chosen = path[0] ?? null;
  const about = all.find((one) => one.name === chosen) ?? null;
  const taken = all.some((one) => one.name === name.trim());
  return (
    <div className="workspaces">
      <Refusals of={refusals} />
      <div className="row">
        <ul className="row workspace-list" aria-label={tr("workspaces.workspacesOfTheSystem")}>
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
            aria-label={tr("workspaces.nameOfANewWorkspace")}
            placeholder={tr("workspaces.newWorkspace")}
            maxLength={100}
            size={16}
            value={name}
            onChange={(event) => setName(event.target.value)}
          />
          <button type="submit" disabled={name.trim() === "" || taken}>
            {tr("workspaces.create")}
          </button>
        </form>
        <Import />
      </div>
      {chosen === null ? (
        <Empty title={all.length === 0 ? tr("workspaces.noWorkspacesYet") : tr("workspaces.chooseAWorkspace")}>
          {tr("workspaces.aWorkspaceIsALayoutOf")}
          {control.may("operate") ? "" : ` ${tr("workspaces.savingItRequiresTheRoleOperate")}`}
          {trNodes("workspaces.orShipOneWithAProgram", { code: <code>cell.workspaces.ship("tank.workspace.json")</code> })}
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
      {props.of.operator && <Tag tone="accent">{tr("workspaces.forOperators")}</Tag>}
      {props.of.shipped && <Tag title={tr("workspaces.shippedByAProgramSaveIt")}>{tr("workspaces.shipped")}</Tag>}
    </>
  );
}

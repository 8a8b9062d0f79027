// SPDX-License-Identifier: Apache-2.0

import { Empty, Refusals } from "../../design/parts";
import { tr } from "../../language/text";
import { addressOf, useRoute } from "../../shell/route";
import { Fixed } from "../workspaces/Fixed";
import { useFindings, useWorkspace, useWorkspaces } from "../workspaces/kept";
import "../workspaces/workspaces.css";
import { Recovery } from "./Recovery";
import "./panel.css";

/** A workspace as a panel for operators: enlarged, with only the top bar above it. */
export default function OperatorPanel() {
  const { all, refusals } = useWorkspaces();
  const { path } = useRoute();
  const name = path[0] ?? "";
  const about = all?.find((one) => one.name === name) ?? null;
  const { workspace, refusals: more } = useWorkspace(about);
  const findings = useFindings(workspace);
  if (!all) return refusals.length > 0 ? <Refusals of={refusals} /> : <p className="quiet wait">{tr("panel.loading")}</p>;
  if (!about) {
    return (
      <Empty title={tr("panel.workspaceNameDoesNotExist", { name })}>
        <a href={addressOf("workspaces")}>{tr("panel.allWorkspaces")}</a>
      </Empty>
    );
  }
  return (
    <div className="operator">
      <Refusals of={[...refusals, ...more, ...findings]} />
      <Recovery />
      {workspace && <Fixed layout={workspace.layout} workspace={name} />}
      <footer className="row">
        <span className="quiet">{workspace?.title || name}</span>
        <a className="button" href={addressOf("workspaces", [name])}>
          {tr("panel.closePanel")}
        </a>
      </footer>
    </div>
  );
}

// SPDX-License-Identifier: Apache-2.0
//! Workspaces.
use crate::sure;
use model::refusal::Refusal;
use model::workspace::Workspace;
use supervisor::WorkspaceAbout;

crate::calls! {
    /// Layouts of panels, for the studio.
    pub(super) const WORKSPACES about "workspaces" = [
        /// Enters a workspace that a program ships, in the place of the one that it shipped before under that name.
        Configure ship_workspace(whole workspace: Workspace) -> (): commands("name"), replaces(&["name"]), goes_with("withdraw_workspace", "name")
            => |system| system.ship_workspace(workspace);
        /// Removes a workspace that a program has shipped.
        Configure withdraw_workspace(must name: String) -> (): commands("name")
            => |system| system.withdraw_workspace(&name);
        /// Keeps a workspace for all who look at the system. One that a program has shipped is not replaced.
        Operate keep_workspace(whole workspace: Workspace) -> ():
            commands("name"), told, journalled, replaces(&["name"]), goes_with("forget_workspace", "name"), free
            => |system| system.keep_workspace(workspace);
        /// Removes a workspace that a person keeps.
        Operate forget_workspace(must name: String) -> (): commands("name"), told, journalled, free
            => |system| system.forget_workspace(&name);
        /// Returns the workspaces, each in one line.
        Observe workspaces() -> Vec<WorkspaceAbout>
            => |system| sure(system.workspaces());
        /// Returns a workspace.
        Observe workspace(must name: String) -> Workspace
            => |system| system.workspace(&name);
        /// Returns all that is wrong with a workspace here and now: its form, and what it names and is not there.
        Observe check_workspace(whole workspace: Workspace) -> Vec<Refusal>: costs
            => |system| sure(system.check_workspace(&workspace));
    ];
}

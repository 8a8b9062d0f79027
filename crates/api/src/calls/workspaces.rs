// SPDX-License-Identifier: Apache-2.0
//! Calls for workspaces.
use crate::sure;
use model::refusal::Refusal;
use model::workspace::Workspace;
use supervisor::WorkspaceAbout;

crate::calls! {
    /// Calls for workspaces, which are layouts of panels for the studio.
    pub(super) const WORKSPACES about "workspaces" = [
        /// Adds a workspace supplied by a program, replacing any supplied workspace with the same name.
        Configure ship_workspace(whole workspace: Workspace) -> (): commands("name"), replaces(&["name"]), goes_with("withdraw_workspace", "name")
            => |system| system.ship_workspace(workspace);
        /// Removes a workspace supplied by a program.
        Configure withdraw_workspace(must name: String) -> (): commands("name")
            => |system| system.withdraw_workspace(&name);
        /// Saves a workspace for all users of the system. Cannot replace one supplied by a program.
        Operate keep_workspace(whole workspace: Workspace) -> ():
            commands("name"), told, journalled, replaces(&["name"]), goes_with("forget_workspace", "name"), free
            => |system| system.keep_workspace(workspace);
        /// Removes a workspace saved by a person.
        Operate forget_workspace(must name: String) -> (): commands("name"), told, journalled, free
            => |system| system.forget_workspace(&name);
        /// Returns one-line summaries of the workspaces.
        Observe workspaces() -> Vec<WorkspaceAbout>
            => |system| sure(system.workspaces());
        /// Returns the workspace with this name.
        Observe workspace(must name: String) -> Workspace
            => |system| system.workspace(&name);
        /// Returns all mistakes of a workspace in the current system: those in its structure, and references to missing items.
        Observe check_workspace(whole workspace: Workspace) -> Vec<Refusal>: costs
            => |system| sure(system.check_workspace(&workspace));
    ];
}

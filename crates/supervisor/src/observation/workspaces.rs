// SPDX-License-Identifier: Apache-2.0
//! Workspaces of a system: those supplied by programs, and those saved by people. Neither kind can replace the other.
use crate::refuse::{refuse, unknown};
use indexmap::IndexMap;
use model::refusal::{Class, Refusals};
use model::workspace::Workspace;
use serde::Serialize;

/// Maximum number of workspaces in a system.
pub const WORKSPACES_MAX: usize = 64;

/// A one-line summary of a workspace.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct WorkspaceAbout {
    pub name: String,
    pub title: String,
    pub doc: String,
    /// True if the workspace is for operators.
    pub operator: bool,
    /// True if a program has supplied the workspace; people cannot change such a workspace.
    pub shipped: bool,
    /// Revision number; every change assigns a new one.
    pub revision: u64,
}

struct KeptWorkspace {
    workspace: Workspace,
    shipped: bool,
    revision: u64,
}

/// Workspaces by name.
#[derive(Default)]
pub(crate) struct Workspaces {
    by_name: IndexMap<String, KeptWorkspace>,
    last: u64,
}

impl Workspaces {
    /// Adds a workspace, replacing any workspace with the same name. Fails if the name belongs to a workspace of the other kind, or if
    /// there are too many.
    pub fn enter(&mut self, workspace: Workspace, shipped: bool) -> Result<(), Refusals> {
        let name = &workspace.name;
        match self.by_name.get(name) {
            Some(kept) if kept.shipped && !shipped => {
                return Err(refuse(Class::InUse, format!("workspace '{name}' was shipped by a program"), "save this one under another name"));
            }
            Some(kept) if shipped && !kept.shipped => {
                return Err(refuse(Class::InUse, format!("workspace '{name}' was saved by a user"), "ship it under another name, or remove that one"));
            }
            None if self.by_name.len() == WORKSPACES_MAX => {
                return Err(refuse(Class::LimitExceeded, format!("there are already {WORKSPACES_MAX} workspaces"), "remove one"));
            }
            _ => {}
        }
        self.last += 1;
        self.by_name.insert(name.clone(), KeptWorkspace { workspace, shipped, revision: self.last });
        Ok(())
    }

    /// Removes a workspace of this kind. Fails if it does not exist or is of the other kind.
    pub fn remove(&mut self, name: &str, shipped: bool) -> Result<(), Refusals> {
        if self.known(name)?.shipped != shipped {
            let (is, remedy) = if shipped {
                ("was saved by a user", "remove it with forget_workspace")
            } else {
                ("was shipped by a program", "withdraw it in the program that shipped it")
            };
            return Err(refuse(Class::InUse, format!("workspace '{name}' {is}"), remedy));
        }
        self.by_name.shift_remove(name);
        Ok(())
    }

    pub fn get(&self, name: &str) -> Result<&Workspace, Refusals> {
        Ok(&self.known(name)?.workspace)
    }

    pub fn list(&self) -> Vec<WorkspaceAbout> {
        let about = |kept: &KeptWorkspace| WorkspaceAbout {
            name: kept.workspace.name.clone(),
            title: kept.workspace.title.clone(),
            doc: kept.workspace.doc.clone(),
            operator: kept.workspace.operator,
            shipped: kept.shipped,
            revision: kept.revision,
        };
        self.by_name.values().map(about).collect()
    }

    fn known(&self, name: &str) -> Result<&KeptWorkspace, Refusals> {
        self.by_name.get(name).ok_or_else(|| unknown("workspace", name, self.by_name.keys().map(String::as_str)))
    }
}

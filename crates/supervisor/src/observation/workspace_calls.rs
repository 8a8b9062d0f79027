// SPDX-License-Identifier: Apache-2.0
//! Workspace calls: they store workspaces, and check that the items to which these refer exist.
use crate::observation::workspaces::WorkspaceAbout;
use crate::refuse::unknown;
use crate::system::System;
use model::definition::Application;
use model::refusal::{Refusal, Refusals};
use model::workspace::{Button, PanelKind, Region, Workspace, check_workspace};

impl System {
    /// Adds a workspace supplied by a program. The items to which it refers need not exist; [`System::check_workspace`] reports missing
    /// ones.
    pub fn ship_workspace(&self, workspace: Workspace) -> Result<(), Refusals> {
        self.enter_workspace(workspace, true)
    }

    /// Adds a workspace saved by a person.
    pub fn keep_workspace(&self, workspace: Workspace) -> Result<(), Refusals> {
        self.enter_workspace(workspace, false)
    }

    fn enter_workspace(&self, workspace: Workspace, shipped: bool) -> Result<(), Refusals> {
        let wrong = check_workspace(&workspace);
        if !wrong.is_empty() {
            return Err(wrong);
        }
        self.shared.command(|core| core.observation.workspaces.enter(workspace, shipped))
    }

    /// Removes a workspace supplied by a program.
    pub fn withdraw_workspace(&self, name: &str) -> Result<(), Refusals> {
        self.shared.command(|core| core.observation.workspaces.remove(name, true))
    }

    /// Removes a workspace saved by a person.
    pub fn forget_workspace(&self, name: &str) -> Result<(), Refusals> {
        self.shared.command(|core| core.observation.workspaces.remove(name, false))
    }

    /// Returns one-line summaries of the workspaces.
    pub fn workspaces(&self) -> Vec<WorkspaceAbout> {
        self.shared.locked().observation.workspaces.list()
    }

    /// Returns the workspace with this name.
    pub fn workspace(&self, name: &str) -> Result<Workspace, Refusals> {
        self.shared.locked().observation.workspaces.get(name).cloned()
    }

    /// Returns all mistakes of a workspace in the current system: those in its structure, and references to missing items.
    pub fn check_workspace(&self, workspace: &Workspace) -> Refusals {
        let mut found = check_workspace(workspace);
        if found.is_empty() {
            workspace.layout.panels(&mut |region, kind| {
                let at = format!("workspace '{}', {}", workspace.name, region.called());
                found.extend(self.check_panel(region, kind).into_iter().map(|refusal| told_of(&at, refusal)));
            });
        }
        found
    }

    fn check_panel(&self, of: &Region, kind: PanelKind) -> Refusals {
        let mut found = Vec::new();
        let names = of.names.iter().chain(of.values.iter().map(|value| &value.name));
        found.extend(names.filter_map(|name| self.svv_about(name).err()).flatten());
        if let (PanelKind::Scene, Some(device)) = (kind, &of.device) {
            let core = self.shared.locked();
            if !core.registry.physical.contains_key(device) {
                found.extend(unknown("physical device", device, core.registry.physical.keys().map(String::as_str)));
            }
        }
        found.extend(of.verb.iter().filter_map(|verb| self.verb_form(verb).err()).flatten());
        for button in &of.buttons {
            let at = format!("button '{}'", button.label);
            found.extend(self.check_button(button).into_iter().map(|refusal| told_of(&at, refusal)));
        }
        found
    }

    /// Checks that the action of a button could be started, as far as its names, types, units and ranges show this.
    fn check_button(&self, button: &Button) -> Refusals {
        if let Some(application) = &button.start {
            let checked = self.check(application).err().unwrap_or_default();
            return if checked.is_empty() { self.check_values(application) } else { checked };
        }
        let Some(name) = &button.instance else { return Vec::new() };
        let verb = {
            let core = self.shared.locked();
            match core.instances.values().find(|instance| instance.name == *name) {
                Some(instance) => instance.plan.verb.clone(),
                None => return unknown("verb instance", name, core.instances.values().map(|instance| instance.name.as_str())),
            }
        };
        self.check_values(&Application { verb, values: button.values.clone(), ..Application::default() })
    }

    /// Checks the values of a start: each must be an input of the verb, and all required inputs must be present.
    fn check_values(&self, application: &Application) -> Refusals {
        let form = match self.verb_form(&application.verb) {
            Ok(form) => form,
            Err(refusals) => return refusals,
        };
        let known = || form.inputs.iter().map(|input| input.name.as_str());
        let strange = application.values.keys().filter(|name| !known().any(|input| input == *name));
        let mut found: Refusals = strange.flat_map(|name| unknown(&format!("input parameter of verb '{}'", form.name), name, known())).collect();
        for input in form.inputs.iter().filter(|input| input.required && !application.values.contains_key(&input.name)) {
            let message = format!("input parameter '{}' of verb '{}' has no value", input.name, form.name);
            found.push(Refusal::new(model::refusal::Class::DefinitionError, message).remedy("give it one in 'values'"));
        }
        found
    }
}

/// Returns a refusal with its subject as a prefix.
fn told_of(at: &str, mut refusal: Refusal) -> Refusal {
    refusal.message = format!("{at}: {}", refusal.message);
    refusal
}

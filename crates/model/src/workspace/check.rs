// SPDX-License-Identifier: Apache-2.0
//! Checks of a workspace that do not depend on a system.
use super::{Button, PanelKind, Region, ShownValue, Workspace};
use crate::refusal::{Class, Refusal, Refusals};
use std::collections::HashSet;

/// Maximum number of panels in a workspace.
pub const PANELS_MAX: usize = 64;
/// Maximum number of plots in a workspace. Limited because its page needs one subscription for each.
pub const PLOTS_MAX: usize = 16;
/// Maximum nesting depth of rows and columns.
pub const DEPTH_MAX: usize = 8;
/// Maximum number of names in a plot, and of values in a table.
pub const NAMES_MAX: usize = 64;
/// Maximum number of buttons in a panel.
pub const BUTTONS_MAX: usize = 32;
/// Maximum time span of a plot, s.
pub const SECONDS_MAX: f64 = 600.0;
/// Maximum number of characters in a name, title or label.
const CHARACTERS_MAX: usize = 100;

/// Returns all mistakes in the structure of a workspace, each with its remedy.
pub fn check_workspace(of: &Workspace) -> Refusals {
    let mut check = Check { name: of.name.clone(), refusals: Vec::new(), panels: 0, plots: 0, labels: HashSet::new() };
    if of.name.trim().is_empty() || !is_line(&of.name) {
        check.refuse(format!("a workspace cannot be named {:?}", of.name), format!("give 1 to {CHARACTERS_MAX} characters on one line"));
    }
    for (what, text) in [("title", &of.title), ("doc", &of.doc)] {
        if text.chars().any(|c| c.is_control() && c != '\n') || text.chars().count() > 10 * CHARACTERS_MAX {
            check.refuse(format!("the {what} of workspace '{}' is too long, or contains control characters", of.name), "write a short text".to_owned());
        }
    }
    check.region(&of.layout, 1);
    if check.panels > PANELS_MAX {
        check.refuse(format!("workspace '{}' cannot have {} panels", of.name, check.panels), format!("show at most {PANELS_MAX}, or divide the workspace"));
    }
    if check.plots > PLOTS_MAX {
        check.refuse(format!("workspace '{}' cannot have {} plots", of.name, check.plots), format!("show at most {PLOTS_MAX}; put several names into one"));
    }
    check.refusals
}

fn is_line(text: &str) -> bool {
    text.chars().count() <= CHARACTERS_MAX && !text.chars().any(char::is_control)
}

struct Check {
    name: String,
    refusals: Refusals,
    panels: usize,
    plots: usize,
    labels: HashSet<String>,
}

impl Check {
    fn refuse(&mut self, message: String, remedy: String) {
        self.refusals.push(Refusal::new(Class::DefinitionError, message).remedy(remedy));
    }

    /// Refuses a mistake in a panel.
    fn wrong(&mut self, of: &Region, what: impl std::fmt::Display, remedy: impl Into<String>) {
        let message = format!("workspace '{}', {}: {what}", self.name, of.called());
        self.refuse(message, remedy.into());
    }

    fn region(&mut self, of: &Region, depth: usize) {
        let parts = [&of.row, &of.column, &of.tabs].into_iter().filter(|inner| !inner.is_empty()).count() + usize::from(of.panel.is_some());
        if parts != 1 {
            let words: Vec<&str> = PanelKind::ALL.iter().map(|kind| kind.word()).collect();
            let what = if parts == 0 { "it has neither a panel nor regions" } else { "it is more than one of row, column, tabs and panel" };
            return self.wrong(of, what, format!("write one: \"row\": […], \"column\": […], \"tabs\": […], or \"panel\": one of {}", words.join(", ")));
        }
        if depth > DEPTH_MAX {
            return self.wrong(of, format!("it is nested {depth} rows and columns deep"), format!("nest it at most {DEPTH_MAX} deep"));
        }
        if of.share.is_some_and(|share| !(share.is_finite() && (0.01..=100.0).contains(&share))) {
            self.wrong(of, format!("its share cannot be {}", of.share.unwrap_or_default()), "give 0.01 to 100; its neighbours have 1");
        }
        if let Some(inner) = of.tabs.iter().find(|inner| inner.panel.is_none()) {
            self.wrong(inner, "it is a tab, but not a panel", "put rows and columns around tabs, not into them");
        }
        if !is_line(&of.title) {
            self.wrong(of, "its title is too long or not on one line", format!("give at most {CHARACTERS_MAX} characters on one line"));
        }
        for (has, word, belongs) in [
            (!of.names.is_empty(), "names", PanelKind::Plot),
            (of.seconds.is_some(), "seconds", PanelKind::Plot),
            (!of.values.is_empty(), "values", PanelKind::Values),
            (of.device.is_some(), "device", PanelKind::Scene),
            (of.verb.is_some(), "verb", PanelKind::Verb),
            (!of.buttons.is_empty(), "buttons", PanelKind::Buttons),
        ] {
            if has && of.panel != Some(belongs) {
                self.wrong(of, format!("it has '{word}', which only a '{}' panel has", belongs.word()), format!("leave '{word}' out"));
            }
        }
        match of.panel {
            Some(kind) => self.panel(of, kind),
            None => of.inner().for_each(|inner| self.region(inner, depth + 1)),
        }
    }

    fn panel(&mut self, of: &Region, kind: PanelKind) {
        self.panels += 1;
        match kind {
            PanelKind::Plot => {
                self.plots += 1;
                self.several(of, of.names.len(), "names", "the SVVs that it shows");
                if of.seconds.is_some_and(|seconds| !(0.1..=SECONDS_MAX).contains(&seconds)) {
                    self.wrong(of, format!("its time span cannot be {} s", of.seconds.unwrap_or_default()), format!("give 0.1 to {SECONDS_MAX} s"));
                }
            }
            PanelKind::Values => {
                self.several(of, of.values.len(), "values", "the SVVs that it shows");
                of.values.iter().for_each(|value| self.value(of, value));
            }
            PanelKind::Scene if of.device.is_none() => self.wrong(of, "it names no 'device'", "name the physical device that it draws"),
            PanelKind::Verb if of.verb.is_none() => self.wrong(of, "it names no 'verb'", "name the verb whose state diagram it shows"),
            PanelKind::Buttons => {
                if of.buttons.is_empty() || of.buttons.len() > BUTTONS_MAX {
                    self.wrong(of, format!("it cannot have {} buttons", of.buttons.len()), format!("give 1 to {BUTTONS_MAX}"));
                }
                of.buttons.iter().for_each(|button| self.button(of, button));
            }
            _ => {}
        }
    }

    fn several(&mut self, of: &Region, count: usize, word: &str, which: &str) {
        if count == 0 || count > NAMES_MAX {
            self.wrong(of, format!("it cannot have {count} '{word}'"), format!("name {which}, 1 to {NAMES_MAX}"));
        }
    }

    fn value(&mut self, of: &Region, value: &ShownValue) {
        if !is_line(&value.label) {
            self.wrong(
                of,
                format!("the label of '{}' is too long or not on one line", value.name),
                format!("give at most {CHARACTERS_MAX} characters on one line"),
            );
        }
        let (low, high) = (value.minimum.unwrap_or(f64::NEG_INFINITY), value.maximum.unwrap_or(f64::INFINITY));
        // NaN limits compare as `None` and are refused too.
        if low.partial_cmp(&high).is_none_or(std::cmp::Ordering::is_ge) {
            self.wrong(of, format!("the limits of '{}' cannot be {low} and {high}", value.name), "give a minimum below the maximum");
        }
    }

    fn button(&mut self, of: &Region, button: &Button) {
        let label = &button.label;
        if label.trim().is_empty() || !is_line(label) {
            self.wrong(of, format!("a button cannot have the label {label:?}"), format!("give 1 to {CHARACTERS_MAX} characters on one line"));
        } else if !self.labels.insert(label.clone()) {
            self.wrong(of, format!("there are two buttons '{label}'"), "give each a different label: it names what the button starts");
        }
        match (&button.start, &button.instance) {
            (Some(_), None) if button.values.is_empty() => {}
            (Some(_), None) => self.wrong(of, format!("button '{label}' has both 'values' and 'start'"), "write them into 'start'"),
            (None, Some(_)) => {}
            (Some(_), Some(_)) => self.wrong(of, format!("button '{label}' has both 'start' and 'instance'"), "give one of them"),
            (None, None) => self.wrong(of, format!("button '{label}' starts nothing"), "give 'start' with a verb, or 'instance' with the name of an instance"),
        }
    }
}

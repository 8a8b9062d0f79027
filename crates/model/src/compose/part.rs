// SPDX-License-Identifier: Apache-2.0
//! Parts of a composition, and the names that their items have in the composed verb.
use super::Composition;
use super::reach::{ends, reached};
use crate::checked::CheckedVerb;
use crate::definition::Verb;
use crate::flatten::{Group, Origin, Port};
use crate::lists::CheckedCommand;
use crate::value::Value;
use indexmap::IndexSet;
use std::collections::{HashMap, HashSet};

/// Name of the list into which `together` merges the initial lists.
pub(super) const MERGED: &str = "start";

/// A part: its checked verb, and the renamings, presets and shared blocks that the composition specifies for it.
pub(super) struct PartOf<'a> {
    pub label: &'a str,
    pub verb: &'a Verb,
    pub checked: CheckedVerb,
    /// Renamed items of the part: name in the part → name in the composed verb.
    pub renamed: HashMap<&'a str, &'a str>,
    /// Inputs of the part that have a preset value.
    pub preset: HashMap<&'a str, &'a Value>,
    /// Labels of the part's blocks that are shared with other parts.
    pub shared: HashSet<&'a str>,
    /// Cells that are bound to shared blocks.
    pub shared_cells: HashSet<&'a str>,
    /// Lists of the part that are merged with lists of other parts, with the names of the lists of the composed verb that contain them.
    pub joint: HashMap<usize, Vec<String>>,
    /// Lists that can be reached from the initial one while the part is not ending.
    work: IndexSet<String>,
}

impl<'a> PartOf<'a> {
    pub fn new(label: &'a str, verb: &'a Verb, checked: CheckedVerb, of: &Composition) -> PartOf<'a> {
        let joint = if of.together { HashMap::from([(checked.initial, vec![MERGED.to_owned()])]) } else { HashMap::new() };
        let initial = verb.command_lists.get_index(checked.initial).map(|(name, _)| name.clone());
        let work = reached(verb, initial.into_iter().collect(), |line| !ends(line));
        PartOf { label, verb, checked, renamed: HashMap::new(), preset: HashMap::new(), shared: HashSet::new(), shared_cells: HashSet::new(), joint, work }
    }

    /// Describes the part for messages: `part 'approach' (verb 'reach')`.
    pub fn described(&self) -> String {
        format!("part '{}' (verb '{}')", self.label, self.verb.name)
    }

    /// Returns the name, in the composed verb, of a parameter, object, output or condition of this part.
    pub fn own<'s>(&'s self, name: &'s str) -> &'s str {
        self.renamed.get(name).copied().unwrap_or(name)
    }

    /// Returns the name, in the composed verb, of a parameter, which may be a member (`arm.sensed`) of a renamed object.
    pub fn parameter(&self, name: &str) -> String {
        match name.split_once('.') {
            Some((root, member)) if !self.renamed.contains_key(name) => format!("{}.{member}", self.own(root)),
            _ => self.own(name).to_owned(),
        }
    }

    /// Returns the key of an entry of ν or ω: `grasp.width`, or `pick.grasp.width` for a part that is itself composed.
    pub fn line(&self, key: &str) -> String {
        let name = self.verb.reported(key);
        format!("{}.{}{}", self.label, &key[..key.len() - name.len()], self.own(name))
    }

    pub fn block(&self, label: &str) -> String {
        if self.shared.contains(label) { label.to_owned() } else { format!("{}.{label}", self.label) }
    }

    /// Returns the name of a port in the composed verb: `label.item`, or a longer path.
    pub fn port(&self, name: &str) -> String {
        match self.labels_of(name).max_by_key(|label| label.len()) {
            Some(label) => format!("{}{}", self.block(label), &name[label.len()..]),
            None => format!("{}.{name}", self.label),
        }
    }

    /// Returns the block labels with which a name may begin.
    fn labels_of<'s>(&'s self, name: &'s str) -> impl Iterator<Item = &'s str> {
        let is_head = move |label: &&str| name.strip_prefix(*label).is_some_and(|rest| rest.starts_with('.'));
        self.verb.blocks.keys().map(String::as_str).filter(is_head)
    }

    pub fn ports(&self, names: &[String]) -> Vec<String> {
        names.iter().map(|name| self.port(name)).collect()
    }

    pub fn cell(&self, name: &str) -> String {
        if self.shared_cells.contains(name) { name.to_owned() } else { format!("{}.{name}", self.label) }
    }

    /// Returns the name of a list in the composed verb.
    pub fn list(&self, index: usize) -> String {
        self.joint.get(&index).map_or_else(|| self.alone(index), |names| names[0].clone())
    }

    /// Returns the names of all lists of the composed verb that contain a list.
    pub fn lists_with(&self, index: usize) -> Vec<String> {
        self.joint.get(&index).cloned().unwrap_or_else(|| vec![self.alone(index)])
    }

    /// Returns the name that a list has in the composed verb if it is not merged with others.
    pub fn alone(&self, index: usize) -> String {
        format!("{}.{}", self.label, self.own_list(index))
    }

    /// Returns the part's own name of a list.
    pub fn own_list(&self, index: usize) -> &str {
        self.verb.command_lists.get_index(index).map_or("", |(name, _)| name.as_str())
    }

    /// Returns true if a list can be reached from the initial one while the part is not ending.
    pub fn is_work(&self, index: usize) -> bool {
        self.work.contains(self.own_list(index))
    }

    pub fn list_named(&self, name: &str) -> String {
        self.verb.command_lists.get_index_of(name).map_or_else(|| format!("{}.{name}", self.label), |index| self.list(index))
    }

    /// Returns the data object of an instantiation parameter.
    pub fn group(&self, parameter: &str) -> Option<&Group> {
        self.checked.groups.iter().find(|group| group.origin == Origin::Parameter && group.name == parameter)
    }

    /// Returns the top-level block to which a flat block belongs.
    pub fn label_of(&self, block: usize) -> &str {
        let flat = &self.checked.blocks[block].label;
        self.verb.blocks.keys().map(String::as_str).filter(|label| is_within(flat, label)).max_by_key(|label| label.len()).unwrap_or(flat)
    }

    /// Describes a flat item for messages: `output 'approach.plan.target' (double[n], rad)`.
    pub fn item(&self, port: Port) -> String {
        let mut block = self.checked.blocks[port.0].clone();
        let label = self.label_of(port.0);
        block.label = format!("{}{}", self.block(label), &block.label[label.len()..]);
        crate::flatten::describe(&block, port.1)
    }

    /// Returns true if a list runs a block that reports the condition. System conditions may occur in any list.
    pub fn can_come(&self, list: usize, name: &str) -> bool {
        let runs = |block: usize| {
            let mut commands = self.checked.lists[list].stages.iter().flat_map(|stage| &stage.commands);
            commands
                .any(|command| matches!(command, CheckedCommand::Activate { blocks, .. } | CheckedCommand::Execute { blocks, .. } if blocks.contains(&block)))
        };
        let line = self.checked.conditions.iter().find(|c| c.planned.name == name && c.planned.holds_in(list));
        line.is_none_or(|line| line.planned.on.is_empty() || line.planned.on.iter().any(|port| runs(port.0)))
    }

    /// Returns true if a condition, identified by its name in the part, holds in a list and has no transition there. τ does not apply to
    /// the end of the ending list.
    pub fn ends(&self, list: usize, name: &str) -> bool {
        if self.checked.ending.list == Some(list) {
            return false;
        }
        let line = self.checked.conditions.iter().find(|c| c.planned.name == name && c.planned.holds_in(list));
        match line {
            Some(line) => !line.transitions.iter().any(|(from, _)| *from == list),
            None => crate::conditions::LIMITS.contains(&name),
        }
    }
}

/// Returns true if a flat label is `label` or is nested within it.
pub(super) fn is_within(flat: &str, label: &str) -> bool {
    flat.strip_prefix(label).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
}

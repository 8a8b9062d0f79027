// SPDX-License-Identifier: Apache-2.0
//! Command lists of a composed verb; `together` creates joint lists.
use super::Composing;
use super::joint::Joint;
use super::part::PartOf;
use crate::definition::{Command, CommandList};
use crate::interface::Kind;
use crate::lists::CheckedCommand;
use crate::refusal::Class;
use std::collections::HashSet;

impl Composing<'_> {
    /// Copies the lists of all parts.
    pub fn lists(&mut self) {
        for joint in self.joints.clone() {
            self.merge(&joint);
        }
        for part in &self.parts {
            for (at, (_, list)) in part.verb.command_lists.iter().enumerate() {
                let name = part.alone(at);
                if !part.lists_with(at).contains(&name) {
                    continue;
                }
                let commands = list.commands.iter().map(|command| part.command(command)).collect();
                let place = if list.place.is_some() { &list.place } else { &part.verb.place };
                self.verb.command_lists.insert(name, CommandList { commands, place: place.clone() });
            }
        }
    }

    /// Merges several lists: first the start of each list, up to its first wait, in the order of the parts; then the rest of the list
    /// that contains waits; then the waits for all parts.
    fn merge(&mut self, joint: &Joint) {
        let mut commands: Vec<(usize, Command)> = Vec::new();
        let mut waiting: Option<(usize, Vec<Command>)> = None;
        for &(part, list) in &joint.lists {
            let of = &self.parts[part];
            let all: Vec<Command> = of.verb.command_lists[list].commands.iter().map(|command| of.command(command)).collect();
            let lead = all.iter().position(|command| matches!(command, Command::Wait { .. })).unwrap_or(all.len());
            for command in &all[..lead] {
                self.merge_command(part, command, &mut commands);
            }
            match &waiting {
                _ if lead == all.len() => {}
                Some((first, _)) => {
                    let message = format!(
                        "the {} of {} cannot be merged: both wait, but one list waits for only one thing at a time",
                        joint.what(),
                        self.both(*first, part)
                    );
                    self.conflict(Class::CompositionConflict, message, "let τ of one of them do the work of its wait", (*first, part));
                }
                None => waiting = Some((part, all[lead..].to_vec())),
            }
        }
        self.check_writers(joint);
        let first = waiting.as_ref().map(|(part, _)| *part);
        let commands = commands.into_iter().map(|(_, command)| command).chain(waiting.into_iter().flat_map(|(_, rest)| rest));
        let commands = commands.chain(self.await_all(joint)).chain(self.end_with(joint, first)).collect();
        self.verb.command_lists.insert(joint.name.clone(), CommandList { commands, place: self.of.place.clone() });
    }

    /// Returns the commands that end the list if the whole verb ends as soon as the waiting part is `completed`: they deactivate the
    /// blocks of the other parts.
    fn end_with(&self, joint: &Joint, first: Option<usize>) -> Vec<Command> {
        let list_of = |part: usize| joint.lists.iter().find(|(of, _)| *of == part).map(|(_, list)| *list);
        let Some((first, list)) = first.and_then(|first| Some((first, list_of(first)?))).filter(|_| !joint.all) else { return Vec::new() };
        if !self.parts[first].left_on(list).is_empty() {
            return Vec::new();
        }
        let mut offs: Vec<Command> = Vec::new();
        for &(part, list) in joint.lists.iter().filter(|(part, _)| *part != first) {
            for block in self.parts[part].left_on(list) {
                let off = Command::Deactivate { block: self.parts[part].label(block) };
                if !offs.contains(&off) {
                    offs.push(off);
                }
            }
        }
        offs
    }

    /// Merges a command for a shared block: a duplicate is dropped; a different command of the same kind is a conflict.
    fn merge_command(&mut self, part: usize, command: &Command, commands: &mut Vec<(usize, Command)>) {
        let block = |command: &Command| match command {
            Command::Execute { block } | Command::Activate { block, .. } | Command::Deactivate { block } => block.clone(),
            _ => String::new(),
        };
        let same_kind = |other: &Command| std::mem::discriminant(other) == std::mem::discriminant(command) && block(other) == block(command);
        let is_one = matches!(command, Command::Ready) || !block(command).is_empty();
        match commands.iter().find(|(of, other)| *of != part && is_one && same_kind(other)) {
            Some((_, other)) if other == command => {}
            Some((first, _)) => {
                let (first, block) = (*first, block(command));
                let message = format!("{} activate the shared block '{block}' differently", self.both(first, part));
                self.conflict(Class::SchedulingError, message, "give it one interval and budget", (first, part));
            }
            None => commands.push((part, command.clone())),
        }
    }

    /// Checks that no two parts write the same parameter in a joint list.
    fn check_writers(&mut self, joint: &Joint) {
        let mut conflicts = Vec::new();
        for name in self.verb.instantiation_parameters.keys() {
            let writers: Vec<(usize, String)> = joint.lists.iter().filter_map(|&(part, list)| Some((part, self.parts[part].writer_of(name, list)?))).collect();
            for pair in writers.windows(2) {
                let [(first, a), (second, b)] = pair else { continue };
                let remedy = format!("{}, or let one follow the other", self.rename_remedy(*second, name));
                conflicts.push((format!("'{name}' has two writers at the same time: {a} and {b}"), remedy, (*first, *second)));
            }
        }
        for (message, remedy, pair) in conflicts {
            self.conflict(Class::SecondWriter, message, &remedy, pair);
        }
    }
}

impl PartOf<'_> {
    /// Returns a command with the labels of the composed verb.
    fn command(&self, command: &Command) -> Command {
        match command {
            Command::Install { blocks } => Command::Install { blocks: blocks.iter().map(|block| self.label(block)).collect() },
            Command::Execute { block } => Command::Execute { block: self.label(block) },
            Command::Activate { block, every_ns, tunable, budget_ns } => {
                Command::Activate { block: self.label(block), every_ns: *every_ns, tunable: *tunable, budget_ns: *budget_ns }
            }
            Command::Deactivate { block } => Command::Deactivate { block: self.label(block) },
            Command::Wait { conditions, time_ns } => {
                let stands_for = |name: &String| match self.verb.conditions.get(name) {
                    Some(termination) => self.ports(&termination.on),
                    None => vec![self.port(name)],
                };
                Command::Wait { conditions: conditions.iter().flat_map(stands_for).collect(), time_ns: *time_ns }
            }
            Command::Ready => Command::Ready,
        }
    }

    /// Returns the label, in the composed verb, of a block or of a block within a graph (`loop.estimator`).
    pub fn label(&self, label: &str) -> String {
        if self.verb.blocks.contains_key(label) { self.block(label) } else { self.port(label) }
    }

    /// Returns the port of the part that writes an instantiation parameter of the composed verb while one of the part's lists runs.
    fn writer_of(&self, name: &str, list: usize) -> Option<String> {
        let own = self.verb.instantiation_parameters.keys().find(|own| self.parameter(own) == name)?;
        let active: HashSet<usize> = self.checked.lists[list]
            .stages
            .iter()
            .flat_map(|stage| &stage.commands)
            .filter_map(|command| match command {
                CheckedCommand::Activate { blocks, .. } => Some(blocks.clone()),
                _ => None,
            })
            .flatten()
            .collect();
        let writes = |port: &&(usize, usize)| {
            let kind = self.checked.blocks[port.0].kind.item(port.1).kind;
            matches!(kind, Kind::Output | Kind::DeviceWrite) && active.contains(&port.0) && !self.shared.contains(self.label_of(port.0))
        };
        self.group(own)?.ports.iter().find(writes).map(|port| self.item(*port))
    }
}

// SPDX-License-Identifier: Apache-2.0
//! Termination conditions of a composed verb: one entry for each part that has the condition, restricted to the lists of that part. In a
//! list shared by several parts, ν is the union of the parts' ν.
use super::Composing;
use super::joint::Joint;
use super::part::{MERGED, PartOf};
use crate::definition::Termination;
use crate::refusal::Class;
use indexmap::IndexMap;

impl Composing<'_> {
    /// Copies the condition tables of all parts.
    pub fn conditions(&mut self) {
        for joint in self.joints.clone() {
            self.merge_conditions(&joint);
        }
        for part in &self.parts {
            for (at, (key, _)) in part.verb.conditions.iter().enumerate() {
                let mut line = part.termination(at);
                line.during.retain(|list| self.joints.iter().all(|joint| joint.name != *list));
                if !line.during.is_empty() {
                    self.verb.conditions.insert(part.line(key), line);
                }
            }
        }
    }

    /// Merges the entries of a list shared by several parts. If all parts are awaited, the conditions that end them become `completed`.
    fn merge_conditions(&mut self, joint: &Joint) {
        let mut lines: IndexMap<String, (usize, Termination)> = IndexMap::new();
        for &(part, list) in &joint.lists {
            let verb = self.parts[part].verb;
            let awaited = if joint.all { self.parts[part].awaited(list) } else { Vec::new() };
            for (at, key) in verb.conditions.keys().enumerate() {
                let mut line = self.parts[part].termination(at);
                if !line.during.contains(&joint.name) {
                    continue;
                }
                let mut name = self.parts[part].own(verb.reported(key)).to_owned();
                if awaited.contains(&at) {
                    line.on.clear();
                    (name, line.priority) = ("completed".to_owned(), 0);
                }
                match lines.get(&name).cloned() {
                    Some((first, known)) => {
                        let united = self.unite_lines(&name, (first, known), (part, line));
                        lines.insert(name, (first, united));
                    }
                    None => drop(lines.insert(name, (part, Termination { during: vec![joint.name.clone()], ..line }))),
                }
            }
        }
        let key = |name: String| if joint.name == MERGED { name } else { format!("{}.{name}", joint.name) };
        self.verb.conditions.extend(lines.into_iter().map(|(name, (_, line))| (key(name), line)));
    }

    fn unite_lines(&mut self, name: &str, (first, known): (usize, Termination), (second, line): (usize, Termination)) -> Termination {
        let both = self.both(first, second);
        let is_normal = |line: &Termination| !line.raises && (name == "completed" || line.returns.is_some());
        let remedy = format!("rename one: rename={{'{}.{name}': '…'}}, or make them alike", self.parts[second].label);
        // If one part has come to rest and the other has failed, the whole has failed.
        let both_ended = name == "completed" && known.on.is_empty();
        if is_normal(&known) != is_normal(&line) && !both_ended {
            let message = format!("the condition '{name}' of {both} is a normal end in one but not in the other, and both run together");
            self.conflict(Class::CompositionConflict, message, &remedy, (first, second));
        }
        if known.priority != line.priority {
            let message = format!("the condition '{name}' has priority {} and {} in {both}, and both run together", known.priority, line.priority);
            self.conflict(Class::CompositionConflict, message, &remedy, (first, second));
        }
        if let (Some(one), Some(other)) = (&known.alarm, &line.alarm)
            && one != other
        {
            let message = format!("the condition '{name}' raises alarm '{one}' and '{other}' in {both}, and both run together");
            self.conflict(Class::CompositionConflict, message, &remedy, (first, second));
        }
        let mut united = known;
        united.alarm = united.alarm.or(line.alarm);
        united.raises |= line.raises;
        united.on.extend(line.on.into_iter().filter(|on| !united.on.contains(on)).collect::<Vec<_>>());
        for key in line.returns.iter().flatten() {
            let output = self.verb.reported(key);
            let same = united.returns.iter().flatten().find(|other| self.verb.reported(other) == output);
            let is_one = same.map(|other| self.verb.output_values.get(other) == self.verb.output_values.get(key));
            match is_one {
                Some(true) => {}
                Some(false) => {
                    let message = format!("the condition '{name}' returns the output '{output}' of {both}, and both run together");
                    let remedy = format!("rename one: rename={{'{}.{output}': '{}_{output}'}}", self.parts[second].label, self.parts[second].label);
                    self.conflict(Class::CompositionConflict, message, &remedy, (first, second));
                }
                None => united.returns.get_or_insert_default().push(key.clone()),
            }
        }
        if line.returns.is_some() {
            united.returns.get_or_insert_default();
        }
        united
    }
}

impl PartOf<'_> {
    /// Returns an entry of the part's table, renamed for the composed verb and restricted to the part's own lists.
    fn termination(&self, at: usize) -> Termination {
        let line = &self.verb.conditions[at];
        let lists = (0..self.verb.command_lists.len()).filter(|list| self.checked.conditions[at].planned.holds_in(*list));
        Termination {
            on: self.ports(&line.on),
            returns: line.returns.as_ref().map(|returns| returns.iter().map(|key| self.line(key)).collect()),
            raises: line.raises,
            during: lists.flat_map(|list| self.lists_with(list)).collect(),
            priority: line.priority,
            alarm: line.alarm.clone(),
            place: if line.place.is_some() { line.place.clone() } else { self.verb.place.clone() },
        }
    }
}

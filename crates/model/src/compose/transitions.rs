// SPDX-License-Identifier: Apache-2.0
//! τ of a composed verb: the transitions of each part, and the entries that lead from one part to another. A pair (list, condition) that
//! ends a part on its own becomes a transition if such an entry covers it.
use super::joint::ListOf;
use super::part::MERGED;
use super::reach::{ends, reached};
use super::{Composing, Step};
use crate::conditions::{ENDS, LIMITS, SYSTEM, is_system};
use crate::definition::Transition;
use crate::refusal::Class;
use hints::did_you_mean;
use indexmap::{IndexMap, IndexSet};
use std::cmp::Reverse;
use std::collections::HashMap;

/// Rank of an entry: if two entries apply to the same pair, the one with the higher rank wins. The rank depends, in this order, on
/// whether the entry names a condition, whether it names a list, how few parts it names, and how deeply they are nested.
type Rank = (bool, bool, Reverse<usize>, usize);

impl Composing<'_> {
    /// Copies τ of the parts and adds the entries between parts.
    pub fn transitions(&mut self) {
        self.initial();
        self.own_transitions();
        let mut lines: Vec<(Rank, &Step, Vec<ListOf>)> = Vec::new();
        for step in &self.of.transitions {
            if let Some((lists, is_list)) = self.from(step) {
                let depth = step.from.iter().map(|name| name.split('.').count()).min().unwrap_or(0);
                lines.push(((step.condition.is_some(), is_list, Reverse(step.from.len()), depth), step, lists));
            }
        }
        lines.sort_by_key(|(rank, ..)| Reverse(*rank));
        let mut augmented: HashMap<(String, String), (Rank, usize)> = HashMap::new();
        for (at, (rank, step, lists)) in lines.iter().enumerate() {
            self.augment(*rank, step, lists, at, &mut augmented);
        }
        if self.refusals.is_empty() {
            self.check_reached();
            self.check_endings(&lines, &augmented);
            self.keep_to_ends(&lines, &augmented);
        }
    }

    /// Removes transitions from lists that run only after the verb was ordered to end, if they result from an entry without a condition
    /// that also leaves work: the part that follows must not begin during an ending, even if no other transition leads to it. An entry
    /// that names its condition declares an ending.
    fn keep_to_ends(&mut self, lines: &[(Rank, &Step, Vec<ListOf>)], augmented: &HashMap<(String, String), (Rank, usize)>) {
        let (work, ending) = self.work_and_ending();
        let is_work = |at: usize| lines[at].2.iter().any(|(part, list)| self.parts[*part].lists_with(*list).iter().any(|name| work.contains(name)));
        let cut: Vec<bool> = lines.iter().enumerate().map(|(at, (_, step, _))| step.condition.is_none() && is_work(at)).collect();
        self.verb.transitions.retain(|line| {
            let of = augmented.get(&(line.from.clone(), line.condition.clone()));
            let is_late = ending.contains(&line.from) && !work.contains(&line.from) && !work.contains(&line.to);
            let is_cut = is_late && of.is_some_and(|(_, at)| cut[*at]);
            !is_cut
        });
    }

    fn initial(&mut self) {
        let first = self.parts[0].list(self.parts[0].checked.initial);
        let named = self.of.initial.as_ref().filter(|_| !self.of.together);
        let found = named.map_or(Some(first), |name| self.list_of(name));
        if found.is_none() {
            let name = named.map_or("", String::as_str);
            let remedy = did_you_mean(name, self.known_lists());
            self.refuse(Class::UnknownName, format!("initial= names '{name}', which is not a part or list of '{}'", self.of.name), &remedy, &None);
        }
        self.verb.initial = found;
    }

    /// Returns the names by which parts and lists can be referenced.
    fn known_lists(&self) -> Vec<&str> {
        self.verb.parts.keys().chain(self.verb.command_lists.keys()).map(String::as_str).collect()
    }

    /// Returns the list that a part or list denotes when it is the target of an entry.
    fn list_of(&self, name: &str) -> Option<String> {
        let list = |name: &str| self.verb.command_lists.contains_key(name).then(|| name.to_owned());
        let own = || {
            let (label, rest) = name.split_once('.')?;
            let part = self.parts.iter().find(|part| part.label == label)?;
            part.verb.command_lists.get_index_of(rest).map(|at| part.list(at))
        };
        self.verb.parts.get(name).map(|part| part.initial.clone()).or_else(|| list(name)).or_else(own)
    }

    fn own_transitions(&mut self) {
        let mut known: IndexMap<(String, String), (usize, String)> = IndexMap::new();
        let (mut lines, mut conflicts) = (Vec::new(), Vec::new());
        for (at, part) in self.parts.iter().enumerate() {
            let own = part.verb.transitions.iter().flat_map(|line| self.targets(at, line).into_iter().map(move |(from, to)| (line, from, to)));
            for (line, from, to) in own {
                let condition = part.own(&line.condition).to_owned();
                let place = if line.place.is_some() { &line.place } else { &part.verb.place };
                if let Some((first, before)) = known.insert((from.clone(), condition.clone()), (at, to.clone())) {
                    if before == to {
                        continue;
                    }
                    let message = format!("in the list '{from}', the condition '{condition}' leads {} to different lists", self.both(first, at));
                    let remedy = if is_system(&condition) {
                        "let it lead both back to the initial list, or both to other lists".to_owned()
                    } else {
                        format!("rename one: rename={{'{}.{condition}': '{}_{condition}'}}", part.label, part.label)
                    };
                    conflicts.push((message, remedy, (first, at)));
                    continue;
                }
                lines.push(Transition { from, condition, to, place: place.clone() });
            }
        }
        self.verb.transitions.extend(lines);
        for (message, remedy, pair) in conflicts {
            self.conflict(Class::CompositionConflict, message, &remedy, pair);
        }
    }

    /// Returns the lists from which an entry leads, and true if the entry names lists.
    fn from(&mut self, step: &Step) -> Option<(Vec<ListOf>, bool)> {
        let mut found: Vec<ListOf> = Vec::new();
        let mut names_lists = !step.from.is_empty();
        for name in &step.from {
            let (lists, is_list) = self.lists_of(name);
            names_lists &= is_list;
            if lists.is_empty() {
                let remedy = did_you_mean(name, self.known_lists());
                self.refuse(
                    Class::UnknownName,
                    format!("{} begins at '{name}', which is not a part or list of '{}'", text(step), self.of.name),
                    &remedy,
                    &step.place,
                );
                return None;
            }
            found.extend(lists);
        }
        if found.is_empty() {
            self.refuse(
                Class::DefinitionError,
                format!("{} does not say where it begins", text(step)),
                "name the part or list that it leads from",
                &step.place,
            );
        }
        Some((found, names_lists)).filter(|(found, _)| !found.is_empty())
    }

    /// Returns the lists that a name denotes: one list, or all lists of a part.
    fn lists_of(&self, name: &str) -> (Vec<ListOf>, bool) {
        let all = || self.parts.iter().enumerate().flat_map(|(at, part)| (0..part.verb.command_lists.len()).map(move |list| (at, list)));
        let full = |(part, list): &ListOf| {
            let of = &self.parts[*part];
            format!("{}.{}", of.label, of.verb.command_lists.get_index(*list).map_or("", |list| list.0.as_str()))
        };
        let lists: Vec<ListOf> = all().filter(|at| full(at) == name || self.parts[at.0].lists_with(at.1).iter().any(|list| list == name)).collect();
        if !lists.is_empty() {
            return (lists, true);
        }
        (all().filter(|at| super::part::is_within(&full(at), name)).collect(), false)
    }

    fn augment(&mut self, rank: Rank, step: &Step, lists: &[ListOf], at: usize, augmented: &mut HashMap<(String, String), (Rank, usize)>) {
        let Some(to) = self.list_of(&step.to) else {
            let remedy = did_you_mean(&step.to, self.known_lists());
            return self.refuse(
                Class::UnknownName,
                format!("{} leads to '{}', which is not a part or list of '{}'", text(step), step.to, self.of.name),
                &remedy,
                &step.place,
            );
        };
        if !self.check_condition(step, lists) {
            return;
        }
        let mut ended: Vec<(String, String)> = Vec::new();
        for &(part, list) in lists {
            let of = &self.parts[part];
            for (own, name) in self.ends_of(step, part, list) {
                let names_list = rank.1;
                if of.ends(list, &own) && (names_list || of.can_come(list, &own)) {
                    ended.extend(of.lists_with(list).into_iter().map(|from| (from, name.clone())));
                }
            }
        }
        if ended.is_empty() {
            self.refuse_nothing(step, lists);
        }
        for (from, name) in ended {
            match augmented.get(&(from.clone(), name.clone())) {
                Some((known, other)) if *known == rank && *other != at => {
                    let message = format!("{} appears twice: ('{from}', '{name}') leads to two lists", text(step));
                    self.refuse(Class::CompositionConflict, message, "let a condition lead from a list to only one list", &step.place);
                }
                Some(_) => {}
                None => {
                    augmented.insert((from.clone(), name.clone()), (rank, at));
                    let place = if step.place.is_some() { &step.place } else { &self.of.place };
                    self.verb.transitions.push(Transition { from, condition: name, to: to.clone(), place: place.clone() });
                }
            }
        }
    }

    /// Returns the conditions to which an entry applies in a list, by their names in the part and in the composed verb.
    fn ends_of(&self, step: &Step, part: usize, list: usize) -> Vec<(String, String)> {
        let of = &self.parts[part];
        if let Some(condition) = &step.condition {
            return self.own_condition(part, condition).into_iter().map(|own| (own.clone(), of.own(&own).to_owned())).collect();
        }
        let normal = of.checked.conditions.iter().filter(|c| c.planned.normal && c.planned.name != "halted" && c.planned.holds_in(list));
        let names: IndexSet<&str> = normal.map(|c| c.planned.name.as_str()).collect();
        names.into_iter().map(|own| (own.to_owned(), of.own(own).to_owned())).collect()
    }

    /// Returns the condition of a part that has this name in the composed verb, or else in the part.
    fn own_condition(&self, part: usize, name: &str) -> Option<String> {
        let of = &self.parts[part];
        let known = || of.checked.conditions.iter().map(|c| c.planned.name.as_str()).chain(LIMITS);
        known().find(|own| of.own(own) == name).or_else(|| known().find(|own| *own == name)).map(str::to_owned)
    }

    fn check_condition(&mut self, step: &Step, lists: &[ListOf]) -> bool {
        let Some(condition) = &step.condition else { return true };
        if lists.iter().any(|(part, _)| self.own_condition(*part, condition).is_some()) {
            return true;
        }
        let part = &self.parts[lists[0].0];
        let own: IndexSet<&str> = part.verb.conditions.keys().map(|key| part.own(part.verb.reported(key))).collect();
        let remedy = did_you_mean(condition, own.into_iter().chain(SYSTEM).chain(LIMITS));
        let message = format!("{} names the condition '{condition}', which {} does not have", text(step), part.described());
        self.refuse(Class::UnknownName, message, &remedy, &step.place);
        false
    }

    /// Refuses an entry that has no effect.
    fn refuse_nothing(&mut self, step: &Step, lists: &[ListOf]) {
        let condition = step.condition.as_deref().unwrap_or("a normal end");
        let elsewhere = |(part, list): &ListOf| {
            let (of, own) = (&self.parts[*part], self.own_condition(*part, condition)?);
            let lines = of.checked.conditions.iter().filter(|c| c.planned.name == own).flat_map(|c| &c.transitions);
            let to = lines.clone().find(|(from, _)| from == list)?.1;
            Some(format!("in '{}' it already leads to '{}'", of.list(*list), of.list(to)))
        };
        let why = lists.iter().find_map(elsewhere).unwrap_or_else(|| "it does not hold there, or no block that runs there reports it".to_owned());
        let part = self.parts[lists[0].0].described();
        let message = format!("{} changes nothing: '{condition}' does not end '{}' of {part}: {why}", text(step), step.from.join("', '"));
        self.refuse(Class::CompositionConflict, message, "leave the line out, or name a list that it ends", &step.place);
    }

    /// Refuses an entry that names a condition but is never taken because it starts in lists that end the verb and leads back to work.
    fn check_endings(&mut self, lines: &[(Rank, &Step, Vec<ListOf>)], augmented: &HashMap<(String, String), (Rank, usize)>) {
        let (work, ending) = self.work_and_ending();
        let mut never: Vec<(usize, String)> = Vec::new();
        for (at, (_, step, _)) in lines.iter().enumerate() {
            let Some(to) = self.list_of(&step.to).filter(|to| work.contains(to)) else { continue };
            let Some(condition) = step.condition.as_deref().filter(|name| !ENDS.contains(name)) else { continue };
            let froms: Vec<&String> = augmented.iter().filter(|(_, (_, of))| *of == at).map(|((from, _), _)| from).collect();
            if froms.is_empty() || froms.iter().any(|from| work.contains(*from) || !ending.contains(*from)) {
                continue;
            }
            let from = froms.iter().min().map_or("", |from| from.as_str());
            let told = self.verb.transitions.iter().find(|line| line.to == from && ends(line));
            let told = told.map_or("halted", |line| line.condition.as_str());
            never.push((at, format!("'{from}' follows '{told}', which tells the verb to end, so '{condition}' ends it there and '{to}' does not begin")));
        }
        for (at, why) in never {
            let (_, step, _) = &lines[at];
            let remedy =
                format!("leave the line out, or name what tells the verb to end, if '{}' is how it ends: ('{}', 'halted')", step.to, step.from.join("', '"));
            self.refuse(Class::CompositionConflict, format!("{} is never taken: {why}", text(step)), &remedy, &step.place);
        }
    }

    /// Returns the lists that can be reached from the initial one while the verb is not ending, and the lists that can be reached by
    /// conditions that order it to end.
    fn work_and_ending(&self) -> (IndexSet<String>, IndexSet<String>) {
        let work = reached(&self.verb, self.verb.initial.iter().cloned().collect(), |line| !ends(line));
        let first = self.verb.transitions.iter().filter(|line| ends(line) && work.contains(&line.from)).map(|line| line.to.clone()).collect();
        let ending = reached(&self.verb, first, |line| ends(line) || !work.contains(&line.to));
        (work, ending)
    }

    /// Checks that every part can be reached from the initial list.
    fn check_reached(&mut self) {
        let reached = reached(&self.verb, self.verb.initial.iter().cloned().collect(), |_| true);
        let is_reached =
            |part: &super::PartOf<'_>| (0..part.verb.command_lists.len()).flat_map(|list| part.lists_with(list)).any(|list| reached.contains(&list));
        let lost: Vec<usize> = (0..self.parts.len()).filter(|part| !is_reached(&self.parts[*part])).collect();
        let initial = self.verb.initial.clone().unwrap_or_default();
        for part in lost {
            let message = format!("nothing leads from '{initial}' to {}", self.parts[part].described());
            let remedy = format!(
                "add a line to transitions, for example ('{}', 'completed'): '{}'",
                initial.split('.').next().unwrap_or(MERGED),
                self.parts[part].label
            );
            self.refuse(Class::CompositionConflict, message, &remedy, &None);
        }
    }
}

/// Describes an entry for messages: `the transition ('approach', 'contact') → 'grasp'`.
fn text(step: &Step) -> String {
    let condition = step.condition.as_ref().map_or("every normal end".to_owned(), |name| format!("'{name}'"));
    format!("the transition ('{}', {condition}) → '{}'", step.from.join("', '"), step.to)
}

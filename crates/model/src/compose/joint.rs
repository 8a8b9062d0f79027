// SPDX-License-Identifier: Apache-2.0
//! Joint lists: lists of several parts that `together` merges into one. These are the initial lists, and the lists to which one system
//! condition leads several parts.
//!
//! If all parts are awaited, waits record which parts have ended: the list continues with one wait per part, each of which also accepts a
//! condition that occurred earlier. The list then deactivates the parts and is `completed`.
use super::part::{MERGED, PartOf};
use super::{Composing, Until};
use crate::conditions::{ENDS, LIMITS, SYSTEM};
use crate::definition::Command;
use crate::refusal::Class;
use indexmap::IndexSet;
use std::collections::HashSet;

/// Lists of several parts that are merged into one.
#[derive(Clone)]
pub(super) struct Joint {
    pub name: String,
    /// Pairs of a part and one of its lists.
    pub lists: Vec<(usize, usize)>,
    /// True if the joint list ends only when all parts have ended.
    pub all: bool,
}

impl Joint {
    /// Returns the name of the joint lists for messages.
    pub fn what(&self) -> String {
        if self.name == MERGED { "initial lists".to_owned() } else { format!("lists '{}'", self.name) }
    }
}

impl Composing<'_> {
    /// Finds the joint lists, and records their names in the parts.
    pub fn join(&mut self) {
        if !self.of.together {
            return;
        }
        let lists = self.parts.iter().map(|part| part.checked.initial).enumerate().collect();
        self.joints.push(Joint { name: MERGED.to_owned(), lists, all: self.of.until == Until::All });
        for condition in SYSTEM.iter().chain(LIMITS.iter()) {
            let goals = self.parts.iter().enumerate().filter_map(|(at, part)| Some((at, part.goal_of_initial(condition)?)));
            let goals: Vec<(usize, usize)> = goals.collect();
            let is_known = self.joints.iter().any(|joint| joint.lists == goals);
            let is_taken = goals.iter().any(|(part, list)| self.parts[*part].joint.contains_key(list));
            // A goal that leads back to the initial list does so for all parts; a goal that belongs to two joint lists is refused with
            // τ.
            if goals.len() > 1 && !is_known && !is_taken {
                let name = self.joint_name(&goals);
                for (part, list) in &goals {
                    self.parts[*part].joint.insert(*list, name.clone());
                }
                self.joints.push(Joint { name, lists: goals, all: true });
            }
        }
        for joint in self.joints.clone().iter().filter(|joint| joint.all) {
            self.check_all(joint);
            self.check_ends(joint);
        }
    }

    /// Refuses a joint list if a condition that orders the verb to end leads to only some of its lists. The remaining lists would then
    /// start as well, although no such condition of their part leads to them.
    fn check_ends(&mut self, joint: &Joint) {
        let is_ending = |(part, list): &(usize, usize)| ENDS.iter().any(|condition| self.parts[*part].goal_of_initial(condition) == Some(*list));
        let (ending, work): (Vec<_>, Vec<_>) = joint.lists.iter().copied().partition(is_ending);
        if let (Some((part, list)), Some((other, begun))) = (ending.first(), work.first()) {
            let (of, by) = (&self.parts[*part], &self.parts[*other]);
            let message = format!(
                "{} and {} both proceed on one condition, to their lists '{}' and '{}', but a halt leads only to the first: the second would then begin",
                of.described(),
                by.described(),
                of.own_list(*list),
                by.own_list(*begun)
            );
            self.refuse(Class::CompositionConflict, message, "let the halt lead to a separate list", &None);
        }
    }

    fn joint_name(&self, lists: &[(usize, usize)]) -> String {
        let mut names: Vec<String> = lists.iter().map(|(part, list)| self.parts[*part].own_list(*list).replace('.', "_")).collect();
        names.dedup();
        let mut name = names.join("_and_");
        while self.joints.iter().any(|joint| joint.name == name) {
            name.push_str("_2");
        }
        name
    }

    /// Refuses parts that never end in a list in which all parts are awaited, and parts that leave this list without the others.
    fn check_all(&mut self, joint: &Joint) {
        for &(part, list) in &joint.lists {
            let of = &self.parts[part];
            let described = of.described();
            if let Some((condition, to)) = of.leaves(list) {
                let message = format!("all parts are awaited in '{}', but {described} proceeds to its list '{to}' on '{condition}'", joint.name);
                self.refuse(Class::CompositionConflict, message, "compose it so that it needs only one list, or leave until='all' out", &None);
            } else if joint.name == MERGED && of.awaited(list).is_empty() && of.runs_on(list) {
                let message = format!("all parts are awaited, but {described} has no condition with returns= that ends its list '{}'", of.own_list(list));
                self.refuse(Class::CompositionConflict, message, "give it one: conditions={'arrived': on('near.done', returns=[])}", &None);
            }
        }
    }

    /// Returns the commands with which a joint list continues if all parts are awaited.
    pub fn await_all(&self, joint: &Joint) -> Vec<Command> {
        let (mut waits, mut offs): (Vec<Command>, Vec<Command>) = (Vec::new(), Vec::new());
        for &(part, list) in joint.lists.iter().filter(|_| joint.all) {
            let of = &self.parts[part];
            let awaited = of.awaited(list);
            if awaited.is_empty() {
                continue;
            }
            let on: IndexSet<String> = awaited.iter().flat_map(|at| of.ports(&of.verb.conditions[*at].on)).collect();
            waits.push(Command::Wait { conditions: on.into_iter().collect(), time_ns: None });
            for block in of.left_on(list) {
                let off = Command::Deactivate { block: of.label(block) };
                if !offs.contains(&off) {
                    offs.push(off);
                }
            }
        }
        waits.extend(offs);
        waits
    }
}

impl PartOf<'_> {
    fn own_list(&self, list: usize) -> &str {
        self.verb.command_lists.get_index(list).map_or("", |(name, _)| name.as_str())
    }

    /// Returns the list to which a condition leads from the initial one; `None` if it leads to the initial or the ending list.
    fn goal_of_initial(&self, condition: &str) -> Option<usize> {
        let from = self.own_list(self.checked.initial);
        let line = self.verb.transitions.iter().find(|line| line.from == from && line.condition == condition)?;
        let to = self.verb.command_lists.get_index_of(&line.to)?;
        (to != self.checked.initial && self.checked.ending.list != Some(to)).then_some(to)
    }

    /// Returns a block condition on which the part leaves this list, and the list to which it leads.
    fn leaves(&self, list: usize) -> Option<(&str, &str)> {
        let from = self.own_list(list);
        let is_own = |name: &str| !SYSTEM.contains(&name) && !LIMITS.contains(&name);
        let line = self.verb.transitions.iter().find(|line| line.from == from && is_own(&line.condition))?;
        Some((&line.condition, &line.to))
    }

    /// Returns the table entries that end the part in a list: the normal ones or, if there are none (as in a list that follows a time
    /// limit), those that raise an exception.
    pub fn awaited(&self, list: usize) -> Vec<usize> {
        let ends = |at: &usize| {
            let (key, line) = self.verb.conditions.get_index(*at).expect("an index of the table");
            let name = self.verb.reported(key);
            let holds = self.checked.conditions[*at].planned.holds_in(list);
            holds && !line.on.is_empty() && self.ends(list, name) && self.can_come(list, name)
        };
        let all: Vec<usize> = (0..self.verb.conditions.len()).filter(ends).collect();
        let normal: Vec<usize> = all.iter().copied().filter(|at| !self.verb.conditions[*at].raises && self.verb.conditions[*at].returns.is_some()).collect();
        if normal.is_empty() && list != self.checked.initial { all } else { normal }
    }

    /// Returns the blocks that are still active at the end of a list.
    pub fn left_on(&self, list: usize) -> Vec<&String> {
        let commands = &self.verb.command_lists[list].commands;
        let off: HashSet<&String> =
            commands.iter().filter_map(|command| if let Command::Deactivate { block } = command { Some(block) } else { None }).collect();
        let on = commands.iter().filter_map(|command| if let Command::Activate { block, .. } = command { Some(block) } else { None });
        on.filter(|block| !off.contains(block)).collect()
    }

    fn runs_on(&self, list: usize) -> bool {
        !self.left_on(list).is_empty()
    }
}

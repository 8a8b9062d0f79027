// SPDX-License-Identifier: Apache-2.0
//! Joint lists: lists of several parts that `together` merges into one. These are the initial lists, and the lists to which one system
//! condition leads several parts.
//!
//! A condition leads to exactly the lists of the parts that have a transition for it. A part that a system condition ends on its own is
//! left out, while the others come to rest. A list may therefore be merged with several others, and also stand alone.
//!
//! If all parts are awaited, waits record which parts have ended: the list continues with one wait per part, each of which also accepts a
//! condition that occurred earlier. The list then deactivates the parts and is `completed`.
use super::part::{MERGED, PartOf};
use super::{Composing, Until};
use crate::conditions::{ENDS, SystemCondition, is_system};
use crate::definition::{Command, Transition};
use crate::refusal::Class;
use indexmap::IndexSet;
use std::collections::HashSet;

/// Maximum number of joint lists: the number of combinations grows exponentially if each part comes to rest in steps of its own.
const JOINTS_MAX: usize = 64;

/// A part and one of its lists.
pub(super) type ListOf = (usize, usize);

/// Lists of several parts that are merged into one.
#[derive(Clone)]
pub(super) struct Joint {
    pub name: String,
    pub lists: Vec<ListOf>,
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
        self.follow_conditions();
        if self.joints.len() > JOINTS_MAX {
            let message = format!("system conditions lead the parts to more than {JOINTS_MAX} combinations of their lists");
            return self.refuse(Class::CompositionConflict, message, "let the parts come to rest by the same conditions, or compose fewer of them", &None);
        }
        for joint in self.joints.clone().iter().filter(|joint| joint.all) {
            self.check_all(joint);
        }
    }

    /// Adds the lists to which conditions lead, from the initial one on, and records which of them only end the verb.
    fn follow_conditions(&mut self) {
        // A list that becomes part of a joint list is also led to where it was alone before.
        let seen = loop {
            let known = self.names().len();
            let seen = self.reach();
            if self.names().len() == known || self.joints.len() > JOINTS_MAX {
                break seen;
            }
        };
        let of = |ending: bool| seen.iter().filter(move |(_, is_ending)| *is_ending == ending).filter_map(|(lists, _)| self.name_of(lists));
        let work: IndexSet<String> = of(false).collect();
        let endings: IndexSet<String> = of(true).filter(|name| !work.contains(name)).collect();
        let is_reached = |name: &String| work.contains(name) || endings.contains(name);
        self.joints.retain(|joint| is_reached(&joint.name));
        for part in &mut self.parts {
            part.joint.values_mut().for_each(|names| names.retain(is_reached));
            part.joint.retain(|_, names| !names.is_empty());
        }
        self.only_ending = endings;
    }

    /// Returns the names of the joint lists, and of the lists that also stand alone.
    fn names(&self) -> HashSet<&String> {
        self.parts.iter().flat_map(|part| part.joint.values().flatten()).collect()
    }

    /// Follows all conditions from the initial list, adds the lists to which they lead, and returns the lists reached, each with true if
    /// it was reached after a condition that orders the verb to end.
    fn reach(&mut self) -> IndexSet<(Vec<ListOf>, bool)> {
        let mut seen = IndexSet::from([(self.joints[0].lists.clone(), false)]);
        let mut at = 0;
        while let Some((lists, is_ending)) = seen.get_index(at).cloned() {
            at += 1;
            if self.joints.len() > JOINTS_MAX {
                break;
            }
            for condition in self.conditions_of(&lists) {
                for next in self.next(&lists, &condition, is_ending) {
                    if self.name_of(&next).is_none() {
                        self.add(&next);
                    }
                    seen.insert((next, is_ending || ENDS.contains(&condition.as_str())));
                }
            }
        }
        seen
    }

    /// Adds a list that consists of exactly these lists.
    fn add(&mut self, lists: &[ListOf]) {
        let name = if let [(part, list)] = lists[..] { self.parts[part].alone(list) } else { self.joint_name(lists) };
        for (part, list) in lists {
            self.parts[*part].joint.entry(*list).or_default().push(name.clone());
        }
        if lists.len() > 1 {
            self.joints.push(Joint { name, lists: lists.to_vec(), all: true });
        }
    }

    /// Returns all conditions, by their names in the composed verb, for which a part has a transition from one of these lists.
    fn conditions_of(&self, lists: &[ListOf]) -> IndexSet<String> {
        let of = |&(part, list): &ListOf| {
            let of = &self.parts[part];
            let from = of.own_list(list);
            of.verb.transitions.iter().filter(move |line| line.from == from).map(|line| of.own(&line.condition).to_owned())
        };
        lists.iter().flat_map(of).collect()
    }

    /// Returns the lists to which a condition leads.
    fn next(&self, lists: &[ListOf], condition: &str, is_ending: bool) -> Vec<Vec<ListOf>> {
        if let Some(goals) = self.goals(lists, condition, is_ending) {
            return vec![goals];
        }
        let goals = lists.iter().filter_map(|(part, list)| Some((*part, self.parts[*part].goal(*list, condition, is_ending)?)));
        goals.map(|goal| self.alone(goal)).collect()
    }

    /// Returns the list to which a part leads the whole verb: back to the initial lists of all parts, or to a list of its own.
    fn alone(&self, (part, list): ListOf) -> Vec<ListOf> {
        if list == self.parts[part].checked.initial { self.joints[0].lists.clone() } else { vec![(part, list)] }
    }

    /// Returns exactly the lists to which a condition leads the parts that run. A part that a system condition leads nowhere continues
    /// with a list that brings it to rest, and is otherwise left out. `None` if the condition leads no part to another list, leads a part
    /// to a list that belongs to the whole verb (the ending list, or, unless the verb is ordered to end, the initial list), or is a
    /// different condition in each part.
    fn goals(&self, lists: &[ListOf], condition: &str, is_ending: bool) -> Option<Vec<ListOf>> {
        let keeps_braking = is_system(condition) && condition != SystemCondition::Completed.name();
        let is_back = |of: &PartOf<'_>, goal: usize| goal == of.checked.initial && !is_ending && !ENDS.contains(&condition);
        let mut goals = Vec::new();
        let mut leads = false;
        for &(part, list) in lists {
            let of = &self.parts[part];
            match of.goal(list, condition, is_ending) {
                Some(goal) if is_back(of, goal) || of.checked.ending.list == Some(goal) => return None,
                Some(goal) => {
                    goals.push((part, goal));
                    leads = true;
                }
                None if keeps_braking && !of.is_work(list) => goals.push((part, list)),
                None => {}
            }
        }
        // Conditions of several parts are the same event only if `completed` leads these parts to the same lists.
        let is_one = is_system(condition) || goals.len() < 2 || self.goals(lists, SystemCondition::Completed.name(), is_ending).as_ref() == Some(&goals);
        (leads && is_one).then_some(goals)
    }

    /// Returns the name of the list in the composed verb that consists of exactly these lists, if there is one.
    fn name_of(&self, lists: &[ListOf]) -> Option<String> {
        let joint = self.joints.iter().find(|joint| joint.lists == lists).map(|joint| joint.name.clone());
        let alone = |(part, list): ListOf| Some(self.parts[part].alone(list)).filter(|name| self.parts[part].lists_with(list).contains(name));
        joint.or_else(|| if let [single] = lists { alone(*single) } else { None })
    }

    /// Returns the transitions of the composed verb for a transition of a part: pairs of the list from which it leads and its target.
    pub fn targets(&self, part: usize, line: &Transition) -> Vec<(String, String)> {
        let of = &self.parts[part];
        let Some(list) = of.verb.command_lists.get_index_of(&line.from).filter(|_| self.of.together) else {
            return vec![(of.list_named(&line.from), of.list_named(&line.to))];
        };
        let target = |from: String| {
            let joint = self.joints.iter().find(|joint| joint.name == from);
            let running = joint.map_or_else(|| vec![(part, list)], |joint| joint.lists.clone());
            let is_ending = self.only_ending.contains(&from);
            let condition = of.own(&line.condition);
            let goal = of.goal(list, condition, is_ending)?;
            let goals = self.goals(&running, condition, is_ending).unwrap_or_else(|| self.alone((part, goal)));
            Some((from, self.name_of(&goals)?))
        };
        of.lists_with(list).into_iter().filter_map(target).collect()
    }

    fn joint_name(&self, lists: &[ListOf]) -> String {
        let mut names: Vec<String> = lists.iter().map(|(part, list)| self.parts[*part].own_list(*list).replace('.', "_")).collect();
        names.dedup();
        let first = names.join("_and_");
        let others = (2..).map(|number| format!("{first}_{number}"));
        let is_free = |name: &String| self.joints.iter().all(|joint| joint.name != *name);
        std::iter::once(first.clone()).chain(others).find(is_free).unwrap_or(first)
    }

    /// Refuses parts that never end in a list in which all parts are awaited, and parts that leave this list without the others.
    fn check_all(&mut self, joint: &Joint) {
        for &(part, list) in &joint.lists {
            let of = &self.parts[part];
            let described = of.described();
            if let Some((condition, to)) = of.leaves(list) {
                let (message, remedy) = if joint.name == MERGED {
                    let message = format!("all parts are awaited in '{MERGED}', but {described} proceeds to its list '{to}' on '{condition}'");
                    (message, "compose it so that it needs only one list, or leave until='all' out")
                } else {
                    let lists = joint.lists.iter().map(|(part, list)| format!("{}.{}", self.parts[*part].label, self.parts[*part].own_list(*list)));
                    let lists: Vec<String> = lists.collect();
                    let message = format!(
                        "the lists {} run together until all of them have ended, but {described} proceeds to its list '{to}' on '{condition}'",
                        lists.join(" and ")
                    );
                    (message, "let that list end the part, or let system conditions lead only one part to further lists")
                };
                self.refuse(Class::CompositionConflict, message, remedy, &None);
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
    /// Returns the list to which a condition, by its name in the composed verb, leads from another list. From the lists of an ending, only
    /// a condition that orders the verb to end leads to work.
    fn goal(&self, list: usize, condition: &str, is_ending: bool) -> Option<usize> {
        let from = self.own_list(list);
        let line = self.verb.transitions.iter().find(|line| line.from == from && self.own(&line.condition) == condition)?;
        let to = self.verb.command_lists.get_index_of(&line.to)?;
        (!is_ending || ENDS.contains(&condition) || !self.is_work(to)).then_some(to)
    }

    /// Returns a block condition on which the part leaves this list, and the list to which it leads.
    fn leaves(&self, list: usize) -> Option<(&str, &str)> {
        let (from, is_ending) = (self.own_list(list), !self.is_work(list));
        let leaves = |line: &&Transition| line.from == from && !is_system(&line.condition) && self.goal(list, self.own(&line.condition), is_ending).is_some();
        let line = self.verb.transitions.iter().find(leaves)?;
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

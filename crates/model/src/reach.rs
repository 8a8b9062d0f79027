// SPDX-License-Identifier: Apache-2.0
//! Reachability of the command lists of a definition. Before the verb runs, this finds lists that no transition leads to; waits,
//! conditions and transitions that depend on conditions no running block can report; and output values that no list produces.
use crate::conditions::CheckedCondition;
use crate::definition::Verb;
use crate::flatten::{Flat, Port};
use crate::interface::Kind;
use crate::lists::{CheckedCommand, CheckedList};
use crate::plan::{Remark, Wait};
use crate::refusal::{Class, Refusal, SourceLocation, Where};

/// Blocks and conditions of the lists, and the reachable lists.
struct Reach<'v> {
    verb: &'v Verb,
    lists: &'v [CheckedList],
    /// Blocks that each list activates or executes.
    runs: Vec<Vec<bool>>,
    reached: Vec<bool>,
    /// True if the verb has an entry or a transition for the condition `time_limit`. A condition that never occurs then only causes a
    /// remark, because the verb ends anyway.
    timed: bool,
}

/// Refuses conditions that can never occur, or only remarks on them if a time limit ends the verb; remarks on blocks that no list runs.
pub fn check_reach(
    flat: &mut Flat<'_>,
    verb: &Verb,
    lists: &[CheckedList],
    (initial, ending): (usize, Option<usize>),
    conditions: &[CheckedCondition],
    outputs: &[(String, Port)],
) -> Vec<Remark> {
    let timed = verb.conditions.keys().any(|key| verb.reported(key) == "time_limit") || verb.transitions.iter().any(|t| t.condition == "time_limit");
    let runs = lists.iter().map(|list| runs(list, flat.blocks.len())).collect();
    let reach = Reach { verb, lists, runs, reached: reached(lists.len(), [initial].into_iter().chain(ending), conditions), timed };
    let mut remarks = Vec::new();
    for (list, _) in reach.lists.iter().zip(&reach.reached).filter(|(_, reached)| !**reached) {
        let message = format!("the command list '{}' of verb '{}' is never reached from '{}'", list.name, verb.name, lists[initial].name);
        if flat.is_composed {
            // A composition may begin a part in the middle, while the part's verb keeps all its lists.
            remarks.push(Remark { text: message, place: list.place.clone() });
            continue;
        }
        flat.subject = Some(Where::List { list: list.name.clone() });
        flat.refuse(Class::DefinitionError, message, &list.place, "lead a transition to it, or leave it out");
    }
    reach.waits(flat, &mut remarks);
    reach.conditions(flat, conditions, &mut remarks);
    reach.outputs(flat, outputs, conditions);
    reach.idle_blocks(flat, &mut remarks);
    flat.subject = None;
    remarks
}

/// Returns the blocks that a list activates or executes.
fn runs(list: &CheckedList, blocks: usize) -> Vec<bool> {
    let mut runs = vec![false; blocks];
    for command in list.stages.iter().flat_map(|stage| &stage.commands) {
        mark(command, &mut runs);
    }
    runs
}

fn mark(command: &CheckedCommand, runs: &mut [bool]) {
    if let CheckedCommand::Activate { blocks, .. } | CheckedCommand::Execute { blocks, .. } = command {
        runs[blocks.clone()].fill(true);
    }
}

/// Returns the lists that can be reached from the initial one by transitions, and the ending list.
fn reached(lists: usize, begins: impl Iterator<Item = usize>, conditions: &[CheckedCondition]) -> Vec<bool> {
    let mut reached = vec![false; lists];
    let mut next: Vec<usize> = begins.collect();
    while let Some(list) = next.pop() {
        if std::mem::replace(&mut reached[list], true) {
            continue;
        }
        next.extend(conditions.iter().flat_map(|c| &c.transitions).filter(|(from, _)| *from == list).map(|(_, to)| *to));
    }
    reached
}

impl Reach<'_> {
    /// Refuses a wait that never ends: a block that reports one of its conditions must have run since the list began.
    fn waits(&self, flat: &mut Flat<'_>, remarks: &mut Vec<Remark>) {
        for list in self.lists {
            let mut begun = vec![false; flat.blocks.len()];
            for stage in &list.stages {
                stage.commands.iter().for_each(|command| mark(command, &mut begun));
                let Some(Wait::Conditions(ports)) = &stage.wait else { continue };
                if ports.is_empty() || ports.iter().any(|port| begun[port.0]) {
                    continue;
                }
                let message =
                    format!("command list '{}' waits for {}, but does not activate or execute {} first", list.name, names(flat, ports), labels(flat, ports));
                flat.subject = Some(Where::List { list: list.name.clone() });
                self.never(flat, message, &list.place, "activate it before the wait", remarks);
            }
        }
    }

    /// Refuses a condition or transition that no block can report in the lists in which it holds.
    fn conditions(&self, flat: &mut Flat<'_>, conditions: &[CheckedCondition], remarks: &mut Vec<Remark>) {
        for condition in conditions.iter().filter(|condition| !condition.planned.on.is_empty()) {
            let planned = &condition.planned;
            let reports = |list: usize| planned.on.iter().any(|port| self.runs[list][port.0]);
            let line = self.verb.conditions.iter().find(|(key, _)| self.verb.reported(key) == planned.name);
            flat.subject = line.map(|(key, _)| Where::Condition { condition: key.clone() });
            let place = line.and_then(|(_, termination)| termination.place.clone()).or_else(|| self.verb.place.clone());
            if !(0..self.lists.len()).filter(|list| planned.holds_in(*list)).any(reports) {
                let held: Vec<&str> = planned.during.iter().map(|list| self.lists[*list].name.as_str()).collect();
                let (within, verb) = match held[..] {
                    [] => ("no command list".to_owned(), "activates or executes"),
                    [list] => (format!("the command list '{list}' does not"), "activate or execute"),
                    _ => (format!("the command lists '{}' do not", held.join("', '")), "activate or execute"),
                };
                let message =
                    format!("the condition '{}' stands for {}, but {within} {verb} {}", planned.name, names(flat, &planned.on), labels(flat, &planned.on));
                self.never(flat, message, &place, "activate it in a list where the condition holds, or leave the condition out", remarks);
                continue;
            }
            for &(from, to) in condition.transitions.iter().filter(|(from, _)| !reports(*from)) {
                let message = format!(
                    "the transition ('{}', '{}') → '{}' is never taken: '{}' does not activate or execute {}",
                    self.lists[from].name,
                    planned.name,
                    self.lists[to].name,
                    self.lists[from].name,
                    labels(flat, &planned.on)
                );
                flat.subject = Some(Where::Transition { transition: (self.lists[from].name.clone(), planned.name.clone()) });
                self.never(flat, message, &self.transition_place(from, &planned.name), "activate it there, or leave the transition out", remarks);
            }
        }
    }

    fn transition_place(&self, from: usize, condition: &str) -> Option<SourceLocation> {
        let transition = self.verb.transitions.iter().find(|t| t.from == self.lists[from].name && t.condition == condition);
        transition.and_then(|t| t.place.clone()).or_else(|| self.verb.place.clone())
    }

    /// Refuses an output value that a condition returns from a block that never runs.
    fn outputs(&self, flat: &mut Flat<'_>, outputs: &[(String, Port)], conditions: &[CheckedCondition]) {
        for (at, (name, port)) in outputs.iter().enumerate() {
            let returned = conditions.iter().any(|condition| condition.planned.returns.contains(&at));
            if returned && matches!(flat.item_kind(*port), Kind::Output | Kind::Condition) && !self.runs.iter().any(|runs| runs[port.0]) {
                flat.subject = Some(Where::Output { output: name.clone() });
                let described = flat.described(*port);
                let message = format!("the output value '{name}' reads {described}, but no command list activates or executes {}", labels(flat, &[*port]));
                flat.refuse(Class::DefinitionError, message, &self.verb.place, "activate or execute it, or leave the output value out");
            }
        }
    }

    /// Remarks on a block that no list runs. It has no effect, which may be intended while a verb is being written.
    fn idle_blocks(&self, flat: &Flat<'_>, remarks: &mut Vec<Remark>) {
        for (at, block) in flat.blocks.iter().enumerate() {
            if !self.runs.iter().any(|runs| runs[at]) {
                let text = format!("the block '{}' is in no command list: it never runs", block.label);
                remarks.push(Remark { text, place: block.place.clone() });
            }
        }
    }

    /// Refuses a condition that never occurs; only remarks on it if a time limit ends the verb.
    fn never(&self, flat: &mut Flat<'_>, message: String, place: &Option<SourceLocation>, remedy: &str, remarks: &mut Vec<Remark>) {
        if self.timed {
            remarks.push(Remark { text: format!("{message}; only the time limit ends it"), place: place.clone() });
        } else {
            flat.push(Refusal::new(Class::SchedulingError, message).remedy(remedy).at(place));
        }
    }
}

/// Returns the names of ports for messages: `'near.done'`, or several names.
fn names(flat: &Flat<'_>, ports: &[Port]) -> String {
    let names: Vec<String> = ports.iter().map(|port| format!("'{}'", flat.port_name(*port))).collect();
    names.join(" or ")
}

/// Returns the distinct labels of the blocks of these ports.
fn labels(flat: &Flat<'_>, ports: &[Port]) -> String {
    let mut labels: Vec<String> = ports.iter().map(|port| format!("'{}'", flat.blocks[port.0].label)).collect();
    labels.dedup();
    labels.join(" or ")
}

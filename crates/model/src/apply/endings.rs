// SPDX-License-Identifier: Apache-2.0
//! The state of ending, in the command lists of a plan. A halt, an abort, a time limit or a loss leads on to lists that bring the verb to
//! its end; from there no transition leads back to the work of the verb.
//!
//! *Work* are the lists that the initial one leads to by other conditions. A list that is work and also follows such a condition is in the
//! plan twice, so that kernels and supervisor need no further state: its copy has the transitions of an ending.
use crate::conditions::{CheckedCondition, ENDS};
use crate::plan::PlannedList;
use std::collections::{BTreeSet, HashMap};

/// Takes the transitions to work from the lists that follow the beginning of an end, and copies the lists that are both.
pub(super) fn keep_endings(lists: &mut Vec<PlannedList>, initial: usize, conditions: &[CheckedCondition]) {
    let begins: Vec<bool> = conditions.iter().map(|condition| ENDS.contains(&condition.planned.name.as_str())).collect();
    let work = work(lists, initial, &begins);
    let ending = ending(lists, &work, &begins);
    if ending.is_empty() {
        return;
    }
    let mut copies: HashMap<usize, usize> = HashMap::new();
    for &list in ending.intersection(&work) {
        copies.insert(list, lists.len());
        lists.push(PlannedList { copy_of: Some(list), ..lists[list].clone() });
    }
    let declared = lists.clone();
    for (at, list) in lists.iter_mut().enumerate() {
        let of = declared[at].copy_of.unwrap_or(at);
        let ends = declared[at].copy_of.is_some() || !work.contains(&at) && ending.contains(&at);
        if ends {
            let cut = |line: &(usize, usize)| !leads_on(&declared, &work, &begins, of, *line);
            list.cut = list.transitions.iter().filter(|line| cut(line)).map(|line| line.0).collect();
            list.transitions.retain(|line| !cut(line));
        }
        for (condition, to) in &mut list.transitions {
            if ends || begins[*condition] {
                *to = copies.get(to).copied().unwrap_or(*to);
            }
        }
    }
}

/// Returns the lists that the initial one leads to while nothing has told the verb to end.
fn work(lists: &[PlannedList], initial: usize, begins: &[bool]) -> BTreeSet<usize> {
    let (mut found, mut next) = (BTreeSet::new(), vec![initial]);
    while let Some(list) = next.pop() {
        if found.insert(list) {
            next.extend(lists[list].transitions.iter().filter(|(condition, _)| !begins[*condition]).map(|(_, to)| *to));
        }
    }
    found
}

/// Returns the lists that run after something has told the verb to end.
fn ending(lists: &[PlannedList], work: &BTreeSet<usize>, begins: &[bool]) -> BTreeSet<usize> {
    let first = work.iter().flat_map(|list| &lists[*list].transitions).filter(|(condition, _)| begins[*condition]);
    let (mut found, mut next) = (BTreeSet::new(), first.map(|(_, to)| *to).collect::<Vec<usize>>());
    while let Some(list) = next.pop() {
        if found.insert(list) {
            next.extend(lists[list].transitions.iter().filter(|line| leads_on(lists, work, begins, list, **line)).map(|(_, to)| *to));
        }
    }
    found
}

/// Returns true for a transition that is made although the verb is ending: to a list that is no work, or, by a further condition that
/// tells it to end, to one of the same part.
fn leads_on(lists: &[PlannedList], work: &BTreeSet<usize>, begins: &[bool], from: usize, (condition, to): (usize, usize)) -> bool {
    if begins[condition] { are_of_one_part(&lists[from].name, &lists[to].name) } else { !work.contains(&to) }
}

/// Returns true if one of the two lists belongs to the part of a composed verb that the other one belongs to.
fn are_of_one_part(one: &str, other: &str) -> bool {
    let part = |list: &str| list.rsplit_once('.').map_or(String::new(), |(part, _)| format!("{part}."));
    let (one, other) = (part(one), part(other));
    one.starts_with(&other) || other.starts_with(&one)
}

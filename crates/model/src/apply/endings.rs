// SPDX-License-Identifier: Apache-2.0
//! Ending of a verb, expressed in the command lists of its plan. A halt, an abort, a time limit or a loss leads to lists that end the
//! verb; from these lists, no transition leads back to the work of the verb.
//!
//! *Work* is the set of lists that can be reached from the initial list by other conditions. A list that is work and also follows an
//! ending condition is duplicated in the plan, so that kernels and supervisor need no additional state: the copy has only the transitions
//! of an ending.
use crate::conditions::{CheckedCondition, ENDS};
use crate::plan::PlannedList;
use std::collections::{BTreeSet, HashMap};

/// Removes the transitions back to work from the lists of an ending, and duplicates the lists that belong to both work and an ending.
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

/// Returns the lists that can be reached from the initial one while the verb is not ending.
fn work(lists: &[PlannedList], initial: usize, begins: &[bool]) -> BTreeSet<usize> {
    let (mut found, mut next) = (BTreeSet::new(), vec![initial]);
    while let Some(list) = next.pop() {
        if found.insert(list) {
            next.extend(lists[list].transitions.iter().filter(|(condition, _)| !begins[*condition]).map(|(_, to)| *to));
        }
    }
    found
}

/// Returns the lists that run after a condition has started the ending of the verb.
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

/// Returns true if an ending verb keeps a transition: one to a list that is not work, or one on a further ending condition within the
/// same part.
fn leads_on(lists: &[PlannedList], work: &BTreeSet<usize>, begins: &[bool], from: usize, (condition, to): (usize, usize)) -> bool {
    if begins[condition] { are_of_one_part(&lists[from].name, &lists[to].name) } else { !work.contains(&to) }
}

/// Returns true if two lists belong to the same part of a composed verb, or if the part of one contains the part of the other.
fn are_of_one_part(one: &str, other: &str) -> bool {
    let part = |list: &str| list.rsplit_once('.').map_or(String::new(), |(part, _)| format!("{part}."));
    let (one, other) = (part(one), part(other));
    one.starts_with(&other) || other.starts_with(&one)
}

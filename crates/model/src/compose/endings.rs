// SPDX-License-Identifier: Apache-2.0
//! How a composed verb ends and is suspended: as the one part does that says so. Two that say different things are a conflict.
use super::Composing;
use crate::definition::Suspend;
use crate::refusal::Class;

impl Composing<'_> {
    /// The ending list and the way to be suspended.
    pub fn endings(&mut self) {
        let (mut ending, mut suspend): (Option<usize>, Option<usize>) = (None, None);
        for part in 0..self.parts.len() {
            let verb = self.parts[part].verb;
            match ending {
                Some(first) if verb.ending.is_some() => {
                    let message = format!("{} both have an ending list, and a verb has one", self.both(first, part));
                    self.conflict(Class::CompositionConflict, message, "leave one out, and let τ of its part do that", (first, part));
                }
                _ => ending = ending.or(verb.ending.as_ref().map(|_| part)),
            }
            match suspend {
                Some(first) if verb.suspend != Suspend::Hold && (verb.suspend != Suspend::Safe || self.parts[first].verb.suspend != Suspend::Safe) => {
                    let message = format!("{} are suspended in two ways", self.both(first, part));
                    self.conflict(Class::CompositionConflict, message, "leave suspend= out in one of them", (first, part));
                }
                _ => suspend = suspend.or((verb.suspend != Suspend::Hold).then_some(part)),
            }
        }
        if let Some(part) = ending.map(|part| &self.parts[part]) {
            self.verb.ending = part.verb.ending.as_ref().map(|list| part.list_named(list));
        }
        if let Some(part) = suspend.map(|part| &self.parts[part]) {
            self.verb.suspend = match &part.verb.suspend {
                Suspend::Holding { set, until } => Suspend::Holding { set: part.port(set), until: part.port(until) },
                plain => plain.clone(),
            };
        }
    }
}

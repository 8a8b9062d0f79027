// SPDX-License-Identifier: Apache-2.0
//! Ending, suspension and cut-off reaction of a composed verb. Each is taken from the only part that declares it. Parts that declare
//! their own way of coming to rest keep it in the composition. Any other difference between the declarations of two parts is a conflict.
use super::Composing;
use crate::definition::{Holding, Suspend};
use crate::refusal::Class;
use std::mem::discriminant;

impl Composing<'_> {
    /// Combines the ending lists, the kinds of suspension, and the reactions to a cut-off of the programming system.
    pub fn endings(&mut self) {
        self.cut_off();
        let (mut ending, mut suspend): (Option<usize>, Option<usize>) = (None, None);
        for part in 0..self.parts.len() {
            let verb = self.parts[part].verb;
            match ending {
                Some(first) if verb.ending.is_some() => {
                    let message = format!("{} both have an ending list, but a verb has only one", self.both(first, part));
                    self.conflict(Class::CompositionConflict, message, "leave one out, and let τ of its part do its work", (first, part));
                }
                _ => ending = ending.or(verb.ending.as_ref().map(|_| part)),
            }
            match suspend {
                Some(first) if verb.suspend != Suspend::Idle && discriminant(&verb.suspend) != discriminant(&self.parts[first].verb.suspend) => {
                    let message = format!("{} are suspended in different ways", self.both(first, part));
                    self.conflict(Class::CompositionConflict, message, "leave suspend= out in one of them", (first, part));
                }
                _ => suspend = suspend.or((verb.suspend != Suspend::Idle).then_some(part)),
            }
        }
        if let Some(part) = ending.map(|part| &self.parts[part]) {
            self.verb.ending = part.verb.ending.as_ref().map(|list| part.list_named(list));
        }
        let ways = self.parts.iter().flat_map(|part| {
            let of = if let Suspend::Holding(of) = &part.verb.suspend { of.as_slice() } else { &[] };
            of.iter().map(|way| Holding { set: part.port(&way.set), until: part.port(&way.until) })
        });
        self.verb.suspend = match suspend.map(|part| &self.parts[part].verb.suspend) {
            Some(Suspend::Holding(_)) => Suspend::Holding(ways.collect()),
            Some(plain) => plain.clone(),
            None => Suspend::Idle,
        };
    }
}

impl Composing<'_> {
    /// Combines the parts' reactions to a cut-off of the programming system; a part that declares none is compatible with any.
    fn cut_off(&mut self) {
        let mut says: Option<usize> = None;
        for part in 0..self.parts.len() {
            let Some(policy) = self.parts[part].verb.if_cut_off else { continue };
            match says {
                Some(first) if self.parts[first].verb.if_cut_off != Some(policy) => {
                    let message = format!("{} do different things when the programming system is cut off", self.both(first, part));
                    self.conflict(Class::CompositionConflict, message, "leave if_cut_off= out in one of them", (first, part));
                }
                _ => says = says.or(Some(part)),
            }
        }
        self.verb.if_cut_off = says.and_then(|part| self.parts[part].verb.if_cut_off);
    }
}

// SPDX-License-Identifier: Apache-2.0
//! Where the hot loop may go over to one entry for several steps of a strip: a bank, of blocks that have one entry, or fused blocks.
use crate::containment::Call;
pub(crate) use opengpac::bank::Bank;
use std::ops::Range;
use std::ptr::fn_addr_eq;

/// Fewer are run one by one: what the call of a bank entry costs is then more than what it saves.
const BANK_MIN: usize = 4;

/// A maximal run of steps with one activation.
#[derive(Clone, Copy)]
pub(crate) struct Strip {
    pub slot: u32,
    pub start: u32,
    pub end: u32,
}

/// Steps of one strip with one entry, or what lies between two.
#[derive(Clone, Copy)]
pub(crate) struct Stretch {
    pub slot: u32,
    pub start: u32,
    pub end: u32,
    pub entry: Entry,
}

/// Entry that runs a run of steps.
#[derive(Clone, Copy)]
pub(crate) enum Entry {
    /// Each block by its own entry.
    Single,
    /// Runs any of them, in order.
    Bank(Bank),
    /// Runs all of them, from the first on, or none.
    Fused(Bank),
}

/// Fused steps: where they begin and end, and their entry.
pub(crate) type FusedSteps = (Range<u32>, Bank);

/// Cuts strips at what is fused, and what lies between at its banks. A block that is watched has an entry of its own and is in none. Off the
/// real-time path.
pub(crate) fn stretches(strips: &[Strip], calls: &[Call], fused: &[FusedSteps]) -> Vec<Stretch> {
    let mut stretches: Vec<Stretch> = Vec::with_capacity(strips.len());
    for strip in strips {
        let mut start = strip.start;
        for (steps, entry) in fused.iter().filter(|(steps, _)| (strip.start..strip.end).contains(&steps.start)) {
            banks(&mut stretches, Strip { start, end: steps.start, ..*strip }, calls);
            stretches.push(Stretch { slot: strip.slot, start: steps.start, end: steps.end, entry: Entry::Fused(*entry) });
            start = steps.end;
        }
        banks(&mut stretches, Strip { start, ..*strip }, calls);
    }
    stretches
}

fn banks(stretches: &mut Vec<Stretch>, strip: Strip, calls: &[Call]) {
    let begun = stretches.len();
    let mut start = strip.start;
    for alike in calls[strip.start as usize..strip.end as usize].chunk_by(|one, next| fn_addr_eq(one.run, next.run)) {
        let end = start + alike.len() as u32;
        let bank = if alike.len() < BANK_MIN { None } else { opengpac::bank::of(alike[0].run) };
        match (stretches[begun..].last_mut(), bank) {
            (Some(before), None) if matches!(before.entry, Entry::Single) => before.end = end,
            (_, bank) => stretches.push(Stretch { slot: strip.slot, start, end, entry: bank.map_or(Entry::Single, Entry::Bank) }),
        }
        start = end;
    }
}

// SPDX-License-Identifier: Apache-2.0
//! Selection of entries that run several steps of a strip in one call: banks (blocks that share an entry) and fused blocks.
use crate::containment::Call;
pub(crate) use opengpac::bank::Bank;
use std::ops::Range;
use std::ptr::fn_addr_eq;

/// Minimum number of blocks in a bank: below it, calling the bank entry costs more than it saves.
const BANK_MIN: usize = 4;

/// A maximal run of steps with one activation.
#[derive(Clone, Copy)]
pub(crate) struct Strip {
    pub slot: u32,
    pub start: u32,
    pub end: u32,
}

/// Adjacent steps of one strip, and the entry that runs them.
#[derive(Clone, Copy)]
pub(crate) struct Stretch {
    pub slot: u32,
    pub start: u32,
    pub end: u32,
    pub entry: Entry,
}

/// Entry that runs adjacent steps.
#[derive(Clone, Copy)]
pub(crate) enum Entry {
    /// Runs each block through its own entry.
    Single,
    /// Runs any subset of the steps, in order, in one call.
    Bank(Bank),
    /// Runs all steps in one call, provided that the first of them is due to run; otherwise, no step is run through this entry.
    Fused(Bank),
}

/// Range of fused steps, with their entry.
pub(crate) type FusedSteps = (Range<u32>, Bank);

/// Splits strips into fused steps, banks and single steps. Watched blocks have their own entries and are never part of a bank or fusion.
/// Off the real-time path.
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

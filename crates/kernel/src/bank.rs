// SPDX-License-Identifier: Apache-2.0
//! Where the hot loop may go over to a bank entry: consecutive steps of one strip whose blocks have one entry.
use crate::containment::Call;
pub(crate) use opengpac::bank::Bank;
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

/// Steps of one strip: a bank, or what lies between two.
#[derive(Clone, Copy)]
pub(crate) struct Stretch {
    pub slot: u32,
    pub start: u32,
    pub end: u32,
    pub bank: Option<Bank>,
}

/// Cuts strips at their banks. A block that is watched has an entry of its own and is in none. Off the real-time path.
pub(crate) fn stretches(strips: &[Strip], calls: &[Call]) -> Vec<Stretch> {
    let mut stretches: Vec<Stretch> = Vec::with_capacity(strips.len());
    for strip in strips {
        let begun = stretches.len();
        let mut start = strip.start;
        for alike in calls[strip.start as usize..strip.end as usize].chunk_by(|one, next| fn_addr_eq(one.run, next.run)) {
            let end = start + alike.len() as u32;
            let bank = if alike.len() < BANK_MIN { None } else { opengpac::bank::of(alike[0].run) };
            match stretches[begun..].last_mut() {
                Some(before) if before.bank.is_none() && bank.is_none() => before.end = end,
                _ => stretches.push(Stretch { slot: strip.slot, start, end, bank }),
            }
            start = end;
        }
    }
    stretches
}

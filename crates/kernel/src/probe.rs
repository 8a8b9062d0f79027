// SPDX-License-Identifier: Apache-2.0
//! Block times: a probe that visits one block a firing. Looking costs three clock reads a firing instead of two a step, and where
//! nobody looks one comparison a firing.
use crate::NO_STEP;
use crate::clock::monotonic_ns;
use crate::source::add;
use crate::table::Table;
use std::sync::atomic::{AtomicU64, Ordering};

/// How long those invocations of a block took that the probe visited: ns of real time, whatever clock the system lives by, without
/// what reading the clock takes. What preempted an invocation counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct BlockTimes {
    /// Invocations that were visited since the block was installed.
    pub samples: u64,
    /// The latest of them.
    pub last_ns: u64,
    /// The longest.
    pub max_ns: u64,
    /// All together.
    pub sum_ns: u64,
    /// Its invocations since it was started, at the latest visit: two looks tell its rate.
    pub number: u64,
}

/// Of one block; written by the kernel of its source alone, with plain stores.
#[derive(Default)]
pub(crate) struct Times {
    samples: AtomicU64,
    last_ns: AtomicU64,
    max_ns: AtomicU64,
    sum_ns: AtomicU64,
    number: AtomicU64,
}

impl Times {
    fn add(&self, ns: u64, number: u64) {
        self.number.store(number, Ordering::Relaxed);
        self.last_ns.store(ns, Ordering::Relaxed);
        if ns > self.max_ns.load(Ordering::Relaxed) {
            self.max_ns.store(ns, Ordering::Relaxed);
        }
        add(&self.sum_ns, ns);
        add(&self.samples, 1);
    }

    pub(crate) fn read(&self) -> BlockTimes {
        let load = |counter: &AtomicU64| counter.load(Ordering::Relaxed);
        BlockTimes {
            samples: load(&self.samples),
            last_ns: load(&self.last_ns),
            max_ns: load(&self.max_ns),
            sum_ns: load(&self.sum_ns),
            number: load(&self.number),
        }
    }
}

/// Where the probe goes in a table.
#[derive(Default)]
pub(crate) struct Visits {
    turn: u64,
    strips: Vec<Visit>,
}

/// In one strip: the turn of the last visit, and the block that is next.
struct Visit {
    turn: u64,
    next: u32,
}

impl Table {
    /// Begins with the first block of each strip.
    pub(crate) fn index_visits(&mut self) {
        let first = |(start, end)| self.block_step(start, end).unwrap_or(NO_STEP);
        let strips = self.strips.iter().map(|strip| Visit { turn: 0, next: first((strip.start, strip.end)) }).collect();
        self.visits = Visits { turn: 0, strips };
    }

    /// The step to be visited in this firing: the next block of that strip which is due and was not visited for the longest time. So
    /// one that is seldom due is visited when it is. `NO_STEP` where no block is due.
    pub(crate) fn visit(&mut self) -> u32 {
        let due = self.strips.iter().zip(&self.visits.strips).enumerate().filter(|(_, (strip, visit))| visit.next != NO_STEP && self.due[strip.slot as usize]);
        let Some((index, _)) = due.min_by_key(|(_, (_, visit))| visit.turn) else { return NO_STEP };
        let (strip, step) = (self.strips[index], self.visits.strips[index].next);
        let next = self.block_step(step + 1, strip.end).or_else(|| self.block_step(strip.start, strip.end)).unwrap_or(step);
        self.visits.turn += 1;
        self.visits.strips[index] = Visit { turn: self.visits.turn, next };
        step
    }

    /// The first step of these that is a block.
    fn block_step(&self, start: u32, end: u32) -> Option<u32> {
        (start..end).find(|&step| self.steps[step as usize].block.is_some())
    }

    /// Runs one step and takes its time.
    ///
    /// # Safety
    /// As for the hot loop: a step of the table that is in force, called by the kernel of its source.
    #[inline(never)]
    pub(crate) unsafe fn run_timed(table: *mut Table, step: u32) -> u64 {
        // SAFETY: the caller's.
        unsafe {
            let call = (&(*table).calls)[step as usize];
            let (before_ns, start_ns) = (monotonic_ns(), monotonic_ns());
            let result = (call.run)(call.instance, call.invocation);
            let taken_ns = monotonic_ns() - start_ns - (start_ns - before_ns);
            if let Some(block) = &(&(*table).steps)[step as usize].block {
                block.times().add(taken_ns.max(0) as u64, (*block.header()).number);
            }
            result
        }
    }
}

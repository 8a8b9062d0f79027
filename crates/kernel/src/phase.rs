// SPDX-License-Identifier: Apache-2.0
//! Numbering of an activation's invocations, counted by its own kernel and used by connections.

/// An activation with numbered invocations.
pub trait CountedInvocations {
    /// Returns the state that changes while it runs. Only the kernel of its source uses the pointer.
    fn state(&self) -> *mut State;
}

/// State that changes while it runs.
#[derive(Default)]
pub struct State {
    pub(crate) on: bool,
    pub(crate) due: bool,
    pub(crate) every: u32,
    /// Interval set at run time; 0: the declared one applies.
    pub(crate) tuned: u32,
    /// Next firing at which an interval is due.
    pub(crate) next: u64,
    /// Number of the next invocation, or of the current one in a firing in which it is due.
    pub number: u64,
    /// Value of `number` when it was switched on.
    pub activated: u64,
    /// Number of invocations skipped with the releases before this firing.
    pub(crate) missed: u64,
    /// Sequence number of the last value taken from each queue member.
    pub(crate) had: Box<[u64]>,
    /// Index in the table in force.
    pub slot: u32,
}

/// Size of a stamp in bytes.
pub const STAMP_LEN: usize = 24;

/// Returns true if a ratio output n is stored on the invocation that follows `phase` others since activation: on the nth, the 2nth, …, as
/// the entries of blocks do.
#[inline]
pub fn stores(phase: u64, n: u32) -> bool {
    n <= 1 || (phase + 1).is_multiple_of(u64::from(n))
}

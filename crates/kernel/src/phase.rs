// SPDX-License-Identifier: Apache-2.0
//! Where in its numbers an activation is: what its own kernel counts, and connections go by.

/// Something whose invocations have numbers.
pub trait CountedInvocations {
    /// Returns the state that changes while it runs. The pointer is used by the kernel of its source alone.
    fn state(&self) -> *mut State;
}

/// State that changes while it runs.
#[derive(Default)]
pub struct State {
    pub(crate) on: bool,
    pub(crate) due: bool,
    pub(crate) every: u32,
    /// The interval that was set while it ran; 0: it has the declared one.
    pub(crate) tuned: u32,
    /// The next firing at which an interval is due.
    pub(crate) next: u64,
    /// Number of the next invocation, or of the present one in a firing in which it is due.
    pub number: u64,
    /// `number` when it was switched on.
    pub activated: u64,
    /// Invocations that were skipped with the releases before this firing.
    pub(crate) missed: u64,
    /// For each queue member, the sequence of the value that it had last.
    pub(crate) had: Box<[u64]>,
    /// Its place in the table that is in force.
    pub slot: u32,
}

/// Bytes of a stamp.
pub const STAMP_LEN: usize = 24;

/// Returns true if a ratio output n is stored on the invocation that follows `phase` others since activation: on the nth, the
/// 2nth, … as the entries of blocks do it.
#[inline]
pub fn stores(phase: u64, n: u32) -> bool {
    n <= 1 || (phase + 1).is_multiple_of(u64::from(n))
}

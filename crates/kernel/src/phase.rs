// SPDX-License-Identifier: Apache-2.0
//! Numbering of an activation's invocations, counted by its own kernel and used by connections.

/// An activation whose invocations are numbered.
pub trait CountedInvocations {
    /// Returns the run-time state of the activation. Only the kernel of its source may use the pointer.
    fn state(&self) -> *mut State;
}

/// Run-time state of an activation.
#[derive(Default)]
pub struct State {
    pub(crate) on: bool,
    pub(crate) due: bool,
    pub(crate) every: u32,
    /// Interval set at run time; 0 if the declared one applies.
    pub(crate) tuned: u32,
    /// Next firing in which the activation is due, if it has an interval.
    pub(crate) next: u64,
    /// Number of the current invocation if the activation is due in this firing, otherwise of the next one.
    pub number: u64,
    /// Value of `number` when the activation was switched on.
    pub activated: u64,
    /// Number of invocations skipped at the missed releases before this firing.
    pub(crate) missed: u64,
    /// Sequence number of the last value taken from each queue member.
    pub(crate) had: Box<[u64]>,
    /// Index of the activation in the table in force.
    pub slot: u32,
}

/// Size of a stamp in bytes.
pub const STAMP_LEN: usize = 24;

/// Returns true if a ratio output n is stored by invocation `phase` since activation, counted from 0. The output is stored by the
/// invocations n, 2n, …, as in the entries of blocks.
#[inline]
pub fn stores(phase: u64, n: u32) -> bool {
    n <= 1 || (phase + 1).is_multiple_of(u64::from(n))
}

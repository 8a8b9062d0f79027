// SPDX-License-Identifier: Apache-2.0
//! Points of a firing at which it may be preempted under the virtual clock. Real threads are preempted by the operating system: nothing here
//! costs them anything.

/// Called at the points of a firing between which it is one piece: between latches, between steps, inside publications.
pub trait Preempt {
    /// False where no point ever does anything: the compiler leaves them out.
    const POSSIBLE: bool;
    /// Runs whatever preempts here.
    fn point(&self);
}

/// Point at which nothing preempts.
pub struct Never;

impl Preempt for Never {
    const POSSIBLE: bool = false;
    #[inline]
    fn point(&self) {}
}

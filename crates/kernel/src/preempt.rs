// SPDX-License-Identifier: Apache-2.0
//! Points of a firing at which it may be preempted under the virtual clock. Real threads are preempted by the operating system and pay
//! nothing for these points.

/// Hook called at the preemption points of a firing: between latches, between steps, inside publications.
pub trait Preempt {
    /// False if no point ever does anything, so that the compiler removes them.
    const POSSIBLE: bool;
    /// Runs whatever preempts here.
    fn point(&self);
}

/// Never preempts.
pub struct Never;

impl Preempt for Never {
    const POSSIBLE: bool = false;
    #[inline]
    fn point(&self) {}
}

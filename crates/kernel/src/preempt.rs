// SPDX-License-Identifier: Apache-2.0
//! Points of a firing at which it may be preempted under the virtual clock. Real threads are preempted by the operating system, so these
//! points cost them nothing.

/// Hook called at the preemption points of a firing: between latches, between steps, inside publications.
pub trait Preempt {
    /// False if the hook never acts, so that the compiler removes the points.
    const POSSIBLE: bool;
    /// Runs the firings that preempt at this point.
    fn point(&self);
}

/// Hook that never preempts.
pub struct Never;

impl Preempt for Never {
    const POSSIBLE: bool = false;
    #[inline]
    fn point(&self) {}
}

// SPDX-License-Identifier: Apache-2.0
//! Interface that the author of a block writes, and that the derive completes.

use crate::abi::{Descriptor, Invocation, TypeDescriptor};

/// Result of an invocation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[must_use]
pub enum Outcome {
    /// Success: outputs and state are stored, reports count.
    Done,
    /// A fault with a code of the block's own: nothing is stored, the state stays as it was, and the block's verb gets the
    /// condition `fault`.
    Fault(u32),
}

/// The body of a function block.
pub trait Step {
    /// Runs one invocation on a copy of the items. Called on the real-time path: it may not block, allocate or wait. A panic in
    /// it is a fault.
    fn step(&mut self, invocation: &Invocation) -> Outcome;
}

/// A function block: what `#[derive(FunctionBlock)]` implements.
pub trait FunctionBlock: Step {
    /// Everything about the block; made once, it lives as long as the process. Not for the real-time path.
    fn descriptor() -> &'static Descriptor;
    /// The struct types of its items, each once, a member's type before the struct that has it.
    fn types() -> Vec<&'static TypeDescriptor>;
}

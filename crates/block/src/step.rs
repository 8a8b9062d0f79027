// SPDX-License-Identifier: Apache-2.0
//! Interface that the author of a block implements, and that the derive macro completes.

use crate::abi::{Descriptor, Invocation, TypeDescriptor};

/// Result of an invocation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[must_use]
pub enum Outcome {
    /// Success: outputs and state are stored, and the reported conditions count.
    Done,
    /// A fault with a code defined by the block: nothing is stored, the state is unchanged, and the block's verb receives the condition
    /// `fault`.
    Fault(u32),
}

/// The body of a function block.
pub trait Step {
    /// Runs one invocation on a copy of the items. Called on the real-time path: must not block, allocate or wait. A panic is a fault.
    fn step(&mut self, invocation: &Invocation) -> Outcome;
}

/// A function block, implemented by `#[derive(FunctionBlock)]`.
pub trait FunctionBlock: Step {
    /// Returns the description of the block, which is created once and lives as long as the process. Not for the real-time path.
    fn descriptor() -> &'static Descriptor;
    /// Returns the struct types of the block's items, each once, and each after the types of its members.
    fn types() -> Vec<&'static TypeDescriptor>;
}

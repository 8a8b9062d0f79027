// SPDX-License-Identifier: Apache-2.0
//! Outcome of a seed.
use crate::broken::BrokenInvariant;

/// A violated invariant, with the events that led to it.
#[derive(Clone, Debug)]
pub struct Failure {
    pub seed: u64,
    pub broken: BrokenInvariant,
    /// Indices of the executed operations in the seed's list.
    pub kept: Vec<usize>,
    pub story: Vec<String>,
}

/// Outcome of a seed.
#[derive(Clone, Debug, Default)]
pub struct Outcome {
    pub failure: Option<Failure>,
    pub operations: usize,
    pub accepted: usize,
    pub refused: usize,
    pub starts: u64,
    /// Elapsed time on the system's clock.
    pub virtual_ns: i64,
    pub story: Vec<String>,
}

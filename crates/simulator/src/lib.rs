// SPDX-License-Identifier: Apache-2.0
//! The simulator: a whole system in one process under the virtual clock, and one seed that says everything that happens to it.
//!
//! ```text
//! seed ──► program   processors, sources, a plant, SVVs, devices, verbs over a family of blocks whose values can be judged
//!      ──► operations   what callers command, what time brings, what goes wrong: links, plant, sources, stops
//!                          │ one after the other
//!                          ▼
//!        world   the system, and what is known of it from outside (lives, claims, what went out to the plant)
//!                          │ after each
//!                          ▼
//!        invariants   each with a name; the first that does not hold ends the run
//!                          │ a failure
//!                          ▼
//!        shrink   operations are left out as long as the same invariant breaks ──► report
//! ```
pub mod blocks;
pub mod broken;
mod churn;
mod crashing;
pub mod door;
mod finale;
pub mod invariants;
pub mod lives;
pub mod memory;
mod operate;
pub mod operations;
mod outcome;
pub mod plant;
pub mod program;
pub mod run;
pub mod seed;
pub mod shrink;
mod watching;
pub mod world;

pub use outcome::{Failure, Outcome};
pub use run::run;
pub use shrink::shrink;

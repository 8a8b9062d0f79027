// SPDX-License-Identifier: Apache-2.0
//! Checks user input (a number against its range, a name against the existing ones) and suggests the probable meaning.
mod interval;
mod names;

pub use interval::{Interval, short};
pub use names::{did_you_mean, nearest};

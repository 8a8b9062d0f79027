// SPDX-License-Identifier: Apache-2.0
//! Judges what a user gave, a number against its range and a name against those that there are, and says what was probably meant.
mod interval;
mod names;

pub use interval::{Interval, short};
pub use names::{did_you_mean, nearest};

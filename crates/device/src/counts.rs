// SPDX-License-Identifier: Apache-2.0
//! Numbers of a channel whose value is made of counts.
use crate::words::{Kind, OptionWord};

/// Largest scale and offset: a double resolves single counts far beyond it.
const FARTHEST: f64 = 1e15;

/// The options of a channel of counts that are numbers.
pub const WORDS: [OptionWord; 3] = [
    OptionWord::with_default("scale", Kind::Number, "1", "value of one count").within(-FARTHEST, FARTHEST),
    OptionWord::with_default("offset", Kind::Number, "0", "its value at 0 counts").within(-FARTHEST, FARTHEST),
    OptionWord::with_default("safe", Kind::Number, "off, or 0 counts", "value of an output that its device is left with").within(-FARTHEST, FARTHEST),
];

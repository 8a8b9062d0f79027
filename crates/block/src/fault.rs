// SPDX-License-Identifier: Apache-2.0
//! Why an invocation failed, in words.

/// Why an invocation failed; it has changed nothing.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Fault {
    /// The body returned this code.
    Returned(u32),
    /// The body panicked.
    Panicked,
    /// This output was not finite.
    NonFinite { item: String },
    /// A C++ exception left the body; what it says.
    Threw { what: String },
    /// A signal ended the body.
    Signal(i32),
    /// The body did not come to its end in its time.
    Budget,
}

impl core::fmt::Display for Fault {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Fault::Returned(code) => write!(f, "the block returned fault {code}"),
            Fault::Panicked => write!(f, "the block panicked"),
            Fault::NonFinite { item } => write!(f, "output '{item}' is not finite"),
            Fault::Threw { what } => write!(f, "the block threw an exception: {what}"),
            Fault::Signal(signal) => write!(f, "the block: {}", signal_text(*signal)),
            Fault::Budget => write!(f, "the block used up its time budget"),
        }
    }
}

impl std::error::Error for Fault {}

/// A signal in words.
pub fn signal_text(signal: i32) -> String {
    match signal {
        4 => "illegal instruction".to_owned(),
        7 => "access to memory that is not there (bus error)".to_owned(),
        8 => "division by zero or another arithmetic fault".to_owned(),
        11 => "access to memory that is not its own (segmentation fault)".to_owned(),
        other => format!("signal {other}"),
    }
}

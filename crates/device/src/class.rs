// SPDX-License-Identifier: Apache-2.0
//! Class of a driver.
use std::fmt;

/// Thread on which a driver exchanges its values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Class {
    /// Thread of its source: reads and writes take a bounded time, and neither allocate nor block.
    Inline,
    /// Dedicated thread; the newest values are exchanged, each with its age.
    Worker,
    /// Dedicated process under the guard.
    Process,
}

impl fmt::Display for Class {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Class::Inline => "inline",
            Class::Worker => "worker",
            Class::Process => "process",
        })
    }
}

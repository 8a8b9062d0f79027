// SPDX-License-Identifier: Apache-2.0
//! The conformance kit: whether a driver keeps what the interface of drivers promises to everybody else.
//!
//! The checks run in a process of their own, one behind the other: one that ends the process or does not come back fails alone, and the rest
//! go on in a fresh process. What needs a second process (a kill in each phase) is done from here.
//!
//! | module | checks of |
//! |---|---|
//! | `declaration` | the manual: names, texts, life, safe state |
//! | `options` | what is refused, and how |
//! | `channels` | where values lie, what they carry when nobody commands |
//! | `life` | open, close, again, in any order; what is left behind |
//! | `exchange` | readings and commands, odd times and odd numbers, allocation, memory |
//! | `rest` | the safe state |
//! | `services` | services, counters, search |
//! | `phases` | kill -9 in each phase |
mod channels;
mod declaration;
mod exchange;
mod life;
mod measures;
mod options;
mod phases;
mod report;
mod rest;
mod rig;
mod serve;
mod services;
mod subject;
mod watch;

pub use report::{Outcome, Report, Verdict};
pub use serve::serve;
pub use watch::{Settings, check};

use subject::Subject;

/// A check: its name, the sentence that holds where it passes, and how it is tried.
pub(crate) struct Check {
    pub(crate) name: &'static str,
    pub(crate) sentence: &'static str,
    pub(crate) run: fn(&Subject) -> Tried,
}

/// What a check found: it passed, or it does not apply, or the cause of its failure.
pub(crate) type Tried = Result<Passed, String>;

/// How a check passed.
pub(crate) enum Passed {
    Yes,
    /// It says nothing about this driver: why.
    NotApplicable(&'static str),
}

/// Those that run in the process of the driver, in their order.
pub(crate) fn checks() -> Vec<&'static Check> {
    [declaration::CHECKS, options::CHECKS, channels::CHECKS, life::CHECKS, services::CHECKS, exchange::CHECKS, rest::CHECKS]
        .iter()
        .flat_map(|checks| checks.iter())
        .collect()
}

/// Passes where the condition holds; else the cause.
pub(crate) fn holds(condition: bool, cause: impl FnOnce() -> String) -> Tried {
    if condition { Ok(Passed::Yes) } else { Err(cause()) }
}

/// Passes where nothing was found wrong.
pub(crate) fn none_of(mut wrong: impl Iterator<Item = String>) -> Tried {
    wrong.next().map_or(Ok(Passed::Yes), Err)
}

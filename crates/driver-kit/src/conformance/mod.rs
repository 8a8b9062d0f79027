// SPDX-License-Identifier: Apache-2.0
//! Conformance kit: checks that a driver keeps the promises of the driver interface.
//!
//! The checks run one after the other in a separate process: a check that ends the process or hangs fails alone, and the rest continue in
//! a fresh process. Checks that need a second process (a kill in each phase) are run from this process.
//!
//! | module | checks of |
//! |---|---|
//! | `declaration`, `promises` | the manual: names, texts, options; life cycle, safe state, services, privileges |
//! | `options` | refusals of options, and their messages |
//! | `channels` | layout of values, and their content when no verb commands them |
//! | `life` | open, close, reopen, in any order; leftovers |
//! | `exchange`, `cost` | readings and commands, unusual times and numbers; allocation, blocking, CPU time, printing, memory |
//! | `driven` | many firings: readings stay finite, parts at rest stay at rest |
//! | `pushed` | pushed parts: each follows its command, and its position and velocity agree |
//! | `kept` | the process and the thread of the exchange: signals, rounding, working directory |
//! | `safe_state` | the safe state |
//! | `services` | services, counters, search |
//! | `sanitized`, `sanitizing` | the exchange under the real-time sanitizer, in a process that has it; `runtime` is the sanitizer |
//! | `kills` | kill -9 in each phase |
//!
//! `watch` requests the checks and `serve` runs them, in the driver's process; `phases` is a life cycle up to the phase in which that
//! process is killed.
mod all;
mod channels;
mod check;
mod cost;
mod declaration;
mod driven;
mod exchange;
mod kept;
mod kills;
mod life;
mod measures;
mod options;
mod orders;
mod phases;
mod promises;
mod pushed;
mod report;
mod rig;
mod runtime;
mod safe_state;
mod sanitized;
mod sanitizing;
mod serve;
mod services;
mod settings;
mod subject;
mod watch;

pub use report::{Outcome, Report, Verdict};
pub use runtime::sanitizer_in;
pub use serve::serve;
pub use settings::Settings;
pub use watch::check;

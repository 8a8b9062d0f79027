// SPDX-License-Identifier: Apache-2.0
//! The conformance kit: whether a driver keeps what the interface of drivers promises to everybody else.
//!
//! The checks run in a process of their own, one behind the other: one that ends the process or does not come back fails alone, and the rest
//! go on in a fresh process. What needs a second process (a kill in each phase) is done from here.
//!
//! | module | checks of |
//! |---|---|
//! | `declaration`, `promises` | the manual: names, texts, options; life, safe state, services, rights |
//! | `options` | what is refused, and how |
//! | `channels` | where values lie, what they carry when nobody commands |
//! | `life` | open, close, again, in any order; what is left behind |
//! | `exchange`, `cost` | readings and commands, odd times and odd numbers; allocation, waits, computing, printing, memory |
//! | `driven` | many firings: readings that stay finite, parts that rest |
//! | `pushed` | parts that are pushed: each follows its command, and its position and velocity say so |
//! | `kept` | the process and the thread of the exchange: signals, rounding, folder |
//! | `safe_state` | the safe state |
//! | `services` | services, counters, search |
//! | `sanitized`, `sanitizing` | the exchange under the real-time sanitizer, in a process that has it; `runtime` is that |
//! | `kills` | kill -9 in each phase |
//!
//! `watch` asks and `serve` answers, in the process of the driver; `phases` is a life up to the phase in which that process is killed.
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

// SPDX-License-Identifier: Apache-2.0
//! Replays a recorded run. A record contains every script that was passed to a source, all inputs of every source from outside
//! (`runtime::trace`), and the code of the blocks; so the same blocks compute the same values, bit for bit, under the record's clock.
//! Neither supervisor nor programming system is needed: their decisions are in the scripts.
//!
//! [`Recording`] gathers the items of a record while it is made, [`Player`] replays them, and [`Comparison`] runs them with other code
//! beside the recorded code and names the first difference. [`Reader`] reads items from a recording's file, [`Run`] combines all of it
//! for a command, and [`Apart`] does the same in a separate process, beside a running system.
mod apart;
mod comparison;
mod condition;
mod file;
mod found;
mod player;
mod recorded_script;
mod recording;
mod run;
mod trust;

pub use apart::{Apart, Replaying, serve};
pub use comparison::{Comparison, Difference};
pub use condition::Condition;
pub use file::{ENCODING, Reader, TOPIC};
pub use found::{DifferenceText, ReplayResult, ShownSvv, StopReason, elements};
pub use player::{Moment, Player, Svv, Unplayable};
pub use recorded_script::{Codes, ExchangedCode};
pub use recording::{Item, Recording};
pub use run::{ReplayOptions, Run};
pub use trust::{CodeFile, Trust, modules_in};

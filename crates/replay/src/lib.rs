// SPDX-License-Identifier: Apache-2.0
//! Running a recorded run again. A record has every script that was handed to a source and, of every source, what came to it from outside
//! (`runtime::trace`), and the code of the blocks; so the same blocks compute the same values, bit for bit, under a clock that is the
//! record's. Neither supervisor nor programming system is needed: what they decided is in the scripts.
//!
//! [`Recording`] gathers the items of a record while it is made, [`Player`] runs them again, [`Comparison`] runs them with other code
//! beside the recorded one and names the first difference. [`Reader`] takes them out of a recording's file, [`Run`] is all of it for a command,
//! [`Apart`] the same in a process of its own, beside a system that runs.
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

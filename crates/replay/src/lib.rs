// SPDX-License-Identifier: Apache-2.0
//! Replays a recorded run. A record contains every script passed to a source, all external inputs of every source (`runtime::trace`), and
//! the code of the blocks. Therefore the same blocks compute the same values, bit for bit, under the record's clock. Neither the
//! supervisor nor the programming system is needed, because their decisions are in the scripts.
//!
//! [`Recording`] gathers the items of a record in progress, [`Player`] replays them, and [`Comparison`] runs them with other code in
//! parallel with the recorded code and reports the first difference. [`Reader`] reads items from a recording's file, [`Run`] combines all
//! of these for a command, and [`Apart`] does the same in a separate process while a system runs.
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

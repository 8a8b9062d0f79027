// SPDX-License-Identifier: Apache-2.0
//! The main device: finds subdevices, brings them to OP, and exchanges their process data.
mod bring_up;
mod bus;
mod clocks;
mod cycle;
mod delays;
mod mapping;
mod sdo;
mod subdevices;

pub use bring_up::{Line, Pdos, Station, SubdeviceSettings, bring_up};
pub use bus::{Bus, open_link};
pub use clocks::{Clocks, Reference, Sync0};
pub use cycle::{AnswerError, Cycle, FrameAnswer};
pub use mapping::{Field, Mapping, Window};
pub use sdo::Mailbox;
pub use subdevices::{Subdevice, inventory, take};

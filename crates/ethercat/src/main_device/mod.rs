// SPDX-License-Identifier: Apache-2.0
//! The main device: finds subdevices, brings them to OP, exchanges their process data.
mod bring_up;
mod bus;
mod cycle;
mod mapping;
mod sdo;
mod subdevices;

pub use bring_up::{Pdos, Station, Wanted, bring_up};
pub use bus::{Bus, open_link};
pub use cycle::{Cycle, Refused, Replied};
pub use mapping::{Field, Mapping};
pub use sdo::Mailbox;
pub use subdevices::{Subdevice, inventory, take};

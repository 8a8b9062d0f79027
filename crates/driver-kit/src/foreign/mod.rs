// SPDX-License-Identifier: Apache-2.0
//! Drivers in C, from shared objects that were built with `opengpac_driver.h`.
//!
//! | module | |
//! |---|---|
//! | `abi` | the bytes that both sides share |
//! | `load` | a file: its version and sizes are checked before anything of it is believed |
//! | `words` | its declarations, as every driver has one |
//! | `host` | what a driver may ask for while it is called |
//! | `instance` | the memory of one driver |
//! | `driver` | a driver that calls it |
//! | `services` | its services |
//! | `declared` | its declaration, which makes drivers and looks for devices |
// The file is the one that `opengpac new driver --in rust` gives to a driver: both sides are compiled from the same text.
#[doc(hidden)]
#[path = "../../../../python/opengpac/drivers/rust/abi.rs"]
pub mod abi;
mod c_declaration;
mod driver;
mod host;
mod instance;
mod load;
mod loaded_driver;
mod services;

pub(crate) use load::load;

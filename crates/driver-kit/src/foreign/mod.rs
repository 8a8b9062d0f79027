// SPDX-License-Identifier: Apache-2.0
//! Drivers in C, from shared objects that were built with `opengpac_driver.h`.
//!
//! | module | |
//! |---|---|
//! | `abi` | the memory layout that both sides share |
//! | `load` | a file: its version and sizes are checked before any of it is trusted |
//! | `c_declaration` | its declarations, converted into those of all drivers |
//! | `host` | functions that a driver may call during a call to it |
//! | `instance` | the memory of one driver |
//! | `driver` | a driver that calls it |
//! | `services` | its services |
//! | `loaded_driver` | its declaration, which creates drivers and searches for devices |
// `opengpac new driver --in rust` copies this file into a driver: both sides are compiled from the same text.
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

// SPDX-License-Identifier: Apache-2.0
//! EtherCAT: CiA 402 drives as axes, and an emulated segment that replaces them.
//!
//! | | |
//! |---|---|
//! | [`frames`], [`coe`], [`sii`], [`registers`] | frames, mailbox messages, EEPROM contents, addresses: functions on bytes |
//! | [`states`], [`cia402`] | names of the states and errors of the bus and its drives |
//! | [`link`] | carriers of frames |
//! | [`main_device`] | brings subdevices to OP and exchanges their process data |
//! | [`DRIVER`] | the driver `ethercat`: an axis for each drive |
//! | [`emulator`] | an emulated segment |
pub mod coe;
mod driver;
pub mod emulator;
pub mod frames;
pub mod link;
pub mod main_device;
pub mod registers;
pub mod sii;
pub mod states;

pub use ::cia402;
pub use driver::DRIVER;

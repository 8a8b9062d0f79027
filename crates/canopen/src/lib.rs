// SPDX-License-Identifier: Apache-2.0
//! CANopen: CiA 402 drives as axes, CiA 401 input and output modules, and an emulated bus that replaces them.
//!
//! | | |
//! |---|---|
//! | [`frame`], [`message`], [`sdo`], [`nmt`], [`pdo`] | CAN frames and their content according to CiA 301: functions on bytes |
//! | [`link`], [`interface`] | carriers of frames: SocketCAN, a local socket, an emulated bus of this process |
//! | [`eds`] | electronic data sheets: the objects of a device by name |
//! | [`client`] | reads and writes objects of nodes outside the cycle |
//! | [`DRIVER`] | the driver `canopen`: an axis for each drive, channels for each module |
//! | [`emulator`] | an emulated bus |
pub mod client;
mod driver;
pub mod eds;
pub mod emulator;
pub mod frame;
pub mod interface;
pub mod link;
pub mod message;
pub mod nmt;
pub mod pdo;
pub mod sdo;

pub use driver::DRIVER;

// SPDX-License-Identifier: Apache-2.0
//! Carrier of frames: a SocketCAN interface, or a local socket on which an emulated bus answers.
mod end;
mod socket;

pub use end::{LOCAL, Link, hears};
pub use socket::{Socket, wishes};

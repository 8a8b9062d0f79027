// SPDX-License-Identifier: Apache-2.0
//! The driver `canopen`: drives on a bus as axes, and input and output modules as channels.
mod axis;
mod bring_up;
mod counters;
mod declaration;
mod device;
mod heard;
mod module;
mod options;
mod services;
mod station;

pub use declaration::DRIVER;

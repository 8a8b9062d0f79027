// SPDX-License-Identifier: Apache-2.0
//! The driver `ethercat`: drives on a segment as axes, terminals as channels.
mod axis;
mod counters;
mod declaration;
mod device;
mod entries;
mod options;
mod services;
mod terminal;

pub use declaration::DRIVER;

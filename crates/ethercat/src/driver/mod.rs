// SPDX-License-Identifier: Apache-2.0
//! The driver `ethercat`: drives of a segment as axes.
mod axis;
mod brake;
mod counters;
mod declaration;
mod device;
mod homing;
mod options;
mod services;

pub use declaration::DRIVER;

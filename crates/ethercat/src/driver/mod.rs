// SPDX-License-Identifier: Apache-2.0
//! The driver `ethercat`: drives of a segment as axes.
mod axis;
mod counters;
mod declaration;
mod device;
mod options;
mod services;

pub use declaration::DRIVER;

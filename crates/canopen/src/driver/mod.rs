// SPDX-License-Identifier: Apache-2.0
//! The driver `canopen`: drives of a bus as axes.
mod axis;
mod bring_up;
mod counters;
mod declaration;
mod device;
mod heard;
mod options;
mod services;

pub use declaration::DRIVER;

// SPDX-License-Identifier: Apache-2.0
//! Common parts of drivers above the driver interface (crate [`device`]): the threads of their exchange, and their loading from files.
//!
//! | module | |
//! |---|---|
//! | `worker` | a dedicated thread for a driver whose exchange may block; its source takes the newest readings, each with its age |
//! | [`conformance`] | the kit that checks that a driver keeps the promises of the interface |
//! | `foreign` | drivers in C, from shared objects |
//! | `in_place` | the same driver on the thread of its source, for the virtual clock |
pub mod conformance;
#[doc(hidden)]
pub mod foreign;
mod in_place;
mod readings;
mod worker;

use device::{Driver, Pace};
use std::sync::Once;

/// Provides the threads for the drivers of this process, and the loader for drivers in files. Idempotent.
pub fn lend() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        device::lend_worker(paced);
        device::lend_loader("so", foreign::load);
    });
}

/// Wraps the driver according to its pace: its last channel is `age`, in seconds.
fn paced(driver: Box<dyn Driver>, pace: Pace) -> Box<dyn Driver> {
    if pace.in_place { Box::new(in_place::InPlace::new(driver, pace)) } else { Box::new(worker::Worker::new(driver, pace)) }
}

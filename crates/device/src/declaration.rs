// SPDX-License-Identifier: Apache-2.0
//! The declaration of a driver: what a program, a manual and the registry know of it before it is opened.
use crate::class::Class;
use crate::counters::CounterWord;
use crate::error::DriverError;
use crate::life::{Life, SafeState};
use crate::opening::{DriverMaker, OpenedDriver};
use crate::option_word::OptionWord;
use crate::options::GivenOptions;
use crate::services::{Scan, ServiceWord};
use crate::shapes::Geometry;
use serde_json::Value;

/// Function of a driver that takes its checked options and needs no open driver: it makes one, draws its machine, tries its files.
pub type Of<T> = fn(&GivenOptions<'_>) -> Result<T, DriverError>;

/// The kind and the options of the driver that stands for another one.
pub type StandIn = fn(&Value) -> Option<(String, Value)>;

/// A kind of driver. It is a constant of the file that the driver is in; [`register`](crate::register) makes it known.
pub struct Declaration {
    /// The name by which a program asks for it.
    pub kind: &'static str,
    /// One line.
    pub doc: &'static str,
    pub class: Class,
    pub options: &'static [OptionWord],
    /// Times of its device's opening and loss.
    pub life: Life,
    /// The safe state of its device.
    pub safe_state: SafeState,
    /// Services that it offers off the cycle.
    pub services: &'static [ServiceWord],
    /// Its counters.
    pub counters: &'static [CounterWord],
    /// Rights that it needs beyond those of a program of the user, one line each with how it is given: `raw sockets: cap_net_raw`.
    pub rights: &'static [&'static str],
    /// Finds devices that it could open; none: it cannot look.
    pub scan: Option<Scan>,
    /// Makes it. It may allocate, read files and load libraries.
    pub open: Of<OpenedDriver>,
    /// Bodies, joints, shapes and meshes of its machine, for whatever draws it; without opening it.
    pub geometry: Option<Of<Option<Geometry>>>,
    /// Tries the files that its options name, so that what is wrong with one ends no process but a child.
    pub trial: Option<Of<()>>,
    /// Driver and options that stand for it where time is virtual; none: itself.
    pub in_virtual_time: Option<StandIn>,
    /// Maker of a driver that was loaded from a file: it makes drivers, and looks for devices, in place of `open` and `scan`.
    pub loaded: Option<&'static dyn DriverMaker>,
}

impl Declaration {
    /// Makes a driver.
    ///
    /// # Errors
    /// The driver's own.
    pub(crate) fn make(&self, given: &GivenOptions<'_>) -> Result<OpenedDriver, DriverError> {
        self.loaded.map_or_else(|| (self.open)(given), |loaded| loaded.open(given))
    }

    /// Makes a declaration with these options, which is inline and has nothing beyond what every driver has.
    pub const fn new(kind: &'static str, doc: &'static str, options: &'static [OptionWord], open: Of<OpenedDriver>) -> Declaration {
        Declaration {
            kind,
            doc,
            class: Class::Inline,
            options,
            life: Life::IN_PLACE,
            safe_state: SafeState::BY_DRIVER,
            services: &[],
            counters: &[],
            rights: &[],
            scan: None,
            open,
            geometry: None,
            trial: None,
            in_virtual_time: None,
            loaded: None,
        }
    }
}

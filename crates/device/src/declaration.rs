// SPDX-License-Identifier: Apache-2.0
//! Declaration of a driver: the information that programs, manuals and the registry need before the driver is opened.
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

/// Function of a driver that takes its checked options and does not need an open driver: it creates one, draws its machine, or tries its
/// files.
pub type Of<T> = fn(&GivenOptions<'_>) -> Result<T, DriverError>;

/// Function that returns the kind and the options of the driver that replaces another one.
pub type StandIn = fn(&Value) -> Option<(String, Value)>;

/// Kind of driver, declared as a constant in the driver's file; [`register`](crate::register) registers it.
pub struct Declaration {
    /// Name by which a program requests the driver.
    pub kind: &'static str,
    /// Description, one line.
    pub doc: &'static str,
    pub class: Class,
    pub options: &'static [OptionWord],
    /// Timing of the opening and loss of the driver's device.
    pub life: Life,
    /// Safe state of the driver's device.
    pub safe_state: SafeState,
    /// Services offered off the cycle.
    pub services: &'static [ServiceWord],
    /// Counters of the driver.
    pub counters: &'static [CounterWord],
    /// Privileges required beyond those of an ordinary user process, one per line, each with the way to grant it: `raw sockets:
    /// cap_net_raw`.
    pub rights: &'static [&'static str],
    /// Searches for devices that the driver could open; `None` if it cannot search.
    pub scan: Option<Scan>,
    /// Creates the driver. It may allocate, read files and load libraries.
    pub open: Of<OpenedDriver>,
    /// Returns the bodies, joints, shapes and meshes of the machine for drawing, without opening it.
    pub geometry: Option<Of<Option<Geometry>>>,
    /// Tries the files named by the options in a child process, so that a broken file cannot end any other process.
    pub trial: Option<Of<()>>,
    /// Returns the driver and options that replace this one in virtual time; `None` if there are none.
    pub in_virtual_time: Option<StandIn>,
    /// Factory of a driver that was loaded from a file; creates drivers and searches for devices, instead of `open` and `scan`.
    pub loaded: Option<&'static dyn DriverMaker>,
}

impl Declaration {
    /// Creates a driver.
    ///
    /// # Errors
    /// Returns the driver's own error.
    pub(crate) fn make(&self, given: &GivenOptions<'_>) -> Result<OpenedDriver, DriverError> {
        self.loaded.map_or_else(|| (self.open)(given), |loaded| loaded.open(given))
    }

    /// Creates a declaration of an inline driver with these options, and with the defaults otherwise.
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

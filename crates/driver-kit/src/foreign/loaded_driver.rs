// SPDX-License-Identifier: Apache-2.0
//! A loaded declaration: creates drivers and searches for devices.
use super::abi;
use super::c_declaration::Words;
use super::driver;
use super::host::{Host, filled};
use super::instance::Instance;
use super::services::Calls;
use device::{Counters, Declaration, DriverError, DriverMaker, FoundDevice, GivenOptions, OpenedDriver};
use std::sync::Arc;

pub(super) struct Foreign {
    of: &'static abi::Driver,
    words: Words,
}

// SAFETY: the table of a library is constant.
unsafe impl Send for Foreign {}
// SAFETY: as above.
unsafe impl Sync for Foreign {}

impl Foreign {
    /// Returns the declaration of a driver; it stays valid, because its library stays loaded.
    pub(super) fn declare(of: &'static abi::Driver, words: Words) -> &'static Declaration {
        let loaded: &'static Foreign = Box::leak(Box::new(Foreign { of, words }));
        let words = &loaded.words;
        Box::leak(Box::new(Declaration {
            class: words.class,
            life: words.life,
            safe_state: words.safe_state,
            services: words.services,
            counters: words.counters,
            rights: words.rights,
            scan: of.scan.map(|_| nobody_scans as device::Scan),
            loaded: Some(loaded),
            ..Declaration::new(words.name, words.doc, words.options, nobody_makes)
        }))
    }
}

/// Returns an error, because `loaded` creates the drivers.
fn nobody_makes(given: &GivenOptions<'_>) -> Result<OpenedDriver, DriverError> {
    Err(given.wrong("", "it was loaded from a file, which creates it"))
}

/// Returns an error, because `loaded` searches for devices.
fn nobody_scans(given: &GivenOptions<'_>) -> Result<Vec<FoundDevice>, DriverError> {
    Err(given.wrong("", "it was loaded from a file, which searches for its devices"))
}

impl DriverMaker for Foreign {
    fn open(&self, given: &GivenOptions<'_>) -> Result<OpenedDriver, DriverError> {
        let given = filled(&self.words.defaults, given.value());
        let (kind, services, defaults) = (self.words.name, self.words.services, self.words.service_defaults.clone());
        let calls = |instance: Arc<Instance>| (!services.is_empty()).then(|| Arc::new(Calls { instance, kind, services, defaults }));
        driver::make(self.of, self.words.name, given, Counters::new(self.words.counters), calls)
    }

    fn scan(&self, given: &GivenOptions<'_>) -> Result<Vec<FoundDevice>, DriverError> {
        let mut host = Host::of(&self.words.defaults, given.value());
        // SAFETY: the host outlives the call.
        let looked = host.call(|host| self.of.scan.map_or(std::ptr::null(), |scan| unsafe { scan(host) }));
        looked.map_err(|what| DriverError::Failed(format!("driver '{}': {what}", self.words.name)))?;
        Ok(host.found)
    }
}

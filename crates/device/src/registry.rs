// SPDX-License-Identifier: Apache-2.0
//! Registry of the drivers of this process, by name. A driver is referred to by name only in its own crate, which registers its
//! declaration; a program requests the driver by a string.
use crate::declaration::Declaration;
use crate::error::DriverError;
use crate::loaded;
use std::collections::BTreeMap;
use std::sync::{PoisonError, RwLock};

static DRIVERS: RwLock<BTreeMap<&'static str, &'static Declaration>> = RwLock::new(BTreeMap::new());

/// Registers this driver for [`open`](crate::open) in this process. Idempotent.
///
/// # Errors
/// Returns [`DriverError::Taken`] if another driver has the same name.
pub fn register(driver: &'static Declaration) -> Result<(), DriverError> {
    let mut drivers = DRIVERS.write().unwrap_or_else(PoisonError::into_inner);
    let is_other = drivers.get(driver.kind).is_some_and(|known| !std::ptr::eq(*known, driver));
    if is_other {
        return Err(DriverError::Taken { kind: driver.kind.to_owned() });
    }
    drivers.insert(driver.kind, driver);
    Ok(())
}

/// Returns the registered drivers, by name.
pub fn declarations() -> Vec<&'static Declaration> {
    DRIVERS.read().unwrap_or_else(PoisonError::into_inner).values().copied().collect()
}

/// Returns the driver with that name, or from that file: `name@file.so`.
///
/// # Errors
/// Returns a [`DriverError::UnknownKind`] that lists the registered drivers.
pub fn find(kind: &str) -> Result<&'static Declaration, DriverError> {
    if let Some(found) = loaded::in_file(kind) {
        return found;
    }
    let known = declarations();
    known.iter().find(|driver| driver.kind == kind).copied().ok_or_else(|| {
        let names: Vec<&str> = known.iter().map(|driver| driver.kind).collect();
        let meant = hints::nearest(kind, names.iter().copied()).map_or_else(String::new, |name| format!(" (did you mean '{name}'?)"));
        DriverError::UnknownKind { kind: kind.into(), meant, known: names.join(", ") }
    })
}

// SPDX-License-Identifier: Apache-2.0
//! Loads files that contain drivers. They are never unloaded: a driver and its declaration stay registered for the lifetime of the
//! process.
use super::abi::{self, ABI, Driver, Module, SYMBOL};
use super::c_declaration;
use super::loaded_driver::Foreign;
use device::{Declaration, DriverError};
use libloading::os::unix::{Library, RTLD_LOCAL, RTLD_NOW};
use std::collections::BTreeMap;
use std::mem::offset_of;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

static LOADED: Mutex<BTreeMap<PathBuf, Vec<&'static Declaration>>> = Mutex::new(BTreeMap::new());

/// Returns the drivers in a shared object; repeated calls return the same drivers.
pub(crate) fn load(file: &Path) -> Result<Vec<&'static Declaration>, DriverError> {
    let refused = |what: String| DriverError::Failed(format!("'{}' provides no driver: {what}", file.display()));
    let path = file.canonicalize().map_err(|why| refused(why.to_string()))?;
    let mut loaded = LOADED.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(drivers) = loaded.get(&path) {
        return Ok(drivers.clone());
    }
    let drivers = open(&path).map_err(refused)?;
    loaded.insert(path, drivers.clone());
    Ok(drivers)
}

fn open(path: &Path) -> Result<Vec<&'static Declaration>, String> {
    // SAFETY: a program that names a driver's file requests that its code run in this process.
    let library = unsafe { Library::open(Some(path), RTLD_NOW | RTLD_LOCAL) }.map_err(|error| error.to_string())?;
    // SAFETY: the symbol has this type in every version.
    let entry = unsafe { library.get::<unsafe extern "C" fn() -> *const Module>(SYMBOL.as_bytes()) }.map(|entry| *entry);
    let Ok(entry) = entry else {
        return Err(format!("it has no function {SYMBOL}; include opengpac_driver.h and declare a DRIVER"));
    };
    // Its declarations are `'static` from here on.
    core::mem::forget(library);
    // SAFETY: the entry of a loaded library returns a static table; its version and size are checked before the rest.
    let module = unsafe {
        let table = entry();
        let (version, size) = ((*table).abi, (*table).size);
        if version != ABI || (size as usize) < size_of::<Module>() {
            return Err(format!(
                "it has version {version} of the driver interface, but this system has {ABI}: build it again with this system's opengpac_driver.h"
            ));
        }
        &*table
    };
    if module.count == 0 {
        return Err("it has no driver: declare one with DRIVER".to_owned());
    }
    // SAFETY: the table contains the number of them.
    let getters = unsafe { std::slice::from_raw_parts(module.drivers, module.count as usize) };
    let mut found: Vec<&'static Declaration> = Vec::new();
    for getter in getters {
        // SAFETY: as for the entry.
        let declared = declaration(unsafe { getter() })?;
        if found.iter().any(|known| known.kind == declared.kind) {
            return Err(format!("driver '{}' is declared twice", declared.kind));
        }
        found.push(declared);
    }
    Ok(found)
}

fn declaration(driver: *const Driver) -> Result<&'static Declaration, String> {
    // SAFETY: a driver begins with its size.
    let size = unsafe { (*driver).size } as usize;
    if size < offset_of!(Driver, taken) {
        return Err("the size of a driver's table does not match its version: build it again with this system's opengpac_driver.h".to_owned());
    }
    // SAFETY: absent pointers and functions are 0, and so are those beyond the end of a table that was built before they were added.
    let driver: &'static Driver = unsafe {
        let mut whole = Box::new(std::mem::MaybeUninit::<Driver>::zeroed());
        std::ptr::copy_nonoverlapping(driver.cast::<u8>(), whole.as_mut_ptr().cast::<u8>(), size.min(size_of::<Driver>()));
        Box::leak(whole).assume_init_ref()
    };
    // SAFETY: the strings belong to a library that stays loaded.
    let name = unsafe { abi::text(driver.name) };
    let words = c_declaration::read(driver).map_err(|what| format!("driver '{name}': {what}"))?;
    for (function, is_there) in [("make", driver.make.is_some()), ("read", driver.read.is_some() || driver.write.is_some())] {
        if !is_there {
            return Err(format!("driver '{name}' has no function {name}_{function}"));
        }
    }
    if !words.services.is_empty() && driver.service.is_none() {
        return Err(format!("driver '{name}' declares services but has no function {name}_service"));
    }
    Ok(Foreign::declare(driver, words))
}

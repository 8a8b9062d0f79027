// SPDX-License-Identifier: Apache-2.0
//! A declaration that was loaded: it makes drivers, carries out their services and looks for devices.
use super::abi;
use super::driver::{self, Instance};
use super::host::Host;
use super::words::Words;
use device::{Counters, Declaration, DeviceError, DriverError, Found, Given, Kind, Loaded, Opened, ServiceWord, Services, check_service};
use serde_json::{Map, Value};
use std::ffi::CString;
use std::sync::atomic::Ordering;
use std::sync::{Arc, PoisonError};

pub(super) struct Foreign {
    of: &'static abi::Driver,
    words: Words,
}

// SAFETY: the table of a library is constant.
unsafe impl Send for Foreign {}
// SAFETY: as above.
unsafe impl Sync for Foreign {}

impl Foreign {
    /// Its declaration; it stays, as its library does.
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

/// In the place of what `loaded` does.
fn nobody_makes(given: &Given<'_>) -> Result<Opened, DriverError> {
    Err(given.wrong("", "it was loaded from a file, which makes it"))
}

/// In the place of what `loaded` does.
fn nobody_scans(given: &Given<'_>) -> Result<Vec<Found>, DriverError> {
    Err(given.wrong("", "it was loaded from a file, which looks for it"))
}

/// What was given over what holds where nothing is given.
fn filled(defaults: &Map<String, Value>, given: &Value) -> Map<String, Value> {
    let given = given.as_object().into_iter().flatten();
    defaults.iter().chain(given).map(|(name, value)| (name.clone(), value.clone())).collect()
}

impl Loaded for Foreign {
    fn open(&self, given: &Given<'_>) -> Result<Opened, DriverError> {
        let given = filled(&self.words.defaults, given.value());
        let (kind, services, defaults) = (self.words.name, self.words.services, self.words.service_defaults.clone());
        let calls = |instance: Arc<Instance>| (!services.is_empty()).then(|| Arc::new(Calls { instance, kind, services, defaults }));
        driver::make(self.of, self.words.name, given, Counters::new(self.words.counters), calls)
    }

    fn scan(&self, given: &Given<'_>) -> Result<Vec<Found>, DriverError> {
        let mut host = Host { given: filled(&self.words.defaults, given.value()), ..Host::default() };
        // SAFETY: it is called with a host that outlives the call.
        let looked = host.call(|host| self.of.scan.map_or(std::ptr::null(), |scan| unsafe { scan(host) }));
        looked.map_err(|what| DriverError::Failed(format!("driver '{}': {what}", self.words.name)))?;
        Ok(host.found)
    }
}

/// The services of one driver.
pub(super) struct Calls {
    instance: Arc<Instance>,
    kind: &'static str,
    services: &'static [ServiceWord],
    defaults: Vec<Map<String, Value>>,
}

impl Services for Calls {
    fn call(&self, service: &str, arguments: &Value) -> Result<Value, DeviceError> {
        let failed = |message: String| DeviceError { message };
        let checked = check_service(self.kind, self.services, service, arguments).map_err(|why| failed(why.to_string()))?;
        let at = self.services.iter().position(|word| word.name == service);
        let Some((index, call)) = at.zip(self.instance.of.service) else { return Err(failed(format!("it has no service '{service}'"))) };
        let name = CString::new(service).map_err(|why| failed(why.to_string()))?;
        // One at a time, and none behind its end.
        let _held = self.instance.busy.lock().unwrap_or_else(PoisonError::into_inner);
        if self.instance.is_closed.load(Ordering::Acquire) {
            return Err(failed("the device is closed".to_owned()));
        }
        let mut host = Host { given: filled(&self.defaults[index], &checked), ..Host::default() };
        // SAFETY: its own memory, as long as the instance lives; a host and a name that outlive the call.
        host.call(|host| unsafe { call(self.instance.memory(), host, name.as_ptr()) }).map_err(failed)?;
        match (&host.answer, self.services[index].answer) {
            (None, None) => Ok(Value::Null),
            (Some(json), Some(kind)) => answered(json, kind).ok_or_else(|| failed(format!("its answer to '{service}', {json}, is not of the declared kind"))),
            (None, Some(_)) => Err(failed(format!("service '{service}' declares an answer and gives none"))),
            (Some(_), None) => Err(failed(format!("service '{service}' gives an answer and declares none"))),
        }
    }
}

/// An answer as it is declared; none: it is something else.
fn answered(json: &str, kind: Kind) -> Option<Value> {
    let value: Value = serde_json::from_str(json).ok()?;
    match kind {
        Kind::Number => value.as_f64().map(Value::from),
        Kind::Text => value.is_string().then_some(value),
        Kind::Whole => (value.is_i64() || value.is_u64()).then_some(value),
        Kind::Bool => value.is_boolean().then_some(value),
        Kind::List => value.is_array().then_some(value),
        Kind::Table => value.is_object().then_some(value),
    }
}

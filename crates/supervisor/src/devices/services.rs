// SPDX-License-Identifier: Apache-2.0
//! Services of drivers, acyclic commands, and device searches. Each runs on its own thread, which holds no lock needed by a stop; the
//! caller waits for the answer in slices.
use crate::devices::errands::{Errand, Errands};
use crate::refuse::{refuse, unknown};
use crate::system::{System, WaitResult};
use device::{DriverError, ReachingValue, ServiceError};
use model::refusal::{Class, Refusals};
use model::value::Value;
use serde_json::Value as Json;
use std::sync::atomic::Ordering;
use std::sync::{Arc, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

impl System {
    /// Calls a service of a physical device's driver. Returns the number of the call, to be passed to [`System::served`]. A service that
    /// moves the device is refused while an emergency stop is latched.
    pub fn service(&self, device: &str, service: &str, arguments: Json) -> Result<u64, Refusals> {
        let (beside, far, stop) = {
            let core = self.shared.locked();
            let physical = &core.registry.physical;
            let of = physical.get(device).ok_or_else(|| unknown("physical device", device, physical.keys().map(String::as_str)))?;
            if moves(&of.about, service) {
                core.safety.emergency.refuse("ask for service", &format!("{device}.{service}"))?;
            }
            (of.beside.clone(), core.remote.at(core.registry.source_name(of.source)).cloned(), core.safety.emergency.stop.clone())
        };
        let (number, errand) = self.errands().begin(format!("device '{device}'"), format!("service '{service}'"))?;
        let (name, service) = (device.to_owned(), service.to_owned());
        carry_out(&errand, move || match far {
            None => beside.serve(&service, &arguments, &|| stop.load(Ordering::Acquire)),
            Some(far) => far.service(&name, &service, &arguments.to_string()).map(|answer| serde_json::from_str(&answer).unwrap_or_default()),
        });
        Ok(number)
    }

    /// Searches this host for devices that a driver could open; does not move any machine. Returns the number of the search, to be passed
    /// to [`System::served`]; the answer is a list of devices, each with the options that open it.
    pub fn scan(&self, kind: &str, options: Json) -> Result<u64, Refusals> {
        let (number, errand) = self.errands().begin(format!("driver '{kind}'"), "a search".to_owned())?;
        let kind = kind.to_owned();
        carry_out(&errand, move || {
            let found = drivers::scan(&kind, &options).map_err(|why| match &why {
                DriverError::UnknownKind { .. } => ServiceError::Unknown(why.to_string()),
                DriverError::Option { .. } | DriverError::NoScan { .. } => ServiceError::Arguments(why.to_string()),
                _ => ServiceError::Failed(why.to_string()),
            })?;
            serde_json::to_value(found).map_err(|why| ServiceError::Failed(why.to_string()))
        });
        Ok(number)
    }

    /// Visits each argument of a service that refers to a file or code on this machine. An unknown device has no such arguments.
    ///
    /// # Errors
    /// Returns the first error of `visit`.
    pub fn each_reach_of_service<E>(
        &self,
        device: &str,
        service: &str,
        arguments: &mut Json,
        visit: &mut dyn FnMut(ReachingValue<'_>) -> Result<(), E>,
    ) -> Result<(), E> {
        let driver = self.shared.locked().registry.physical.get(device).map(|of| of.driver.clone());
        match driver {
            Some((kind, options)) => drivers::each_reach_of_service((&kind, &options), service, arguments, visit),
            None => Ok(()),
        }
    }

    fn errands(&self) -> MutexGuard<'_, Errands> {
        self.shared.errands.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits at most `slice` for the answer to a service call. The answer is returned only once.
    pub fn served(&self, errand: u64, slice: Duration) -> Result<WaitResult<Option<Value>>, Refusals> {
        let gone = || refuse(Class::InvalidState, format!("service call {errand} has ended, and its answer was already fetched"), "ask for the service again");
        let of = self.errands().get(errand).ok_or_else(gone)?;
        let until = Instant::now() + slice;
        let mut answer = of.answer.lock().unwrap_or_else(PoisonError::into_inner);
        while answer.is_none() {
            if self.shared.closing.load(Ordering::Acquire) {
                let message = format!("system '{}' was closed during the wait for {} of {}", self.name, of.what, of.of);
                return Err(refuse(Class::InvalidState, message, ""));
            }
            let left = until.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Ok(WaitResult::Slice);
            }
            answer = of.answered.wait_timeout(answer, left).unwrap_or_else(PoisonError::into_inner).0;
        }
        let answer = answer.take().ok_or_else(gone)?;
        self.errands().remove(errand);
        let wrong = |why: serde_json::Error| ServiceError::Failed(format!("its answer does not have a known form: {why}"));
        let value = answer.and_then(|answer| serde_json::from_value(answer).map_err(wrong));
        value.map(WaitResult::Done).map_err(|why| of.refused(why))
    }
}

/// Runs a service call on its own thread.
fn carry_out(errand: &Arc<Errand>, does: impl FnOnce() -> Result<Json, ServiceError> + Send + 'static) {
    let ends = errand.clone();
    if let Err(why) = std::thread::Builder::new().name("service".to_owned()).spawn(move || ends.end(does())) {
        errand.end(Err(ServiceError::Failed(format!("cannot start a thread for it: {why}"))));
    }
}

/// Returns true if a service is declared by its driver to move the device.
fn moves(about: &Json, service: &str) -> bool {
    about["services"].as_array().into_iter().flatten().any(|of| of["name"] == service && of["moves"] == true)
}

// SPDX-License-Identifier: Apache-2.0
//! Services of drivers: commands off the cycle. Each is carried out on a thread of its own that holds nothing which a stop could wait for;
//! who asked for it waits for its errand, in slices.
use crate::errands::Errands;
use crate::refuse::{refuse, unknown};
use crate::system::{System, Waited};
use device::Unserved;
use model::refusal::{Class, Refusals};
use model::value::Value;
use serde_json::Value as Json;
use std::sync::atomic::Ordering;
use std::sync::{MutexGuard, PoisonError};
use std::time::{Duration, Instant};

impl System {
    /// Lets the driver of a physical device carry out a service. Returns the number of the errand, for [`System::served`]. While an emergency
    /// stop is latched, one that moves the device is refused.
    pub fn service(&self, device: &str, service: &str, arguments: Json) -> Result<u64, Refusals> {
        let (beside, far) = {
            let core = self.shared.locked();
            let physical = &core.registry.physical;
            let of = physical.get(device).ok_or_else(|| unknown("physical device", device, physical.keys().map(String::as_str)))?;
            if moves(&of.about, service) {
                core.safety.emergency.refuse("ask for service", &format!("{device}.{service}"))?;
            }
            (of.beside.clone(), core.remote.at(core.registry.source_name(of.source)).cloned())
        };
        let (number, errand) = self.errands().begin(device, service)?;
        let (name, service, ends) = (device.to_owned(), service.to_owned(), errand.clone());
        let carry_out = move || {
            let served = match far {
                None => beside.serve(&service, &arguments),
                Some(far) => far.service(&name, &service, &arguments.to_string()).map(|answer| serde_json::from_str(&answer).unwrap_or_default()),
            };
            ends.end(served);
        };
        if let Err(why) = std::thread::Builder::new().name("service".to_owned()).spawn(carry_out) {
            errand.end(Err(Unserved::Failed(format!("no thread for it: {why}"))));
        }
        Ok(number)
    }

    fn errands(&self) -> MutexGuard<'_, Errands> {
        self.shared.errands.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits for the answer of an errand, for `slice` at most. It is given once.
    pub fn served(&self, errand: u64, slice: Duration) -> Result<Waited<Option<Value>>, Refusals> {
        let gone = || refuse(Class::InvalidState, format!("errand {errand} is over, and its answer was taken"), "ask for the service again");
        let of = self.errands().get(errand).ok_or_else(gone)?;
        let until = Instant::now() + slice;
        let mut answer = of.answer.lock().unwrap_or_else(PoisonError::into_inner);
        while answer.is_none() {
            if self.shared.closing.load(Ordering::Acquire) {
                let message = format!("system '{}' is closed, and nobody waits for service '{}' of device '{}' any more", self.name, of.service, of.device);
                return Err(refuse(Class::InvalidState, message, ""));
            }
            let left = until.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Ok(Waited::Slice);
            }
            answer = of.answered.wait_timeout(answer, left).unwrap_or_else(PoisonError::into_inner).0;
        }
        let answer = answer.take().ok_or_else(gone)?;
        self.errands().remove(errand);
        let wrong = |why: serde_json::Error| Unserved::Failed(format!("its answer is of no form that is known: {why}"));
        let value = answer.and_then(|answer| serde_json::from_value(answer).map_err(wrong));
        value.map(Waited::Done).map_err(|why| of.refused(why))
    }
}

/// Whether a service moves its device, by what the driver says.
fn moves(about: &Json, service: &str) -> bool {
    about["services"].as_array().into_iter().flatten().any(|of| of["name"] == service && of["moves"] == true)
}

// SPDX-License-Identifier: Apache-2.0
//! Services of a driver in C.
use super::host::Host;
use super::instance::Instance;
use device::{DeviceError, Kind, ServiceWord, Services, check_service, under_a_stop};
use serde_json::{Map, Value};
use std::ffi::CString;
use std::sync::atomic::Ordering;
use std::sync::{Arc, PoisonError};

/// Services of one driver.
pub(super) struct Calls {
    pub(super) instance: Arc<Instance>,
    pub(super) kind: &'static str,
    pub(super) services: &'static [ServiceWord],
    pub(super) defaults: Vec<Map<String, Value>>,
}

impl Services for Calls {
    fn call(&self, service: &str, arguments: &Value) -> Result<Value, DeviceError> {
        self.call_moving(service, arguments, &|| false)
    }

    fn call_moving(&self, service: &str, arguments: &Value, is_stopped: &dyn Fn() -> bool) -> Result<Value, DeviceError> {
        let failed = |message: String| DeviceError { message };
        let checked = check_service(self.kind, self.services, service, arguments).map_err(|why| failed(why.to_string()))?;
        let at = self.services.iter().position(|word| word.name == service);
        let Some((index, call)) = at.zip(self.instance.of.service) else { return Err(failed(format!("it has no service '{service}'"))) };
        let name = CString::new(service).map_err(|why| failed(why.to_string()))?;
        // One call at a time, and none after closing.
        let _held = self.instance.busy.lock().unwrap_or_else(PoisonError::into_inner);
        if self.instance.is_closed.load(Ordering::Acquire) {
            return Err(failed("the device is closed".to_owned()));
        }
        // The call may have waited for another service.
        if is_stopped() {
            return Err(under_a_stop(service));
        }
        let mut host = Host::of(&self.defaults[index], &checked);
        // SAFETY: the memory is the driver's own and lives as long as the instance; host and name outlive the call.
        host.call(|host| unsafe { call(self.instance.memory(), host, name.as_ptr()) }).map_err(failed)?;
        match (&host.answer, self.services[index].answer) {
            (None, None) => Ok(Value::Null),
            (Some(json), Some(kind)) => answered(json, kind).ok_or_else(|| failed(format!("its answer to '{service}', {json}, is not of the declared kind"))),
            (None, Some(_)) => Err(failed(format!("service '{service}' declares an answer but returns none"))),
            (Some(_), None) => Err(failed(format!("service '{service}' returns an answer but declares none"))),
        }
    }
}

/// Returns an answer of the declared kind; `None` if it is of a different kind.
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

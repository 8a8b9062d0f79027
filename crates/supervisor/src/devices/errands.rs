// SPDX-License-Identifier: Apache-2.0
//! Service calls and device searches in progress, each kept until its answer has been fetched.
use crate::refuse::refuse;
use device::ServiceError;
use model::refusal::{Class, Refusals};
use serde_json::Value as Json;
use std::collections::BTreeMap;
use std::sync::{Arc, Condvar, Mutex, PoisonError};

/// Maximum number of service calls, including finished ones whose answer has not been fetched.
const ERRANDS_MAX: usize = 64;

/// Service calls in progress.
#[derive(Default)]
pub(crate) struct Errands {
    last: u64,
    out: BTreeMap<u64, Arc<Errand>>,
}

/// A service call or search in progress, kept until its answer has been fetched.
pub(crate) struct Errand {
    /// Subject of the call: `device 'line'`, `driver 'feetech'`.
    pub of: String,
    /// Kind of the call: `service 'home'`, `a search`.
    pub what: String,
    pub answer: Mutex<Option<Result<Json, ServiceError>>>,
    pub answered: Condvar,
}

impl Errands {
    /// Adds a service call and returns its number. If there are too many, finished ones whose answer was not fetched are dropped.
    pub fn begin(&mut self, of: String, what: String) -> Result<(u64, Arc<Errand>), Refusals> {
        if self.out.len() >= ERRANDS_MAX {
            self.out.retain(|_, errand| !errand.is_over());
        }
        if self.out.len() >= ERRANDS_MAX {
            let message = format!("{of} cannot be asked for {what}: drivers are carrying out {ERRANDS_MAX} services already");
            return Err(refuse(Class::InvalidState, message, "wait for one of them"));
        }
        self.last += 1;
        let errand = Arc::new(Errand { of, what, answer: Mutex::default(), answered: Condvar::new() });
        self.out.insert(self.last, errand.clone());
        Ok((self.last, errand))
    }

    pub fn get(&self, number: u64) -> Option<Arc<Errand>> {
        self.out.get(&number).cloned()
    }

    /// Removes a call whose answer has been fetched.
    pub fn remove(&mut self, number: u64) {
        self.out.remove(&number);
    }
}

impl Errand {
    pub fn end(&self, answer: Result<Json, ServiceError>) {
        *self.answer.lock().unwrap_or_else(PoisonError::into_inner) = Some(answer);
        self.answered.notify_all();
    }

    fn is_over(&self) -> bool {
        self.answer.lock().unwrap_or_else(PoisonError::into_inner).is_some()
    }

    pub fn refused(&self, why: ServiceError) -> Refusals {
        let Errand { of, what, .. } = self;
        match why {
            ServiceError::Unknown(why) => refuse(Class::UnknownName, format!("{of}: {why}"), ""),
            ServiceError::Arguments(why) => refuse(Class::CallError, format!("{of}: {why}"), ""),
            ServiceError::Failed(why) => refuse(Class::DeviceFailed, format!("{of} did not carry out {what}: {why}"), ""),
        }
    }
}

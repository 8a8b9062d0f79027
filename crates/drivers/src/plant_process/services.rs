// SPDX-License-Identifier: Apache-2.0
//! Services of a driver that runs in a process of its own, over a separate link.
use super::plant_messages::{Answer, Ask};
use device::{DeviceError, ServiceWord, Services, under_a_stop};
use process_kit::UnixLink;
use serde_json::Value;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

/// Period at which a waiting call checks that the process from which it expects an answer still exists.
const LOOK: Duration = Duration::from_secs(1);

pub(super) struct PlantServices {
    pub words: &'static [ServiceWord],
    /// Link; `None` after closing.
    pub link: Mutex<Option<UnixLink>>,
    /// Number of times that the device has been brought to its safe state since it was opened.
    pub rests: AtomicU64,
}

impl PlantServices {
    /// Marks the device as closed. A waiting call returns when its process exits.
    pub fn close(&self) {
        if let Ok(mut link) = self.link.try_lock() {
            *link = None;
        }
    }
}

impl Services for PlantServices {
    fn words(&self) -> Option<&'static [ServiceWord]> {
        Some(self.words)
    }

    fn call(&self, service: &str, arguments: &Value) -> Result<Value, DeviceError> {
        self.ask(Ask::Serve(service.to_owned(), arguments.clone()))
    }

    fn call_moving(&self, service: &str, arguments: &Value, is_stopped: &dyn Fn() -> bool) -> Result<Value, DeviceError> {
        // The order matters: a stop that is latched after the check increments the number after this read.
        let rests = self.rests.load(Ordering::Acquire);
        if is_stopped() {
            return Err(under_a_stop(service));
        }
        self.ask(Ask::Move(service.to_owned(), arguments.clone(), rests))
    }
}

impl PlantServices {
    fn ask(&self, ask: Ask) -> Result<Value, DeviceError> {
        let failed = |message: &str| DeviceError { message: message.to_owned() };
        // One call at a time.
        let link = self.link.lock().unwrap_or_else(PoisonError::into_inner);
        let Some(link) = &*link else { return Err(failed("the device is closed")) };
        let frame = serde_json::to_vec(&ask).expect("a request has no map whose keys are not texts");
        link.send_with(&frame, &[], Some(LOOK)).map_err(|_| failed("its process has exited"))?;
        loop {
            let Some((frame, _)) = link.receive_with(LOOK).map_err(|_| failed("its process ended before it answered"))? else { continue };
            return match serde_json::from_slice(&frame) {
                Ok(Answer::Served(value)) => Ok(value),
                Ok(Answer::Refused(why)) => Err(DeviceError { message: why }),
                _ => Err(failed("its process returned an invalid answer")),
            };
        }
    }
}

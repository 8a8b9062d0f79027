// SPDX-License-Identifier: Apache-2.0
//! Services of a servo bus off its cycle. A caller leaves a request, which the exchanging thread carries out between two exchanges,
//! because the line can have only one transmitter.
use super::calibration::{self, Calibration};
use device::{DeviceError, Kind, OptionWord, Reach, ServiceWord, Services};
use serde_json::Value;
use std::path::PathBuf;
use std::sync::mpsc::{SyncSender, sync_channel};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

/// Time limit for a request to be taken by the exchanging thread and carried out there.
const PATIENCE: Duration = Duration::from_secs(10);

const SERVO: OptionWord = OptionWord::needed("servo", Kind::Text, "name of the joint");
const ADDRESS: OptionWord = OptionWord::needed("address", Kind::Whole, "address in its control table").within(0.0, 65535.0);
const LENGTH: OptionWord = OptionWord::needed("length", Kind::Whole, "bytes: 1, 2 or 4").within(1.0, 4.0);
const VALUE: OptionWord = OptionWord::needed("value", Kind::Whole, "the stored number, as in its control table").within(-2_147_483_648.0, 4_294_967_295.0);
const PATH: OptionWord = OptionWord::needed("path", Kind::Text, "the file").reaches(Reach::File);
const ONE_OR_ALL: OptionWord = OptionWord::with_default("servo", Kind::Text, "all", "name of a joint");

pub(super) const SERVICES: [ServiceWord; 5] = [
    ServiceWord { name: "read", doc: "reads a register of a servo", arguments: &[SERVO, ADDRESS, LENGTH], answer: Some(Kind::Whole), moves: false },
    ServiceWord {
        name: "write",
        doc: "stores to a register of a servo whose torque is off",
        arguments: &[SERVO, ADDRESS, LENGTH, VALUE],
        answer: None,
        moves: false,
    },
    ServiceWord {
        name: "record_zero",
        doc: "takes the present position of a joint as its zero in the next calibration",
        arguments: &[ONE_OR_ALL],
        answer: Some(Kind::Table),
        moves: false,
    },
    ServiceWord {
        name: "record_ranges",
        doc: "starts recording the end positions between which joints are moved by hand",
        arguments: &[],
        answer: Some(Kind::Table),
        moves: false,
    },
    ServiceWord {
        name: "save_calibration",
        doc: "writes what was recorded; it takes effect when a device is opened with it",
        arguments: &[PATH],
        answer: Some(Kind::Table),
        moves: false,
    },
];

/// Request to the exchanging thread.
pub(super) struct Request {
    pub(super) service: String,
    pub(super) arguments: Value,
    answer: SyncSender<Result<Value, DeviceError>>,
}

impl Request {
    pub(super) fn answered(self, answer: Result<Value, DeviceError>) {
        // The requester may have given up.
        let _ = self.answer.send(answer);
    }
}

/// Slot for one request.
#[derive(Default)]
pub(super) struct Desk {
    place: Mutex<Option<Request>>,
    /// Lock that is held by the caller whose turn it is.
    turn: Mutex<()>,
}

impl Desk {
    /// Takes the request, if there is one, without waiting.
    pub(super) fn take(&self) -> Option<Request> {
        self.place.try_lock().ok().and_then(|mut place| place.take())
    }
}

impl Services for Desk {
    fn call(&self, service: &str, arguments: &Value) -> Result<Value, DeviceError> {
        let _turn = self.turn.lock().unwrap_or_else(PoisonError::into_inner);
        let (answer, answers) = sync_channel(1);
        let request = Request { service: service.to_owned(), arguments: arguments.clone(), answer };
        *self.place.lock().unwrap_or_else(PoisonError::into_inner) = Some(request);
        let answered = answers.recv_timeout(PATIENCE).unwrap_or_else(|_| {
            self.place.lock().unwrap_or_else(PoisonError::into_inner).take();
            Err(DeviceError {
                message: format!("service '{service}': no exchange carried it out within {} s; the device is lost or closed", PATIENCE.as_secs()),
            })
        })?;
        if service == "save_calibration" {
            let failed = |message: String| DeviceError { message: format!("the calibration was not saved: {message}") };
            let entries: Calibration = serde_json::from_value(answered.clone()).map_err(|why| failed(why.to_string()))?;
            calibration::write(&PathBuf::from(arguments["path"].as_str().unwrap_or_default()), &entries).map_err(failed)?;
        }
        Ok(answered)
    }
}

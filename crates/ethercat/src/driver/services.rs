// SPDX-License-Identifier: Apache-2.0
//! Services of the driver outside its cycle.
use crate::main_device::{Bus, Mailbox};
use cia402::Entry;
use cia402::axis::{HOME, READ_OBJECT, RESET_FAULT, Reach, ServiceState, WRITE_OBJECT, is_told_of_stops};
use device::{DeviceError, ServiceWord, Services};
use serde_json::Value;

pub(super) const SERVICES: [ServiceWord; 4] = [READ_OBJECT, WRITE_OBJECT, RESET_FAULT, HOME];

/// A connection to the mailboxes of the drives, separate from that of the cycle.
pub(super) struct Mailboxes {
    pub bus: Bus,
    pub of_axes: Vec<Mailbox>,
}

impl Reach for Mailboxes {
    fn upload(&mut self, axis: usize, of: Entry) -> Result<Vec<u8>, String> {
        self.of_axes[axis].upload(&mut self.bus, of)
    }

    fn download(&mut self, axis: usize, of: Entry, value: &[u8]) -> Result<(), String> {
        self.of_axes[axis].download(&mut self.bus, of, value)
    }
}

/// The services of an open device.
pub(super) struct Beside(pub ServiceState<Mailboxes>);

impl Services for Beside {
    fn is_told_of_stops(&self, service: &str) -> bool {
        is_told_of_stops(service)
    }

    fn call(&self, service: &str, arguments: &Value) -> Result<Value, DeviceError> {
        self.call_moving(service, arguments, &|| false)
    }

    fn call_moving(&self, service: &str, arguments: &Value, is_stopped: &dyn Fn() -> bool) -> Result<Value, DeviceError> {
        self.0.carry_out(service, arguments, is_stopped).map_err(|message| DeviceError { message })
    }
}

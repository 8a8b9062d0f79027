// SPDX-License-Identifier: Apache-2.0
//! Service `place`: sets the position of a simulated arm, at rest. The source never waits for it: the result of the service takes effect
//! at the next reading.
use super::arm::Joint;
use device::{DeviceError, Kind, OptionWord, ServiceWord, Services, UNLIMITED};
use serde_json::Value;
use std::sync::{Arc, Mutex, PoisonError};

pub(super) const SERVICES: [ServiceWord; 1] = [ServiceWord {
    name: "place",
    doc: "moves the arm at once, at rest and otherwise as at the start, from the next reading on",
    arguments: &PLACE,
    answer: None,
    moves: true,
}];

const PLACE: [OptionWord; 1] =
    [OptionWord::with_default("positions", Kind::List, "the initial position", "positions of its joints, in the order of its parts, in rad or m")
        .within(-UNLIMITED, UNLIMITED)];

/// Positions set by a service since the last reading.
pub(super) struct Places {
    joints: Vec<Joint>,
    asked: Mutex<PlacingRequest>,
}

struct PlacingRequest {
    is_new: bool,
    positions: Vec<f64>,
}

impl Places {
    pub fn new(joints: &[Joint]) -> Arc<Places> {
        Arc::new(Places { joints: joints.to_vec(), asked: Mutex::new(PlacingRequest { is_new: false, positions: vec![0.0; joints.len()] }) })
    }

    /// Copies the positions that were set; returns false if there are none. Real-time safe: if a service holds the lock, its positions
    /// take effect at the next reading.
    pub fn take(&self, positions: &mut [f64]) -> bool {
        let Ok(mut asked) = self.asked.try_lock() else { return false };
        if asked.is_new {
            positions.copy_from_slice(&asked.positions);
        }
        std::mem::take(&mut asked.is_new)
    }

    fn positions(&self, given: &Value) -> Result<Vec<f64>, String> {
        let Some(list) = given.as_array() else { return Ok(self.joints.iter().map(|joint| joint.part.home).collect()) };
        if list.len() != self.joints.len() {
            return Err(format!("{} positions for {} joints: give one for each of {}", list.len(), self.joints.len(), self.names()));
        }
        let of = |(joint, value): (&Joint, &Value)| {
            let (name, least, most, unit) = (&joint.part.name, joint.part.range_min, joint.part.range_max, joint.part.unit);
            match value.as_f64() {
                None => Err(format!("the position of '{name}' is {value}, which is not a number")),
                Some(position) if (least..=most).contains(&position) => Ok(position),
                Some(position) => Err(format!("the position {position} {unit} of '{name}' is outside its range, {least} to {most} {unit}")),
            }
        };
        self.joints.iter().zip(list).map(of).collect()
    }

    fn names(&self) -> String {
        self.joints.iter().map(|joint| joint.part.name.as_str()).collect::<Vec<_>>().join(", ")
    }
}

impl Services for Places {
    fn call(&self, service: &str, arguments: &Value) -> Result<Value, DeviceError> {
        if service != SERVICES[0].name {
            return Err(DeviceError { message: format!("there is no service '{service}'") });
        }
        let positions = self.positions(&arguments["positions"]).map_err(|message| DeviceError { message })?;
        *self.asked.lock().unwrap_or_else(PoisonError::into_inner) = PlacingRequest { is_new: true, positions };
        Ok(Value::Null)
    }
}

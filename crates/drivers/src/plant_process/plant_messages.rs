// SPDX-License-Identifier: Apache-2.0
//! Messages between a driver and its plant process outside real time: one JSON text per frame.
use device::{Channel, Direction, Slot};
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// Request to the plant process. Each request has one [`Answer`].
#[derive(Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Ask {
    /// Creates the driver. Must be the first request; sent once.
    Make(PlantOrigin),
    Describe,
    /// Opens a new session: its memory is sent with the answer, and the previous session is cut off.
    Open,
    /// Closes the plant; allowed for the holder of the session, or for any client if there is none.
    Close,
    State,
    /// Calls a service of the driver, with arguments that have been checked. It runs between two steps.
    Serve(String, Value),
    /// Calls a service that moves the machine, with the number of safe-state requests at the time when the call was admitted.
    Move(String, Value, u64),
}

/// Origin of a plant.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct PlantOrigin {
    pub kind: String,
    pub options: Value,
    pub step_ns: Option<i64>,
    pub linger_ns: i64,
    pub timeout_ns: Option<i64>,
    /// Time without commands after which a driver in a process of its own brings its outputs to their safe state; `None` for a machine.
    /// The process of such a driver exits, with its outputs safe, as soon as no client is connected.
    pub rest_ns: Option<i64>,
    pub name: Option<String>,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Answer {
    Described(Box<PlantDescription>),
    Opened,
    Closed,
    State(PlantState),
    Served(Value),
    Refused(String),
}

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct PlantDescription {
    pub made: PlantOrigin,
    pub channels: Vec<ChannelText>,
    /// Description provided by the driver.
    pub about: Value,
    pub step_ns: i64,
}

/// State of a plant process, for a client that only observes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlantState {
    /// True if the plant obeys its safe commands, and has completed at least one step under them.
    pub is_safe: bool,
    /// Time at which the first step under the safe commands began, on the monotonic clock of the host, ns; 0 if the plant is not safe.
    pub obeyed_ns: i64,
    /// Number of steps since the plant was created.
    pub steps: u64,
    /// Reason why the plant has stopped, if it has.
    pub failed: Option<String>,
    /// Newest readings, in the layout of the channels.
    pub readings: Vec<u8>,
    /// Process ID.
    pub pid: u32,
}

/// A [`Channel`] in a format that can be sent.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct ChannelText {
    name: String,
    write: bool,
    type_text: String,
    unit: String,
    doc: String,
    offset: usize,
    len: usize,
    safe: Vec<u8>,
    slew_max: Option<f64>,
}

impl From<&Channel> for ChannelText {
    fn from(of: &Channel) -> ChannelText {
        let Channel { name, direction, type_text, unit, doc, offset, len, safe, slew_max } = of.clone();
        ChannelText { name, write: direction == Direction::Write, type_text, unit, doc, offset, len, safe, slew_max }
    }
}

impl From<ChannelText> for Channel {
    fn from(of: ChannelText) -> Channel {
        let ChannelText { name, write, type_text, unit, doc, offset, len, safe, slew_max } = of;
        Channel { name, direction: if write { Direction::Write } else { Direction::Read }, type_text, unit, doc, offset, len, safe, slew_max }
    }
}

/// Returns the slot of the age of the readings, for a process whose driver declares one.
pub(super) fn age_of(channels: &[Channel], about: &Value) -> Option<Slot> {
    let of = channels.iter().find(|channel| Some(channel.name.as_str()) == about["age"].as_str())?;
    Some(Slot { offset: of.offset, len: of.len }).filter(|slot| slot.len == size_of::<f64>())
}

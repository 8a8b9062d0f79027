// SPDX-License-Identifier: Apache-2.0
//! Messages between a driver and its plant process while nothing is in real time: one JSON text a frame.
use device::{Channel, Direction, Slot};
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// To the plant process. Each has one [`Answer`].
#[derive(Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Ask {
    /// First of all, once: which driver it runs.
    Make(PlantOrigin),
    Describe,
    /// A new session: memory comes with the answer, and the one before is cut off.
    Open,
    /// The plant is put away; from the holder of the session, or anybody where there is none.
    Close,
    State,
    /// A service of the driver, with arguments that were checked. It is carried out between two steps.
    Serve(String, Value),
    /// Calls a service that moves the machine, with the number of times that the safe state had been asked for when it was let through.
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
    /// Time without commands after which the outputs of a driver in a process of its own rest, where others are machines; it ends,
    /// safe, as soon as nobody is connected.
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
    /// Description by the driver.
    pub about: Value,
    pub step_ns: i64,
}

/// State of a plant process, for a client that watches it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlantState {
    /// True if it obeys its safe commands, and has at least one step behind it in which it did.
    pub is_safe: bool,
    /// When that step began, on the monotonic clock of the host, ns; 0 while it is not safe.
    pub obeyed_ns: i64,
    /// Steps since it was made.
    pub steps: u64,
    /// Reason why it does not go on, if it does not.
    pub failed: Option<String>,
    /// The newest readings, as the channels lie.
    pub readings: Vec<u8>,
    /// Number of the process.
    pub pid: u32,
}

/// A [`Channel`] that can be sent.
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

/// Returns the channel that says how old readings are, of a process whose driver names it.
pub(super) fn age_of(channels: &[Channel], about: &Value) -> Option<Slot> {
    let of = channels.iter().find(|channel| Some(channel.name.as_str()) == about["age"].as_str())?;
    Some(Slot { offset: of.offset, len: of.len }).filter(|slot| slot.len == size_of::<f64>())
}

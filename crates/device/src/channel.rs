// SPDX-License-Identifier: Apache-2.0
//! Channel of a physical device, and its description.
use crate::types::Type;

/// Direction of a channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Direction {
    /// Read from the machine.
    Read,
    /// Written to the machine.
    Write,
}

/// A typed, unit-carrying channel of a physical device.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct Channel {
    /// `part.channel`, for example `elbow.position`; unique within its device.
    pub name: String,
    /// Direction of the channel.
    pub direction: Direction,
    /// C type, such as `double`.
    pub type_text: String,
    /// Unit, or empty if none.
    pub unit: String,
    /// Description, one line.
    pub doc: String,
    /// Offset in the readings or the commands.
    pub offset: usize,
    /// Length in bytes.
    pub len: usize,
    /// Safe value of a write channel, as bytes of the type.
    pub safe: Vec<u8>,
    /// Maximum rate of change of a write channel of type `double`, in units per second; enforced and counted in the write step.
    pub slew_max: Option<f64>,
}

impl Channel {
    /// Creates a read channel. [`Layout::add`](crate::Layout::add) assigns its offset.
    pub fn read(name: impl Into<String>, of: Type) -> Channel {
        Channel::new(name.into(), Direction::Read, of, Vec::new())
    }

    /// Creates a write channel; its safe value is 0 unless [`Channel::safe`] sets another.
    pub fn write(name: impl Into<String>, of: Type) -> Channel {
        Channel::new(name.into(), Direction::Write, of, vec![0; of.len()])
    }

    fn new(name: String, direction: Direction, of: Type, safe: Vec<u8>) -> Channel {
        Channel { name, direction, type_text: of.to_string(), unit: String::new(), doc: String::new(), offset: 0, len: of.len(), safe, slew_max: None }
    }

    /// Sets the unit.
    pub fn unit(self, unit: impl Into<String>) -> Channel {
        Channel { unit: unit.into(), ..self }
    }

    /// Sets the description.
    pub fn doc(self, doc: impl Into<String>) -> Channel {
        Channel { doc: doc.into(), ..self }
    }

    /// Sets the safe value, as bytes of the type.
    pub fn safe(self, safe: Vec<u8>) -> Channel {
        Channel { safe, ..self }
    }

    /// Sets the maximum rate of change, in units per second; `None` removes the limit.
    pub fn slew(self, slew_max: Option<f64>) -> Channel {
        Channel { slew_max, ..self }
    }
}

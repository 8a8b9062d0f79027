// SPDX-License-Identifier: Apache-2.0
//! Messages between a commander and its processor: `postcard` frames, one value each.
use device::{Channel, ServiceError};
use kernel::{BlockId, BlockTimes, DeviceCall, SourceId, SourceSpec, Statistics, TakeResult};
use runtime::DeviceState;
use runtime::encoding::{EventAs, Parcel};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

/// Version of the protocol; sides with different versions disconnect with a message.
pub const VERSION: u32 = 7;

/// Order to the processor.
#[derive(Debug, Serialize, Deserialize)]
pub enum Order {
    /// First message. `epoch_ns`: epoch of the system, on CLOCK_MONOTONIC of the commanding host.
    Greet { version: u32, abi: u32, system: String, processor: String, epoch_ns: i64 },
    /// The next source of the system, local or remote; sources are numbered in this order.
    Source { ticket: u64, spec: SourceSpec, here: bool },
    /// A script for a source.
    Work { source: SourceId, submission: u64, parcel: Parcel },
    /// Fires a software source.
    Request { source: SourceId },
    /// Restarts a source that a fault stopped.
    Restart { source: SourceId },
    /// Takes a process from the kernels for the supervisor.
    Take { ticket: u64, process: u64, generation: u32, insist: bool },
    /// A process spread over several locations has entered this stage.
    Enter { process: u64, stage: u16, generation: u32 },
    /// A code module: its key, name and bytes.
    Module { ticket: u64, key: String, name: String, bytes: Vec<u8> },
    /// Opens a device; `options`: JSON.
    Open { ticket: u64, device: String, kind: String, options: String },
    /// Requests a service of a driver; `arguments`: JSON. The answer may take a long time.
    Service { ticket: u64, device: String, service: String, arguments: String },
    /// Closes a device as soon as no table contains it.
    Shut { device: String },
    /// Makes a call on a device.
    Device { device: String, call: DeviceCall },
    /// Sets or clears the emergency-stop flag.
    Stop { set: bool },
    /// Sets what happens to a process in a source if its supervisor disconnects: it continues, or this script is carried out. Valid from
    /// the start of a verb instance to its end.
    Farewell { process: u64, source: SourceId, parcel: Option<Parcel> },
    /// Ends the farewell of a process in a source.
    NoFarewell { process: u64, source: SourceId },
    /// Indicates that the commander is alive; sent if there is nothing else to send.
    Alive,
    /// Sets time limits. `silence_ms`: maximum silence of the commander. `ms`: time for which continuing processes then wait for the next
    /// commander. `standstill_ms`: maximum suspension of the processor's timers, if set.
    Patience { ms: u64, silence_ms: u64, standstill_ms: Option<u64> },
    /// Ends the service: devices are made safe, and everything is closed. If the commander has not taken over any process, running
    /// processes continue.
    Close,
    /// Takes over the processes that ran in the processor without a supervisor: they continue in the sources that this side has created
    /// since.
    TakeOver { ticket: u64 },
    /// Measures the durations of the blocks of a source for this time.
    Probe { source: SourceId, for_ns: u64 },
}

/// Message from the processor.
#[derive(Debug, Serialize, Deserialize)]
pub enum News {
    /// Answer to the greeting. `refused`: reason for not serving.
    Welcome { version: u32, abi: u32, target: String, pid: u32, refused: Option<String> },
    /// Answer to the order with this ticket.
    Answer { ticket: u64, answer: Answer },
    /// Events of the kernels, in order.
    Events { events: Vec<EventAs>, devices: Vec<(String, DeviceState)> },
    /// A channel of the processor raised a remote source.
    Raised { source: SourceId },
    /// State of the processor.
    Beat(Beat),
    /// An order could not be carried out because the two sides disagree.
    Broken { message: String },
}

/// Answer to an order with a ticket.
#[derive(Debug, Serialize, Deserialize)]
pub enum Answer {
    Done,
    Refused(String),
    Taken(Option<TakeResult>),
    Opened {
        channels: Vec<Channel>,
        description: String,
    },
    TakenOver(TakenOver),
    /// JSON.
    Served(Result<String, ServiceError>),
}

/// Result of taking over processes.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct TakenOver {
    /// Blocks that continue, by label.
    pub carried: Vec<String>,
    /// Blocks that restart, by label, each with a human-readable reason.
    pub anew: Vec<(String, String)>,
    /// Blocks that ran before but were not started again, and so have ended.
    pub ended: Vec<String>,
    /// Maximum time from the last write of a device before the takeover to its first write after it, ns. `None` if no device was written.
    pub gap_ns: Option<i64>,
}

/// Counters of a driver, by name.
pub type DriverCounters = Vec<(String, u64)>;

/// A row of a ring: number of rows lost before it, number, time, bytes.
pub type RowAs = (u64, u64, i64, Vec<u8>);

/// State of a processor.
#[derive(Debug, Default, Serialize, Deserialize)]
pub struct Beat {
    /// Time on the processor's own clock, ns since the epoch of the system.
    pub now_ns: i64,
    pub sources: Vec<(SourceId, Statistics)>,
    /// Durations of the blocks sampled since the last beat.
    pub blocks: Vec<(BlockId, BlockTimes)>,
    /// Inbound connections: release time of the last latched publication, and time since which a ratio value has been late.
    pub inbounds: Vec<(u64, Option<i64>, Option<i64>)>,
    pub devices: Vec<(String, DeviceState)>,
    /// Counters of the devices' drivers, by name.
    pub counted: Vec<(String, DriverCounters)>,
    /// New rows of each ring, older rings first. If more rows were written than the ring holds, only the rows still in the ring are
    /// included. In any case, their number is limited to the capacity of a ring on the commanding side.
    pub rows: Vec<(u64, Vec<RowAs>)>,
}

/// Returns the bytes of a frame.
pub fn frame(of: &impl Serialize) -> Vec<u8> {
    postcard::to_stdvec(of).expect("frames are plain values, which all have bytes")
}

/// Decodes a frame. Fails with a message if the bytes are not a frame.
pub fn opened<T: DeserializeOwned>(frame: &[u8]) -> Result<T, String> {
    postcard::from_bytes(frame).map_err(|why| format!("this is not a frame of version {VERSION}: {why}"))
}

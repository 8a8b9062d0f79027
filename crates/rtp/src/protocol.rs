// SPDX-License-Identifier: Apache-2.0
//! Messages between a commander and its processor: frames of `postcard`, one value each.
use device::{Channel, ServiceError};
use kernel::{BlockId, BlockTimes, DeviceCall, SourceId, SourceSpec, Statistics, TakeResult};
use runtime::DeviceState;
use runtime::encoding::{EventAs, Parcel};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

/// Both sides speak the same version, or they part with words.
pub const VERSION: u32 = 6;

/// To the processor.
#[derive(Debug, Serialize, Deserialize)]
pub enum Order {
    /// First. `now_ns`: what the clock of the system shows as this is sent.
    Greet { version: u32, abi: u32, system: String, processor: String, epoch_ns: i64 },
    /// The next source of the system, here or remote: they are called by their order.
    Source { ticket: u64, spec: SourceSpec, here: bool },
    /// A script for a source.
    Work { source: SourceId, submission: u64, parcel: Parcel },
    /// Fires a software source.
    Request { source: SourceId },
    /// Restarts a source that a fault stopped.
    Restart { source: SourceId },
    /// Takes a process from the kernels.
    Take { ticket: u64, process: u64, generation: u32, insist: bool },
    /// A process that reaches over several places is in this stage.
    Enter { process: u64, stage: u16, generation: u32 },
    /// A code module: its key, name and bytes.
    Module { ticket: u64, key: String, name: String, bytes: Vec<u8> },
    /// Opens a device; `options`: JSON.
    Open { ticket: u64, device: String, kind: String, options: String },
    /// A service of a driver; `arguments`: JSON. Its answer may last.
    Service { ticket: u64, device: String, service: String, arguments: String },
    /// Closes it, once no table has it.
    Shut { device: String },
    /// Asks something of a device.
    Device { device: String, call: DeviceCall },
    /// Sets or clears the flag of the emergency stop.
    Stop { set: bool },
    /// Says what becomes of a process in a source if its supervisor is gone: it goes on, or this script is carried out. From the start of a verb
    /// instance to its end.
    Farewell { process: u64, source: SourceId, parcel: Option<Parcel> },
    /// Its end.
    NoFarewell { process: u64, source: SourceId },
    /// The commander lives: sent where it has nothing else to send.
    Alive,
    /// Bounds for the commander's silence (`silence_ms`), and for how long the processes that go on then wait for the next
    /// commander (`ms`). `standstill_ms`: how long the timers there may stand still, where that was said.
    Patience { ms: u64, silence_ms: u64, standstill_ms: Option<u64> },
    /// The end: devices safe, everything closed; of one that has taken nothing over, what runs goes on.
    Close,
    /// Lets the processes that ran there without a supervisor go on in the sources that this side has made since.
    TakeOver { ticket: u64 },
    /// Takes the times of the blocks of a source for so long.
    Probe { source: SourceId, for_ns: u64 },
}

/// Message from the processor.
#[derive(Debug, Serialize, Deserialize)]
pub enum News {
    /// Answer to the greeting. `refused`: why it does not serve.
    Welcome { version: u32, abi: u32, target: String, pid: u32, refused: Option<String> },
    /// Answer to the order with this ticket.
    Answer { ticket: u64, answer: Answer },
    /// Events of the kernels, in order.
    Events { events: Vec<EventAs>, devices: Vec<(String, DeviceState)> },
    /// A channel there raises a remote source.
    Raised { source: SourceId },
    /// State of the processor.
    Beat(Beat),
    /// An order that cannot be carried out: the two sides disagree.
    Broken { message: String },
}

/// To an order with a ticket.
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

/// Result of a take-over.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct TakenOver {
    /// Blocks that go on, by label.
    pub carried: Vec<String>,
    /// Blocks that begin again, by label, each with the reason in words.
    pub anew: Vec<(String, String)>,
    /// Blocks that ran and were not started again: they have ended.
    pub ended: Vec<String>,
    /// Longest time from the last write of a device before to its first write after, ns. None where none was written.
    pub gap_ns: Option<i64>,
}

/// Counters of a driver, by name.
pub type DriverCounters = Vec<(String, u64)>;

/// A row of a ring: how many before it were lost, number, time, bytes.
pub type RowAs = (u64, u64, i64, Vec<u8>);

/// State of a processor.
#[derive(Debug, Default, Serialize, Deserialize)]
pub struct Beat {
    /// Its own clock, ns since the epoch of the system.
    pub now_ns: i64,
    pub sources: Vec<(SourceId, Statistics)>,
    /// Durations of the blocks that were visited since.
    pub blocks: Vec<(BlockId, BlockTimes)>,
    /// Inbound connections: what was brought last, and since when a ratio value is late.
    pub inbounds: Vec<(u64, Option<i64>, Option<i64>)>,
    pub devices: Vec<(String, DeviceState)>,
    /// Counters of the devices' drivers, by name.
    pub counted: Vec<(String, DriverCounters)>,
    /// New rows of each ring, those of older rings first. Where more were written than it holds, those that it holds: as many as a
    /// ring on the commanding side has.
    pub rows: Vec<(u64, Vec<RowAs>)>,
}

/// Returns the bytes of a frame.
pub fn frame(of: &impl Serialize) -> Vec<u8> {
    postcard::to_stdvec(of).expect("frames are plain values, which all have bytes")
}

/// Decodes a frame. Errors: bytes that are no frame, in words.
pub fn opened<T: DeserializeOwned>(frame: &[u8]) -> Result<T, String> {
    postcard::from_bytes(frame).map_err(|why| format!("this is no frame of version {VERSION}: {why}"))
}

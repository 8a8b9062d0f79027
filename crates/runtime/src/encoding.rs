// SPDX-License-Identifier: Apache-2.0
//! Encoding of scripts and tables that a host sends to a kernel in another process or on another host.
//!
//! The supervisor builds tables and scripts from blocks, cells and connections as for a local source, but here these objects are only
//! kept. [`Writer`] assigns a number to each object when a script first refers to it, and describes it once; [`Reader`] creates it where
//! the source runs. Objects that are no longer referenced are dropped on both sides. Before anything runs, the contents of memory are
//! sent as they are; addresses are never sent, because each side has its own.
//!
//! [`Reader`] returns an error if the bytes are inconsistent, whatever the input, and accesses only objects that it created.
mod read;
mod write;

pub use read::{Ground, Reader};
pub use write::Writer;

use interconnect::ConnectionSpec;
use kernel::edge::Number;
use kernel::{BlockId, Event, Reach, SourceId};
use serde::{Deserialize, Serialize};

/// Position of a cell: number of its extent, offset, length.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct CellAt(u64, u64, u64);

/// A block of a code module, as both sides identify it: by the module's key and the block's name.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct CodeName {
    /// `library`, or the hash of a code module.
    pub module: String,
    /// Name of the block in the module.
    pub block: String,
}

/// Rule that determines when an activation is due.
#[derive(Clone, Debug, Serialize, Deserialize)]
enum DueAs {
    Interval,
    Driven(Vec<(u64, u32)>),
    Queued(Vec<(u64, u32)>, Vec<(u64, u32)>),
}

#[derive(Clone, Debug, Serialize, Deserialize)]
struct MemberAs {
    cell: CellAt,
    offset: u64,
    activation: Option<u64>,
    ratio: u32,
}

/// Number and properties of a connection.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct WayAs {
    number: u64,
    writer: u32,
    reader: u32,
    asynchronous_len: u64,
    queue_row_len: u64,
    queue_depth: u64,
    reach: Reach,
}

impl WayAs {
    fn of(way: &kernel::Way) -> WayAs {
        let ConnectionSpec { writer, reader, asynchronous_len, queue_row_len, queue_depth } = way.spec;
        let (asynchronous_len, queue_row_len, queue_depth) = (asynchronous_len as u64, queue_row_len as u64, queue_depth as u64);
        WayAs { number: way.number, writer, reader, asynchronous_len, queue_row_len, queue_depth, reach: way.reach }
    }

    fn way(&self) -> kernel::Way {
        let spec = ConnectionSpec {
            writer: self.writer,
            reader: self.reader,
            asynchronous_len: self.asynchronous_len as usize,
            queue_row_len: self.queue_row_len as usize,
            queue_depth: self.queue_depth as usize,
        };
        kernel::Way { number: self.number, spec, reach: self.reach }
    }
}

#[derive(Clone, Debug, Serialize, Deserialize)]
struct WatchAs {
    block: Option<BlockId>,
    item: u8,
    condition: u16,
    priority: i32,
    response: ResponseAs,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
enum ResponseAs {
    React { ops: Vec<OpAs>, next: Option<u16> },
    Tell,
    Remember,
}

/// An object created by the other side, with its number there.
#[derive(Clone, Debug, Serialize, Deserialize)]
enum RemoteObject {
    Extent {
        number: u64,
        bytes: Vec<u8>,
    },
    Block {
        number: u64,
        id: BlockId,
        name: String,
        code: CodeName,
        memory: CellAt,
        initial: Vec<u8>,
        bound: Vec<Option<CellAt>>,
    },
    Activation {
        number: u64,
        due: DueAs,
        stamp: Option<CellAt>,
        budget_ns: Option<u64>,
    },
    Process {
        number: u64,
        id: u64,
        created: u64,
    },
    Stages {
        process: u64,
        stages: Vec<Vec<WatchAs>>,
    },
    Inbound {
        number: u64,
        way: WayAs,
        group: Vec<CellAt>,
        queue: Vec<MemberAs>,
    },
    Outbound {
        number: u64,
        way: WayAs,
        group: Vec<CellAt>,
        queue: Vec<MemberAs>,
        wake: Option<SourceId>,
    },
    Rows {
        number: u64,
        row_len: u64,
        depth: u64,
    },
    /// A device opened under this name on the other side, and numbers for its readings and commands.
    Device {
        number: u64,
        name: String,
        readings: u64,
        commands: u64,
    },
    Edge {
        number: u64,
        device: u64,
        channel: u32,
        kind: Number,
        raises: SourceId,
    },
    /// Objects that are no longer referenced.
    Forget {
        numbers: Vec<u64>,
    },
}

#[derive(Clone, Debug, Serialize, Deserialize)]
enum StepAs {
    Block(u64),
    Copy(Vec<(CellAt, CellAt)>),
    Append(Vec<AppendAs>),
}

#[derive(Clone, Debug, Serialize, Deserialize)]
struct AppendAs {
    block: u64,
    ratio: u32,
    value: CellAt,
    window: CellAt,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
struct TableAs {
    /// Steps as (work, activation, process, drivers).
    steps: Vec<(StepAs, u64, u64, Vec<u32>)>,
    inbound: Vec<u64>,
    outbound: Vec<u64>,
    devices: Vec<u64>,
    edges: Vec<u64>,
    rows: Vec<(Vec<CellAt>, u64)>,
    stamped: Vec<StampedAs>,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
struct StampedAs {
    block: u64,
    ratio: u32,
    stamp: CellAt,
    /// Value, and its ring.
    history: Option<(CellAt, u64)>,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
enum OpAs {
    Table(TableAs),
    Store(CellAt, Vec<u8>),
    Append { value: CellAt, window: CellAt },
    Fill { value: CellAt, window: CellAt },
    Copy(CellAt, CellAt),
    Reset(u64),
    Keep(u64, u64),
    On(u64, u32),
    Follow(u64, DueAs),
    Tune(u64, u32),
    Off(u64),
    Execute(Vec<u64>),
    Stage { process: u64, stage: u16, generation: Option<u32> },
    Advance { process: u64, generation: u32, from: u16, to: u16 },
    Forget,
    While { process: u64, generation: u32 },
    StartClock(u64),
    StopClock(u64),
    ResumeClock(u64),
    KeepClock(u64, u64),
    Capture(Vec<CellAt>),
    Engage { device: u64, channels: Vec<u16> },
    Safe { device: u64, channels: Vec<u16> },
    Renew { device: u64, is_open: bool },
    Look { device: u64 },
}

/// A script in transit, with every object to which it refers for the first time.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Parcel {
    made: Vec<RemoteObject>,
    ops: Vec<OpAs>,
}

/// An event in transit back. `submission` identifies the script of a `Done`.
#[derive(Debug, Serialize, Deserialize)]
pub enum EventAs {
    Done { source: SourceId, submission: u64, firing: u64, time_ns: i64, captured: Vec<u8> },
    Told(Event),
}

impl EventAs {
    /// Encodes an event of the other side; the script of an acknowledgement is identified by its number there. Returns `None` for events
    /// that only a host creates itself.
    pub fn of(event: Event) -> Option<EventAs> {
        match event {
            Event::Done { source, script, firing, time_ns, captured } => Some(EventAs::Done { source, submission: script.id, firing, time_ns, captured }),
            Event::Gone { .. } => None,
            event => Some(EventAs::Told(event)),
        }
    }

    /// Decodes an event on this side; `script` returns the script submitted under a number. Returns `None` for an acknowledgement of a
    /// script that was never submitted, and for events that only a host creates itself.
    pub fn event(self, script: impl FnOnce(u64) -> Option<Box<kernel::Script>>) -> Option<Event> {
        match self {
            EventAs::Done { source, submission, firing, time_ns, captured } => {
                Some(Event::Done { source, script: script(submission)?, firing, time_ns, captured })
            }
            EventAs::Told(Event::Gone { .. }) => None,
            EventAs::Told(event) => Some(event),
        }
    }
}

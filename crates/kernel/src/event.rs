// SPDX-License-Identifier: Apache-2.0
//! Events that kernels report to the supervisor.
use crate::block::BlockId;
use crate::script::{Mailbox, Script, Submission};
use crate::source::SourceId;
use rtrb::{Consumer, Producer, RingBuffer};
use std::collections::VecDeque;
use std::sync::atomic::{AtomicU64, Ordering};

/// Cause of a faulted invocation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Fault {
    /// The body returned a fault with this code.
    Returned(u32),
    /// The body panicked.
    Panic,
    /// An output was not finite; contains its item index.
    NonFinite(u8),
    /// A signal (SIGSEGV, SIGFPE, SIGBUS, SIGILL, SIGTRAP, SIGABRT) inside block code: the source has stopped, and its devices are safe.
    Signal(i32),
    /// The time budget was exceeded inside block code; the consequences are those of a signal.
    Budget,
    /// A signal (its number, or 0 for an exceeded budget) in code of a library that may hold a lock: the source has ended permanently,
    /// and its process can no longer be trusted.
    Lost(i32),
    /// A C++ exception escaped the body; the `value` of the event is its message.
    Threw,
    /// The body changed the floating-point control words. If the source has stopped, it is known only that one of its blocks did so.
    Floats,
    /// The body called fork(): the child was terminated, and the source stopped before it published anything of this firing.
    Forked,
}

/// An event, sent through a queue of fixed size for which the kernel never waits. Events that do not fit are counted, and their number is
/// reported. Acknowledgements (`Done`) have their own space and are never lost.
#[derive(Debug, serde::Serialize, serde::Deserialize)]
pub enum Event {
    /// A watched condition was reported. `acted`: this condition moved the process (to `stage`, or ended or froze it); for the other
    /// conditions of the firing, `acted` is false. `captured`: bytes from the `Capture` ops of its reaction script. `number`: the
    /// invocation that reported it (0 for a remembered condition that acts at a later stage). `alone`: no other condition was reported in
    /// the firing.
    Condition {
        source: SourceId,
        process: u64,
        generation: u32,
        condition: u16,
        block: BlockId,
        item: u8,
        fault: Option<Fault>,
        number: u64,
        time_ns: i64,
        alone: bool,
        acted: bool,
        ended: bool,
        stage: Option<u16>,
        value: Vec<u8>,
        captured: Vec<u8>,
    },
    /// A condition or fault without a watch was recorded. `value`: the value that the block reported with it.
    Unwatched { source: SourceId, process: u64, generation: u32, block: BlockId, item: u8, fault: Option<Fault>, number: u64, time_ns: i64, value: Vec<u8> },
    /// The source stopped after a signal or an exceeded budget in `block`; pending and later scripts are still carried out.
    Stopped { source: SourceId, block: BlockId, process: u64, fault: Fault, time_ns: i64 },
    /// A block that does not return has blocked the signal that would abort it.
    Deaf { source: SourceId, time_ns: i64 },
    /// The operating system terminated the thread of the source, between two firings or during one.
    Ended { source: SourceId, time_ns: i64 },
    /// Fault handlers had been replaced, as described by `text`; they have been reinstalled.
    Replaced { text: String, time_ns: i64 },
    /// A device could not be read or written; it is in its safe state.
    DeviceLost { source: SourceId, device: String, message: String, time_ns: i64 },
    /// A channel with a request (`Device::ask`) started or stopped making it, or can no longer be read.
    Asked { source: SourceId, time_ns: i64 },
    /// A queue was full: a synchronous value was lost (an `overrun`, which names both ends), or a ratio value arrived late.
    Overrun { source: SourceId, reader: SourceId, member: u32, time_ns: i64 },
    /// A ratio value was missing when its number was due; the old value is kept.
    Late { source: SourceId, member: u32, time_ns: i64 },
    /// The process of a remote source has exited. `block`: the block that was running, if known.
    Gone { source: SourceId, block: Option<BlockId>, message: String, time_ns: i64 },
    /// An end of a connection could not be created; nothing will arrive through it.
    Unconnected { writer: SourceId, reader: SourceId, message: String },
    /// A timer was suspended for `late_ns`, together with its process or machine. `is_unattended`: the suspension was longer than the
    /// time for which its outputs may be unattended, so they were made safe.
    StoodStill { source: SourceId, late_ns: i64, is_unattended: bool, time_ns: i64 },
    /// Number of events that were lost because the queue was full.
    Lost { source: SourceId, count: u64 },
    /// A script was carried out at this boundary. The script is returned so that it can be freed, together with the captures of its
    /// `Op::Capture`s, in order. It is not serialized (see `runtime::encoding::EventAs`); the variant is last, because variants after a
    /// skipped one would be renumbered.
    #[serde(skip)]
    Done { source: SourceId, script: Box<Script>, firing: u64, time_ns: i64, captured: Vec<u8> },
}

/// A queued event, and the number of bytes in the byte ring that belong to its `value` and `captured`.
pub(crate) struct QueuedEvent {
    pub(crate) serial: u64,
    pub(crate) event: Event,
    pub(crate) value_len: usize,
    pub(crate) captured_len: usize,
}

/// Maximum number of events pending at the supervisor, and maximum number of bytes of their values and captures.
const EVENTS: usize = 1024;
const BYTES: usize = 256 * 1024;

/// The source's end of the event queue: sends events without waiting or allocating.
pub struct Teller {
    events: Producer<QueuedEvent>,
    bytes: Producer<u8>,
    lost: u64,
    source: SourceId,
}

impl Teller {
    /// Sends an event; returns false if it was lost. The supervisor moves `value` and `captured` into the event when it receives it.
    pub(crate) fn tell(&mut self, serials: &AtomicU64, event: Event, value: &[u8], captured: &[u8]) -> bool {
        self.tell_lost(serials);
        if self.events.slots() == 0 || self.bytes.slots() < value.len() + captured.len() {
            self.lose();
            // The strings of a lost device are the only thing here that could be freed; that device is never served again.
            std::mem::forget(event);
            return false;
        }
        for bytes in [value, captured] {
            self.bytes.push_entire_slice(bytes).expect("the room was counted above, and only this end takes it");
        }
        let told = QueuedEvent { serial: serials.fetch_add(1, Ordering::AcqRel), event, value_len: value.len(), captured_len: captured.len() };
        if self.events.push(told).is_err() {
            unreachable!("the room was counted above, and only this end takes it");
        }
        true
    }

    /// Counts an event that was lost because the queue was full; the loss is reported once there is space.
    pub(crate) fn lose(&mut self) {
        self.lost += 1;
    }

    /// Reports lost events, if there are any and the queue has space again. Returns true if it reported any.
    #[inline]
    pub(crate) fn tell_lost(&mut self, serials: &AtomicU64) -> bool {
        if self.lost == 0 || self.events.slots() < 2 {
            return false;
        }
        let lost = Event::Lost { source: self.source, count: self.lost };
        let told = QueuedEvent { serial: serials.fetch_add(1, Ordering::AcqRel), event: lost, value_len: 0, captured_len: 0 };
        let is_told = self.events.push(told).is_ok();
        if is_told {
            self.lost = 0;
        }
        is_told
    }
}

/// The supervisor's end of the event queue of one source.
pub struct Listener {
    events: Consumer<QueuedEvent>,
    bytes: Consumer<u8>,
    done: VecDeque<Box<Submission>>,
}

/// Creates both ends of the event queue of `source`.
pub fn telling(source: SourceId) -> (Teller, Listener) {
    let (events, told) = RingBuffer::new(EVENTS);
    let (bytes, said) = RingBuffer::new(BYTES);
    (Teller { events, bytes, lost: 0, source }, Listener { events: told, bytes: said, done: VecDeque::new() })
}

impl Listener {
    /// Returns the serial of the next event of this source, if there is one. `Done` acknowledgements and events of the ring are returned
    /// in the order in which the source created them. Whatever precedes a visible event is visible too, so checking the acknowledgements
    /// before and after the ring finds the older one.
    pub fn next_serial(&mut self, done: &Mailbox) -> Option<u64> {
        self.done.extend(done.take());
        let acknowledged = self.done.front().map(|submission| submission.serial);
        let told = self.events.peek().ok().map(|told| told.serial);
        match (told, acknowledged) {
            (Some(told), None) => {
                self.done.extend(done.take());
                Some(self.done.front().map_or(told, |submission| told.min(submission.serial)))
            }
            (Some(told), Some(acknowledged)) => Some(told.min(acknowledged)),
            (None, acknowledged) => acknowledged,
        }
    }

    /// Takes the event with `serial`, which `next_serial` returned.
    pub fn take(&mut self, source: SourceId, serial: u64) -> Option<Event> {
        if let Some(submission) = self.done.pop_front_if(|submission| submission.serial == serial) {
            let Submission { script, captured, firing, time_ns, .. } = *submission;
            return Some(Event::Done { source, script, firing, time_ns, captured });
        }
        let told = self.events.pop().ok()?;
        let mut event = told.event;
        let (said_value, said_captured) = (self.read(told.value_len), self.read(told.captured_len));
        match &mut event {
            Event::Condition { value, captured, .. } => (*value, *captured) = (said_value, said_captured),
            Event::Unwatched { value, .. } => *value = said_value,
            _ => {}
        }
        Some(event)
    }

    fn read(&mut self, len: usize) -> Vec<u8> {
        let mut bytes = vec![0; len];
        self.bytes.pop_entire_slice(&mut bytes).expect("an event is pushed after its bytes");
        bytes
    }
}

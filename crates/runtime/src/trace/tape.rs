// SPDX-License-Identifier: Apache-2.0
//! Tape of a source. During recording, it stores the answer to each external query, in order; during playback, the same queries return
//! the stored answers. The answers of one firing or script form one [`Stretch`].
use device::DeviceError;
use kernel::tape::{Occasion, Tape};
use rtrb::{Consumer, Producer, RingBuffer};
use std::cell::UnsafeCell;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Segment of a record: the events in a source between two moments at which it can be observed from outside.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Stretch {
    /// Subject of the segment.
    pub occasion: Occasion,
    /// Position among the segments of all sources, in the order in which they ended.
    pub serial: u64,
    /// Number of preceding segments of this source that were lost because the buffer was full; 0 in a complete record.
    pub lost: u64,
    /// Number of the firing or, for a script, of the previous firing.
    pub number: u64,
    /// Release time of the firing, or time of execution of the script, ns on the clock.
    pub time_ns: i64,
    /// Digest of all values that the source's blocks had stored at the end of the segment.
    pub digest: u64,
    /// True if a fault stopped the source in the segment.
    pub stopped: bool,
    /// Answers to external queries, in order.
    pub answers: Vec<u8>,
}

/// Kind of a query, stored as a byte before its answer.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Ask {
    NoGroup = 1,
    Group,
    NoRow,
    Row,
    Rows,
    Read,
    ReadFailed,
    Written,
    WriteFailed,
    Word,
}

impl Ask {
    fn of(byte: u8) -> &'static str {
        const NAMES: [&str; 11] = [
            "nothing",
            "no new group of another source",
            "a group of another source",
            "no row of another source",
            "a row of another source",
            "the number of waiting rows of another source",
            "the readings of a device",
            "a failed read of a device",
            "a write to a device",
            "a failed write to a device",
            "the stage of a process",
        ];
        NAMES.get(usize::from(byte)).copied().unwrap_or("an unknown entry")
    }
}

/// Maximum size, in bytes, of the answers of one segment, and (`WAITING_MAX`) of all answers that wait to be taken.
const ANSWERS_MAX: usize = 1 << 20;
const WAITING_MAX: usize = 1 << 23;

/// Tape of one source. Only its kernel accesses the contents.
pub(crate) struct SourceTape(UnsafeCell<Side>);

// SAFETY: touched only by the kernel of its source: its thread, or the one thread of the virtual clock.
unsafe impl Send for SourceTape {}
// SAFETY: as for `Send`.
unsafe impl Sync for SourceTape {}

enum Side {
    Records(Recording),
    Plays(Playing),
}

struct Recording {
    /// Header of the segment, followed by its answers.
    bytes: Vec<u8>,
    overflowed: bool,
    lost: u64,
    out: Producer<u8>,
    serials: Arc<AtomicU64>,
}

#[derive(Default)]
struct Playing {
    answers: Vec<u8>,
    at: usize,
    /// First query that did not match the answers.
    differs: Option<String>,
}

/// End of a tape from which complete segments are taken, off the real-time path.
pub struct Taker(Consumer<u8>);

impl SourceTape {
    /// Creates a tape that records; `serials` is shared by all sources.
    pub fn recording(serials: Arc<AtomicU64>) -> (Arc<SourceTape>, Taker) {
        let (out, taken) = RingBuffer::new(WAITING_MAX);
        // Touched, so that no page fault occurs later.
        let bytes = vec![1; HEAD_LEN + ANSWERS_MAX];
        let side = Side::Records(Recording { bytes, overflowed: false, lost: 0, out, serials });
        (Arc::new(SourceTape(UnsafeCell::new(side))), Taker(taken))
    }

    /// Creates a tape that plays back.
    pub fn playing() -> Arc<SourceTape> {
        Arc::new(SourceTape(UnsafeCell::new(Side::Plays(Playing::default()))))
    }

    #[allow(clippy::mut_from_ref, reason = "the kernel of its source alone comes here, and keeps nothing")]
    fn side(&self) -> &mut Side {
        // SAFETY: the kernel of the source is the one that touches it, and no call of it is within another.
        unsafe { &mut *self.0.get() }
    }

    /// Loads the answers of the next segment, for playback.
    pub fn load(&self, answers: &[u8]) {
        if let Side::Plays(side) = self.side() {
            *side = Playing { answers: answers.to_vec(), at: 0, differs: None };
        }
    }

    /// Returns, during playback, the first mismatch between queries and answers, if any; leftover answers count as a mismatch.
    pub fn differs(&self) -> Option<String> {
        let Side::Plays(side) = self.side() else { return None };
        side.differs.take().or_else(|| (side.at < side.answers.len()).then(|| format!("the record continues with {}", Ask::of(side.answers[side.at]))))
    }

    /// Stores an answer of a connection, during recording.
    pub fn put(&self, ask: Ask, words: &[u64], bytes: &[u8]) {
        if let Side::Records(side) = self.side() {
            side.put(ask, &[]);
            words.iter().for_each(|word| side.append(&word.to_le_bytes()));
            side.append(bytes);
        }
    }

    /// Returns, during playback, which of these kinds the next answer has.
    pub fn one_of(&self, asks: &[Ask]) -> Option<Ask> {
        if let Side::Plays(side) = self.side() { side.one_of(asks) } else { None }
    }

    /// Takes the bytes of an answer, during playback.
    pub fn take(&self, into: &mut [u8]) {
        if let Side::Plays(side) = self.side()
            && let Some(bytes) = side.take(into.len())
        {
            into.copy_from_slice(bytes);
        }
    }

    /// Takes a word of an answer, during playback.
    pub fn take_word(&self) -> u64 {
        let mut word = [0; 8];
        self.take(&mut word);
        u64::from_le_bytes(word)
    }
}

impl Tape for SourceTape {
    fn begin(&self) {
        if let Side::Records(side) = self.side() {
            side.bytes.resize(HEAD_LEN, 0);
        }
    }

    fn records(&self) -> bool {
        matches!(self.side(), Side::Records(_))
    }

    fn end(&self, occasion: Occasion, number: u64, time_ns: i64, digest: u64, stopped: bool) {
        let Side::Records(side) = self.side() else { return };
        let serial = side.serials.fetch_add(1, Ordering::AcqRel);
        let (kind, script) = match occasion {
            Occasion::Firing => (0, 0),
            Occasion::Script(script) => (1, script),
            Occasion::Restart => (2, 0),
        };
        let len = (side.bytes.len() - HEAD_LEN) as u64;
        let words = [kind | u64::from(stopped) << 8, serial, side.lost, number, time_ns.cast_unsigned(), digest, script, len];
        for (place, word) in side.bytes.chunks_exact_mut(8).zip(words) {
            place.copy_from_slice(&word.to_le_bytes());
        }
        // Pushed as a whole or not at all, so that the taker sees only complete segments.
        let is_whole = !std::mem::take(&mut side.overflowed) && side.out.push_entire_slice(&side.bytes).is_ok();
        side.lost = if is_whole { 0 } else { side.lost + 1 };
    }

    fn number(&self, live: u64) -> u64 {
        match self.side() {
            Side::Records(side) => {
                side.put(Ask::Word, &live.to_le_bytes());
                live
            }
            Side::Plays(side) => side.word(Ask::Word).unwrap_or(live),
        }
    }

    fn written(&self, live: &mut dyn FnMut() -> Result<(), DeviceError>) -> Result<(), DeviceError> {
        match self.side() {
            Side::Records(side) => {
                let written = live();
                side.put(if written.is_ok() { Ask::Written } else { Ask::WriteFailed }, &[]);
                written
            }
            Side::Plays(side) => match side.one_of(&[Ask::Written, Ask::WriteFailed]) {
                Some(Ask::WriteFailed) => Err(as_recorded()),
                _ => Ok(()),
            },
        }
    }

    fn read(&self, readings: &mut [u8], live: &mut dyn FnMut(&mut [u8]) -> Result<(), DeviceError>) -> Result<(), DeviceError> {
        match self.side() {
            Side::Records(side) => {
                let read = live(readings);
                side.put(if read.is_ok() { Ask::Read } else { Ask::ReadFailed }, readings);
                read
            }
            Side::Plays(side) => {
                let asked = side.one_of(&[Ask::Read, Ask::ReadFailed]);
                if asked.is_some()
                    && let Some(bytes) = side.take(readings.len())
                {
                    readings.copy_from_slice(bytes);
                }
                if asked == Some(Ask::ReadFailed) { Err(as_recorded()) } else { Ok(()) }
            }
        }
    }
}

fn as_recorded() -> DeviceError {
    DeviceError { message: "as it was recorded".to_owned() }
}

impl Recording {
    fn put(&mut self, ask: Ask, bytes: &[u8]) {
        self.append(&[ask as u8]);
        self.append(bytes);
    }

    fn append(&mut self, bytes: &[u8]) {
        if self.bytes.len() + bytes.len() <= self.bytes.capacity() {
            self.bytes.extend_from_slice(bytes);
        } else {
            self.overflowed = true;
        }
    }
}

impl Playing {
    fn one_of(&mut self, asks: &[Ask]) -> Option<Ask> {
        if self.differs.is_some() {
            return None;
        }
        let next = self.answers.get(self.at).copied();
        let found = asks.iter().copied().find(|ask| next == Some(*ask as u8));
        match found {
            Some(_) => self.at += 1,
            None => {
                let (asked, recorded) = (Ask::of(asks[0] as u8), next.map_or("nothing more", Ask::of));
                self.differs = Some(format!("asked for {asked}, but the record has {recorded}"));
            }
        }
        found
    }

    fn take(&mut self, len: usize) -> Option<&[u8]> {
        if self.differs.is_some() {
            return None;
        }
        let end = self.at.saturating_add(len);
        if end > self.answers.len() {
            self.differs = Some("an answer is longer than its record".to_owned());
            return None;
        }
        let bytes = &self.answers[self.at..end];
        self.at = end;
        Some(bytes)
    }

    fn word(&mut self, ask: Ask) -> Option<u64> {
        self.one_of(&[ask])?;
        Some(u64::from_le_bytes(self.take(8)?.try_into().ok()?))
    }
}

const HEAD_LEN: usize = 64;

impl Taker {
    /// Takes the next segment, if one is complete.
    pub fn take(&mut self) -> Option<Stretch> {
        let mut head = [0; HEAD_LEN];
        self.0.pop_entire_slice(&mut head).ok()?;
        let word = |at: usize| u64::from_le_bytes(head[8 * at..8 * at + 8].try_into().expect("eight bytes were cut out"));
        let occasion = match word(0) & 0xff {
            0 => Occasion::Firing,
            1 => Occasion::Script(word(6)),
            _ => Occasion::Restart,
        };
        let mut answers = vec![0; word(7) as usize];
        // A segment is in the queue as a whole or not at all.
        self.0.pop_entire_slice(&mut answers).ok()?;
        Some(Stretch {
            occasion,
            serial: word(1),
            lost: word(2),
            number: word(3),
            time_ns: word(4).cast_signed(),
            digest: word(5),
            stopped: word(0) & 0x100 != 0,
            answers,
        })
    }
}

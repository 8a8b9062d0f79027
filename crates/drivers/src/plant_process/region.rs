// SPDX-License-Identifier: Apache-2.0
//! Memory shared by a plant and its driver for one session.
//!
//! | | written by | read by |
//! |---|---|---|
//! | readings, a triple buffer | the plant, after each step | the driver: the newest complete group |
//! | commands, a triple buffer | the driver, at each firing | the plant, before each step |
//! | number of safe-state requests | the driver | the plant, before each step |
//! | safe commands, and the flag | the guard, when the driver's process has exited | the plant, before each step |
//! | steps, failure, expiry of its timeout | the plant | the driver |
//!
//! Either side may write to any word at any time: each word is checked as it is read, and an impossible value ends the session.
//!
//! Neither side waits for the other. The memory is new for each session: a driver that was cut off writes to memory that is no longer
//! read.
use device::{Channel, Direction};
use interconnect::triple::{BACK_AT_FIRST, FRONT_AT_FIRST, MIDDLE_AT_FIRST, in_the_middle, is_possible};
use interconnect::{TripleMemory, TripleReader, TripleWriter};
use process_kit::SharedMemory;
use std::io;
use std::os::fd::OwnedFd;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU8, AtomicU64, Ordering};

/// Size of a cache line in bytes.
const LINE: usize = 64;
/// Offset of the word that is not 0 while only the safe commands apply.
const FLAG: usize = 0;
const STEPS: usize = LINE;
/// Offset of the length of the failure message; the length is 0 if there is none.
const FAILED: usize = 2 * LINE;
const TEXT: usize = FAILED + 8;
const TEXT_MAX: usize = 4 * LINE - 8;
/// Offset of the word that is not 0 if no commands arrived within the timeout of the plant.
const TIMED_OUT: usize = 6 * LINE;
/// Offset of the number of safe-state requests by the driver.
const RESTS: usize = 7 * LINE;
const SAFE: usize = 8 * LINE;

/// Sizes of the region's parts, in bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Shape {
    pub readings: usize,
    pub commands: usize,
    /// Number of counters of the driver, of 8 bytes each, which follow the readings.
    pub counters: usize,
    /// Number of write channels. For each, a byte after the commands is 1 if the channel is claimed.
    pub writes: usize,
}

impl Shape {
    pub fn of(channels: &[Channel], counters: usize) -> Shape {
        let of = |direction| channels.iter().filter(move |channel| channel.direction == direction);
        let end = |direction| of(direction).map(|channel| channel.offset + channel.len).max().unwrap_or(0);
        Shape { readings: end(Direction::Read), commands: end(Direction::Write), writes: of(Direction::Write).count(), counters }
    }

    /// Returns the total size of the readings and the counters.
    pub fn told(&self) -> usize {
        self.readings + 8 * self.counters
    }

    /// Returns the total size of the commands and their claims.
    pub fn group(&self) -> usize {
        self.commands + self.writes
    }

    /// Returns the safe group: safe commands, with no claims.
    pub fn safe_group(&self, channels: &[Channel]) -> Vec<u8> {
        let mut group = vec![0; self.group()];
        for channel in channels.iter().filter(|channel| channel.direction == Direction::Write) {
            group[channel.offset..channel.offset + channel.len].copy_from_slice(&channel.safe);
        }
        group
    }

    fn commands_start(&self) -> usize {
        SAFE + lines(self.group())
    }

    fn readings_start(&self) -> usize {
        self.commands_start() + triple_len(self.group())
    }

    fn len(&self) -> usize {
        self.readings_start() + triple_len(self.told())
    }
}

/// Returns `len` rounded up to whole lines; at least one line.
fn lines(len: usize) -> usize {
    len.max(1).next_multiple_of(LINE)
}

/// Returns the total length of the word and the three buffers.
fn triple_len(len: usize) -> usize {
    LINE + 3 * lines(len)
}

/// Memory of one session.
pub(super) struct Region {
    memory: Arc<SharedMemory>,
    /// Set if a word was read with a value that neither side would write.
    spoilt: Arc<AtomicBool>,
    /// Safe commands, in the plant's copy of the region.
    safe_group: Vec<u8>,
    shape: Shape,
}

impl Region {
    /// Creates a new region, on the plant's side.
    pub fn new(shape: Shape, safe_group: &[u8]) -> io::Result<Region> {
        let region = Region { memory: Arc::new(SharedMemory::new(shape.len())?), spoilt: Arc::default(), safe_group: safe_group.to_vec(), shape };
        for triple in [region.commands(), region.readings()] {
            triple.middle().store(MIDDLE_AT_FIRST, Ordering::Release);
        }
        region.set_safe_group(safe_group);
        Ok(region)
    }

    /// Wraps the driver's side of a region that the plant has sent.
    pub fn received(descriptor: OwnedFd, shape: Shape) -> io::Result<Region> {
        Ok(Region { memory: Arc::new(SharedMemory::received(descriptor, shape.len())?), spoilt: Arc::default(), safe_group: Vec::new(), shape })
    }

    pub fn memory(&self) -> &SharedMemory {
        &self.memory
    }

    fn commands(&self) -> SharedTripleBuffer {
        SharedTripleBuffer { memory: self.memory.clone(), spoilt: self.spoilt.clone(), start: self.shape.commands_start(), len: self.shape.group() }
    }

    fn readings(&self) -> SharedTripleBuffer {
        SharedTripleBuffer { memory: self.memory.clone(), spoilt: self.spoilt.clone(), start: self.shape.readings_start(), len: self.shape.told() }
    }

    /// Returns the two ends that the plant uses. They are taken once for each region.
    pub fn plant_ends(&self) -> (TripleReader<SharedTripleBuffer>, TripleWriter<SharedTripleBuffer>) {
        // SAFETY: only the plant makes these ends, once, from memory that it has just made; so each buffer is in its initial place.
        unsafe { (TripleReader::in_memory(self.commands(), FRONT_AT_FIRST), TripleWriter::in_memory(self.readings(), BACK_AT_FIRST)) }
    }

    /// Returns the two ends that the driver uses. They are taken once for each region.
    pub fn driver_ends(&self) -> (TripleWriter<SharedTripleBuffer>, TripleReader<SharedTripleBuffer>) {
        // SAFETY: the plant sends the memory of a session to one driver, which makes these ends once; the driver has not exchanged
        // anything before, and the plant has exchanged only with the middle buffer.
        unsafe { (TripleWriter::in_memory(self.commands(), BACK_AT_FIRST), TripleReader::in_memory(self.readings(), FRONT_AT_FIRST)) }
    }

    /// Returns true if the safe commands apply, which includes the case that no other commands can be trusted.
    pub fn is_safe(&self) -> bool {
        self.memory.word(FLAG).load(Ordering::Acquire) != 0 || self.spoilt.load(Ordering::Relaxed)
    }

    /// Returns the word that is not 0 if the plant has switched to its safe commands by itself.
    pub fn timed_out(&self) -> &AtomicU64 {
        self.memory.word(TIMED_OUT)
    }

    /// Returns the number of safe-state requests by the driver. It is separate from the commands, so that a later command does not undo a
    /// request.
    pub fn rests(&self) -> &AtomicU64 {
        self.memory.word(RESTS)
    }

    /// Returns the writes that the guard makes: the safe commands, then the flag.
    pub fn safe_writes(&self, safe_group: &[u8]) -> Vec<(u64, Vec<u8>)> {
        // Any nonzero byte of the flag is enough, so it applies from the first byte that arrives.
        vec![(SAFE as u64, safe_group.to_vec()), (FLAG as u64, vec![1; 8])]
    }

    fn set_safe_group(&self, group: &[u8]) {
        for (place, byte) in (SAFE..).zip(group) {
            self.byte(place).store(*byte, Ordering::Relaxed);
        }
    }

    /// Copies the safe commands.
    pub fn load_safe_group(&self, group: &mut [u8]) {
        if self.spoilt.load(Ordering::Relaxed) && group.len() == self.safe_group.len() {
            return group.copy_from_slice(&self.safe_group);
        }
        for (place, byte) in (SAFE..).zip(group) {
            *byte = self.byte(place).load(Ordering::Relaxed);
        }
    }

    /// Returns the number of steps of the plant.
    pub fn steps(&self) -> &AtomicU64 {
        self.memory.word(STEPS)
    }

    /// Records that the plant has stopped, and the reason.
    pub fn fail(&self, why: &str) {
        let text = why.as_bytes();
        let len = text.len().clamp(1, TEXT_MAX);
        for (place, byte) in (TEXT..TEXT + len).zip(text) {
            self.byte(place).store(*byte, Ordering::Relaxed);
        }
        self.memory.word(FAILED).store(len as u64, Ordering::Release);
    }

    /// Returns the reason why the plant has stopped; `None` if it has not. Allocates only if it has.
    pub fn failure(&self) -> Option<String> {
        if self.spoilt.load(Ordering::Relaxed) {
            return Some(
                "the memory that the plant shares with its driver was overwritten; find the process at fault and end it, then open the device again".to_owned(),
            );
        }
        let len = (self.memory.word(FAILED).load(Ordering::Acquire) as usize).min(TEXT_MAX);
        let text = |len| (TEXT..TEXT + len).map(|place| self.byte(place).load(Ordering::Relaxed)).collect::<Vec<u8>>();
        (len > 0).then(|| String::from_utf8_lossy(&text(len)).into_owned())
    }

    fn byte(&self, place: usize) -> &AtomicU8 {
        assert!(place < self.memory.len(), "the shape fits the memory");
        // SAFETY: within the mapping, which lives as long as `self`; bytes are always aligned.
        unsafe { AtomicU8::from_ptr(self.memory.start().add(place)) }
    }
}

/// A triple buffer in the memory of a session.
pub(super) struct SharedTripleBuffer {
    memory: Arc<SharedMemory>,
    spoilt: Arc<AtomicBool>,
    start: usize,
    len: usize,
}

impl SharedTripleBuffer {
    fn buffer(&self, index: u8) -> *mut [u8] {
        // The index held by an end was checked in `given`.
        let place = self.start + LINE + usize::from(index.min(2)) * lines(self.len);
        // SAFETY: the shape from which `start` and `len` are derived fits the mapping, as checked when it was made or received.
        std::ptr::slice_from_raw_parts_mut(unsafe { self.memory.start().add(place) }, self.len)
    }
}

// SAFETY: the mapping lives as long as the value; buffers are at least a line apart; there is one end of each kind (`plant_ends`,
// `driver_ends`).
unsafe impl TripleMemory for SharedTripleBuffer {
    #[inline]
    fn middle(&self) -> &AtomicU8 {
        // SAFETY: within the mapping, which lives as long as `self`.
        unsafe { AtomicU8::from_ptr(self.memory.start().add(self.start)) }
    }

    #[inline]
    fn for_reading(&self, index: u8) -> *const [u8] {
        self.buffer(index)
    }

    #[inline]
    fn for_writing(&self, index: u8) -> *mut [u8] {
        self.buffer(index)
    }

    #[inline]
    fn given(&self, word: u8, own: u8) -> u8 {
        if is_possible(word, own) {
            return in_the_middle(word);
        }
        self.spoilt.store(true, Ordering::Relaxed);
        own
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHAPE: Shape = Shape { readings: 16, commands: 16, counters: 1, writes: 2 };

    fn pair() -> (Region, Region) {
        let plant = Region::new(SHAPE, &[9; 18]).expect("memory");
        let driver = Region::received(plant.memory().descriptor().expect("a descriptor"), SHAPE).expect("what a plant sends");
        (plant, driver)
    }

    #[test]
    fn a_word_that_cannot_be_ends_the_session_on_both_sides_and_the_plant_is_safe() {
        for word in [3, 7, 8, 0xff, 0x10] {
            let (plant, driver) = pair();
            let ((mut obeys, mut tells), (mut commands, mut readings)) = (plant.plant_ends(), driver.driver_ends());
            for triple in [plant.commands(), plant.readings()] {
                triple.middle().store(word, Ordering::Relaxed);
            }
            tells.publish();
            commands.publish();
            // After overwriting there may be no publication, or a spurious one: both leave the reader with its earlier values.
            let _news = (obeys.latch(), readings.latch());
            assert_eq!((obeys.front().len(), readings.front().len()), (18, 24));
            assert!(driver.failure().is_some_and(|why| why.contains("was overwritten")), "{word}");
            let mut group = [0; 18];
            plant.load_safe_group(&mut group);
            assert!(plant.is_safe() && group == [9; 18]);
        }
    }

    #[test]
    fn any_bytes_in_the_memory_of_a_session_reach_nothing_else() {
        let mut seed = 1_u64;
        let mut next = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 33) as usize
        };
        for _ in 0..100 {
            let (plant, driver) = pair();
            let ((mut obeys, mut tells), (mut commands, mut readings)) = (plant.plant_ends(), driver.driver_ends());
            for _ in 0..500 {
                plant.byte(next() % plant.memory().len()).store(next() as u8, Ordering::Relaxed);
                let call = next() % 7;
                match call {
                    0 => tells.publish(),
                    1 => commands.publish(),
                    2 => drop((obeys.latch(), readings.latch())),
                    3 => assert!(driver.failure().is_none_or(|why| why.len() <= 4 * TEXT_MAX)),
                    4 => plant.fail("it broke"),
                    5 => assert_eq!((obeys.front().len(), commands.back().len()), (18, 18)),
                    _ => plant.load_safe_group(&mut [0; 18]),
                }
            }
        }
    }
}

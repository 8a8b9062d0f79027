// SPDX-License-Identifier: Apache-2.0
//! Values of a tap, as runs assembled from the rows of its rings.
use crate::observation::stamp::Stamp;

/// Values of one channel, oldest first.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Run {
    /// Time of each value, ns on the clock. For a value stored by a block, this is the release time of its firing.
    pub times_ns: Vec<i64>,
    /// Number of the invocation that stored each value. A value stored by the programming system carries the previous number.
    pub numbers: Vec<u64>,
    /// True for each value stored by a block, false for the initial value and for values stored by the programming system.
    pub by_block: Vec<bool>,
    /// Values, stored consecutively.
    pub bytes: Vec<u8>,
    /// Number of values of this channel lost since the previous take.
    pub lost: u64,
}

impl Run {
    pub fn len(&self) -> usize {
        self.numbers.len()
    }

    pub fn is_empty(&self) -> bool {
        self.numbers.is_empty()
    }

    pub(crate) fn clear(&mut self) {
        self.times_ns.clear();
        self.numbers.clear();
        self.by_block.clear();
        self.bytes.clear();
        self.lost = 0;
    }
}

/// Values of a tap: one run per channel, in the order of [`Tap::channels`]. The next take reuses the memory.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Samples {
    pub runs: Vec<Run>,
}

impl Samples {
    /// Returns true if there are no values and no losses.
    pub fn is_empty(&self) -> bool {
        self.runs.iter().all(|run| run.is_empty() && run.lost == 0)
    }

    pub(crate) fn clear(&mut self, channels: usize) {
        self.runs.truncate(channels);
        self.runs.iter_mut().for_each(Run::clear);
        self.runs.resize_with(channels, Run::default);
    }
}

/// State of a channel between two rows.
#[derive(Default)]
pub(crate) struct ChannelState {
    /// Most recent value.
    pub bytes: Vec<u8>,
    pub has_value: bool,
    /// True if the initial value is also reported.
    pub tells_present: bool,
    /// Most recent stamp: its index, number and time.
    pub seen: Option<(u64, u64, i64)>,
    /// Number of rows lost since that stamp.
    pub gap: u64,
    /// Number of the segment that contains the channel's latest values, counted over the lifetime of the tap.
    pub route: u64,
}

impl ChannelState {
    pub(crate) fn new(tells_present: bool) -> ChannelState {
        ChannelState { tells_present, ..ChannelState::default() }
    }

    /// Checks one row for a new value.
    pub(crate) fn look(&mut self, run: &mut Run, row_ns: i64, stamp: Option<(u64, Stamp)>, ratio: u64, value: &[u8]) {
        let Some((which, stamp)) = stamp else {
            if self.has_value && self.bytes != value {
                run.lost += std::mem::take(&mut self.gap);
            }
            return self.changed(run, row_ns, value);
        };
        let now = (which, stamp.number, stamp.time_ns);
        let before = self.seen.replace(now);
        let gap = std::mem::take(&mut self.gap);
        let is_first_of_writer = before.is_none_or(|(writer, ..)| writer != which);
        let is_stored = stamp.is_set() && stamp.stored(ratio) == Some(stamp.number);
        if before == Some(now) || (is_first_of_writer && gap == 0) {
            return self.changed(run, row_ns, value);
        }
        let lost = lost_between(before.filter(|_| !is_first_of_writer), &stamp, ratio, gap);
        run.lost += lost;
        if is_stored {
            self.put(run, stamp.time_ns, stamp.number, true, value);
        } else if lost > 0 {
            // This is the last of the lost values; the time of its storing is no longer known.
            (self.bytes, self.has_value) = (value.to_vec(), true);
        } else {
            self.changed(run, row_ns, value);
        }
    }

    /// Records a value that was not stored by a block, but possibly by the programming system.
    fn changed(&mut self, run: &mut Run, row_ns: i64, value: &[u8]) {
        if !self.has_value && self.tells_present {
            let stored = self.seen.filter(|(_, _, time_ns)| *time_ns != kernel::NEVER_NS);
            let (number, time_ns) = stored.map_or((0, row_ns), |(_, number, time_ns)| (number, time_ns));
            self.put(run, time_ns, number, stored.is_some(), value);
        } else if !self.has_value {
            (self.bytes, self.has_value) = (value.to_vec(), true);
        } else if self.bytes != value {
            let number = self.seen.map_or(0, |(_, number, _)| number);
            self.put(run, row_ns, number, false, value);
        }
    }

    pub(crate) fn put(&mut self, run: &mut Run, time_ns: i64, number: u64, by_block: bool, value: &[u8]) {
        run.times_ns.push(time_ns);
        run.numbers.push(number);
        run.by_block.push(by_block);
        run.bytes.extend_from_slice(value);
        self.bytes.clear();
        self.bytes.extend_from_slice(value);
        self.has_value = true;
    }
}

/// Returns the number of values lost with `gap` rows, computed from the numbers of the values and limited to the number of rows. `before`
/// is the last known state of this stamp.
fn lost_between(before: Option<(u64, u64, i64)>, now: &Stamp, ratio: u64, gap: u64) -> u64 {
    let Some(stored) = now.stored(ratio).filter(|_| gap > 0 && now.is_set()) else { return 0 };
    let in_hand = u64::from(stored == now.number);
    let numbered = match before {
        // Nothing had been stored before.
        Some((_, _, kernel::NEVER_NS)) => (stored + 1).saturating_sub(now.activated) / ratio.max(1),
        Some((_, before, _)) if stored >= before => (stored - before).div_ceil(ratio.max(1)),
        // For another start or writer, assume one value per row.
        _ => gap + in_hand,
    };
    numbered.saturating_sub(in_hand).min(gap)
}

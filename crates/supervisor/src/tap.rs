// SPDX-License-Identifier: Apache-2.0
//! Taps: every value of some SVVs and private cells, at the full rate at which blocks store them, for who shows or records them.
//!
//! | | the kernels | a tap |
//! |---|---|---|
//! | may hold up the other | never | never; under the virtual clock, if it asks for that, the passing of time |
//! | a value is lost | never | where it is read too late: 2 s of firings wait for it, 256 at the least |
//! | knows what was lost | | exactly, by channel, where who writes it numbers its values |
use crate::refuse::refuse;
use crate::system::{Shared, System, Waited};
use crate::taps::{Inbox, Segment, TapChannel};
use crate::values::Stamp;
use interconnect::Row;
use model::refusal::{Class, Refusals};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

/// Kernels come to a new table within a firing; longer than this means that a processor does not run.
const ATTACH_MAX: Duration = Duration::from_secs(5);

/// Values of one channel, oldest first.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Run {
    /// Of each value: its time, ns on the clock; of one that a block stored, the release of that firing.
    pub times_ns: Vec<i64>,
    /// Of each value: the number of the invocation that stored it. What the programming system stored has the number before it.
    pub numbers: Vec<u64>,
    /// The values, one after the other.
    pub bytes: Vec<u8>,
    /// Values of this channel that were lost since the take before.
    pub lost: u64,
}

impl Run {
    pub fn len(&self) -> usize {
        self.numbers.len()
    }

    pub fn is_empty(&self) -> bool {
        self.numbers.is_empty()
    }

    fn clear(&mut self) {
        self.times_ns.clear();
        self.numbers.clear();
        self.bytes.clear();
        self.lost = 0;
    }
}

/// What a tap gives: a run for each channel, in the order of [`Tap::channels`]. Its memory is used again by the next take.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Samples {
    pub runs: Vec<Run>,
}

impl Samples {
    /// True where there is neither a value nor a loss.
    pub fn is_empty(&self) -> bool {
        self.runs.iter().all(|run| run.is_empty() && run.lost == 0)
    }

    fn clear(&mut self, channels: usize) {
        self.runs.truncate(channels);
        self.runs.iter_mut().for_each(Run::clear);
        self.runs.resize_with(channels, Run::default);
    }
}

/// What is known of a channel.
#[derive(Default)]
struct Known {
    /// The last value.
    bytes: Vec<u8>,
    has_value: bool,
    /// The value that was there before is told too.
    tells_present: bool,
    /// Number and time of the stamp seen last, and which stamp it was.
    seen: Option<(u64, u64, i64)>,
    /// Rows lost since then.
    gap: u64,
    /// The segment that its values came from last, counted over the life of the tap.
    route: u64,
}

/// Observes some values of a running system, see [`System::tap`]. Dropping it ends that.
pub struct Tap {
    shared: Arc<Shared>,
    id: u64,
    channels: Vec<TapChannel>,
    inbox: Arc<Inbox>,
    /// With the count of each.
    segments: Vec<(u64, Segment)>,
    count: u64,
    known: Vec<Known>,
    tells_present: bool,
    row: Row,
}

impl System {
    /// Observes these SVVs, by their names, and private cells of instances, by `INSTANCE:CELL`: every value that is stored from now on,
    /// once, in order, with its number and time. It goes along where an SVV gets another writer, also in another source or on another
    /// processor, and where an instance of that name is made anew. Refused where there is no such name.
    ///
    /// Nothing that is computed changes. What one more tap costs is a copy of what it observes in each firing.
    pub fn tap(&self, names: &[String]) -> Result<Tap, Refusals> {
        let (id, channels, inbox) = self.shared.command(|core| {
            let (id, channels, inbox, sources) = core.attach(names)?;
            core.renew_tables(sources);
            Ok((id, channels, inbox))
        })?;
        self.begin_tap(id, channels, inbox, false)
    }

    /// The same for everything of these names, where `*` stands for any letters and `?` for one, also for what comes to be later; `cells`:
    /// and for the private cells of all instances. The first value of each is the present one, with the number and time that it has.
    /// Refused where a name without `*` or `?` is of nothing.
    pub fn tap_all(&self, patterns: &[String], cells: bool) -> Result<Tap, Refusals> {
        let (id, inbox) = self.shared.command(|core| {
            let (id, inbox, sources) = core.attach_all(patterns, cells)?;
            core.renew_tables(sources);
            Ok((id, inbox))
        })?;
        self.begin_tap(id, Vec::new(), inbox, true)
    }

    fn begin_tap(&self, id: u64, channels: Vec<TapChannel>, inbox: Arc<Inbox>, tells_present: bool) -> Result<Tap, Refusals> {
        let known = channels.iter().map(|_| Known::new(tells_present)).collect();
        let mut tap = Tap { shared: self.shared.clone(), id, channels, inbox, segments: Vec::new(), count: 0, known, tells_present, row: Row::default() };
        tap.collect();
        let mine = tap.segments.iter().map(|(_, segment)| (segment.source, segment.end.reader())).collect::<Vec<_>>();
        let begun = self.shared.wait_for(None, ATTACH_MAX, |core| {
            Ok(mine.iter().all(|(source, reader)| reader.written() > 0 || core.lost.contains(source) || core.host.statistics(*source).stopped).then_some(()))
        })?;
        match begun {
            Waited::Done(()) => Ok(tap),
            _ => Err(refuse(Class::InvalidState, "a kernel did not answer", "is its processor overloaded? see statistics()")),
        }
    }
}

impl Tap {
    /// What it observes, in the order asked for.
    pub fn channels(&self) -> &[TapChannel] {
        &self.channels
    }

    /// Under the virtual clock, time waits from now on for whoever takes from this tap, so that nothing is lost however fast it passes.
    /// The one who advances time must be another thread.
    pub fn hold_time(&self) {
        if self.shared.is_virtual {
            let mut core = self.shared.locked();
            let (log, ends) = (core.log.next(), core.ends.next());
            core.taps.hold(self.id, log, ends);
        }
    }

    /// Who holds time has taken the entries of the log and the ends before these numbers; time waits for the rest too.
    pub fn heard(&self, log: u64, ends: u64) {
        if self.shared.is_virtual {
            self.shared.locked().taps.heard(self.id, log, ends);
        }
    }

    /// Waits until time waits for this tap, at most so long: for who holds time.
    pub fn wait(&self, timeout: Duration) {
        self.inbox.wait_pressed(timeout);
    }

    /// Takes everything that has come since the take before. Allocates only where `out` has never had as much; not for the real-time path.
    pub fn take(&mut self, out: &mut Samples) {
        self.collect();
        out.clear(self.channels.len());
        self.take_stores(out);
        let mut index = 0;
        while index < self.segments.len() {
            // Before its rows are taken: one that has a successor in force gets no row any more.
            let is_over = self.is_over(index);
            self.drain(index, out);
            if is_over {
                self.segments.remove(index);
            } else {
                index += 1;
            }
        }
        self.inbox.relieve();
    }

    fn collect(&mut self) {
        let mut arrived = self.inbox.locked();
        for of in arrived.channels.drain(..) {
            self.channels.push(of);
            self.known.push(Known::new(self.tells_present));
        }
        for segment in arrived.segments.drain(..) {
            self.count += 1;
            self.segments.push((self.count, segment));
        }
    }

    /// A later ring of the same source is in force.
    fn is_over(&self, index: usize) -> bool {
        let source = self.segments[index].1.source;
        self.segments[index + 1..].iter().any(|(_, later)| later.source == source && later.end.reader().written() > 0)
    }

    fn take_stores(&mut self, out: &mut Samples) {
        let mut arrived = self.inbox.locked();
        // What is of a channel that has come since waits for the next take.
        let now = arrived.stores.iter().position(|(channel, ..)| *channel >= self.known.len()).unwrap_or(arrived.stores.len());
        for (channel, time_ns, bytes) in arrived.stores.drain(..now) {
            let known = &mut self.known[channel];
            let number = known.seen.map_or(0, |(_, number, _)| number);
            known.put(&mut out.runs[channel], time_ns, number, &bytes);
        }
        let later = arrived.lost.split_off(&self.known.len());
        for (channel, lost) in std::mem::replace(&mut arrived.lost, later) {
            out.runs[channel].lost += lost;
        }
    }

    fn drain(&mut self, index: usize, out: &mut Samples) {
        let Tap { segments, known, row, channels, .. } = self;
        let (count, segment) = &segments[index];
        let reader = segment.end.reader();
        let mut taken = segment.taken.load(Ordering::Relaxed);
        while let Some(lost) = reader.next(taken, row) {
            taken = row.sequence + 1;
            segment.taken.store(taken, Ordering::Relaxed);
            for field in &segment.fields {
                let known = &mut known[field.channel];
                if known.route > *count {
                    continue;
                }
                known.route = *count;
                known.gap += lost;
                let value = &row.bytes[field.value..][..channels[field.channel].size];
                let stamp = field.stamp.map(|(at, which)| (which, Stamp::of(&row.bytes[at..])));
                known.look(&mut out.runs[field.channel], row.time_ns, stamp, field.ratio, value);
            }
        }
    }
}

impl Known {
    fn new(tells_present: bool) -> Known {
        Known { tells_present, ..Known::default() }
    }

    /// One row: is there a new value in it?
    fn look(&mut self, run: &mut Run, row_ns: i64, stamp: Option<(u64, Stamp)>, ratio: u64, value: &[u8]) {
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
            self.put(run, stamp.time_ns, stamp.number, value);
        } else if lost > 0 {
            // The last of those that were lost: when it was stored is not known any more.
            (self.bytes, self.has_value) = (value.to_vec(), true);
        } else {
            self.changed(run, row_ns, value);
        }
    }

    /// No block has stored it; the programming system may have.
    fn changed(&mut self, run: &mut Run, row_ns: i64, value: &[u8]) {
        if !self.has_value && self.tells_present {
            let (number, time_ns) =
                self.seen.filter(|(_, _, time_ns)| *time_ns != kernel::NEVER_NS).map_or((0, row_ns), |(_, number, time_ns)| (number, time_ns));
            self.put(run, time_ns, number, value);
        } else if !self.has_value {
            (self.bytes, self.has_value) = (value.to_vec(), true);
        } else if self.bytes != value {
            let number = self.seen.map_or(0, |(_, number, _)| number);
            self.put(run, row_ns, number, value);
        }
    }

    fn put(&mut self, run: &mut Run, time_ns: i64, number: u64, value: &[u8]) {
        run.times_ns.push(time_ns);
        run.numbers.push(number);
        run.bytes.extend_from_slice(value);
        self.bytes.clear();
        self.bytes.extend_from_slice(value);
        self.has_value = true;
    }
}

/// Values that were lost with `gap` rows: as many as the numbers say, and never more than rows. `before`: what was seen last of this stamp.
fn lost_between(before: Option<(u64, u64, i64)>, now: &Stamp, ratio: u64, gap: u64) -> u64 {
    let Some(stored) = now.stored(ratio).filter(|_| gap > 0 && now.is_set()) else { return 0 };
    let in_hand = u64::from(stored == now.number);
    let numbered = match before {
        // It had stored nothing yet.
        Some((_, _, kernel::NEVER_NS)) => (stored + 1).saturating_sub(now.activated) / ratio.max(1),
        Some((_, before, _)) if stored >= before => (stored - before).div_ceil(ratio.max(1)),
        // Another start, or another writer: at most one a row.
        _ => gap + in_hand,
    };
    numbered.saturating_sub(in_hand).min(gap)
}

impl Drop for Tap {
    fn drop(&mut self) {
        // Of a closed system nothing runs any more; of one whose supervisor panicked nothing can be commanded.
        if !self.shared.core.is_poisoned() {
            let _closed = self.shared.command(|core| {
                let sources = core.detach(self.id);
                core.renew_tables(sources);
                Ok(())
            });
        }
        self.inbox.relieve();
    }
}

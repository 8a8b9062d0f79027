// SPDX-License-Identifier: Apache-2.0
//! Taps: every value of some SVVs and private cells, at the full rate at which blocks store them, for scopes and recorders.
//!
//! | | the kernels | a tap |
//! |---|---|---|
//! | may hold up the other | never | never; under the virtual clock, if it asks for that, the passing of time |
//! | a value is lost | never | where it is read too late: 2 s of firings wait for it, at least 256 |
//! | knows what was lost | | exactly, by channel, where its writer numbers its values |
use crate::observation::inbox::{Inbox, Segment, TapChannel};
use crate::observation::samples::{ChannelState, Samples};
use crate::observation::stamp::Stamp;
use crate::refuse::refuse;
use crate::system::{System, SystemState, WaitResult};
use interconnect::Row;
use model::refusal::{Class, Refusals};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

/// Kernels come to a new table within a firing; longer than this means that a processor does not run.
const ATTACH_MAX: Duration = Duration::from_secs(5);

/// Observes some values of a running system, see [`System::tap`]. Dropping it ends that.
pub struct Tap {
    shared: Arc<SystemState>,
    id: u64,
    channels: Vec<TapChannel>,
    inbox: Arc<Inbox>,
    /// Segments, with the count of each.
    segments: Vec<(u64, Segment)>,
    count: u64,
    known: Vec<ChannelState>,
    tells_present: bool,
    row: Row,
}

impl System {
    /// Observes these SVVs, by their names, and private cells of instances, by `INSTANCE:CELL`: every value that is stored after this
    /// call, once, in order, with its number and time. It goes along when an SVV gets another writer, also in another source or on
    /// another
    /// processor, and when an instance of that name is made again. Refused where there is no such name.
    ///
    /// Nothing that is computed changes. What one more tap costs is a copy of what it observes in each firing.
    pub fn tap(&self, names: &[String]) -> Result<Tap, Refusals> {
        let (id, channels, inbox) = self.shared.command(|core| {
            let id = core.numbers.fresh();
            let (taps, seen) = core.taps();
            let (channels, inbox, sources) = taps.attach(id, names, &seen)?;
            core.carrier().renew_tables(sources);
            Ok((id, channels, inbox))
        })?;
        self.begin_tap(id, channels, inbox, false)
    }

    /// Observes everything of these names in the same way, where `*` stands for any letters and `?` for one, also what comes to be later; `cells`:
    /// and for the private cells of all instances. The first value of each is the present one, with the number and time that it has.
    /// Refused where a name without `*` or `?` is of nothing.
    pub fn tap_all(&self, patterns: &[String], cells: bool) -> Result<Tap, Refusals> {
        let (id, inbox) = self.shared.command(|core| {
            let id = core.numbers.fresh();
            let (taps, seen) = core.taps();
            let (inbox, sources) = taps.attach_all(id, patterns, cells, &seen)?;
            core.carrier().renew_tables(sources);
            Ok((id, inbox))
        })?;
        self.begin_tap(id, Vec::new(), inbox, true)
    }

    fn begin_tap(&self, id: u64, channels: Vec<TapChannel>, inbox: Arc<Inbox>, tells_present: bool) -> Result<Tap, Refusals> {
        let known = channels.iter().map(|_| ChannelState::new(tells_present)).collect();
        let mut tap = Tap { shared: self.shared.clone(), id, channels, inbox, segments: Vec::new(), count: 0, known, tells_present, row: Row::default() };
        tap.collect();
        let mine = tap.segments.iter().map(|(_, segment)| (segment.source, segment.end.reader())).collect::<Vec<_>>();
        let begun = self.shared.wait_for(None, ATTACH_MAX, |core| {
            Ok(mine
                .iter()
                .all(|(source, reader)| reader.written() > 0 || core.safety.lost.contains(source) || core.host.statistics(*source).stopped)
                .then_some(()))
        })?;
        match begun {
            WaitResult::Done(()) => Ok(tap),
            _ => Err(refuse(Class::InvalidState, "a kernel did not answer", "is its processor overloaded? see statistics()")),
        }
    }
}

impl Tap {
    /// Returns the observed channels, in the order asked for.
    pub fn channels(&self) -> &[TapChannel] {
        &self.channels
    }

    /// Makes time under the virtual clock wait for the reader of this tap, so that nothing is lost however fast it passes.
    /// Time must be advanced by another thread.
    pub fn hold_time(&self) {
        if self.shared.is_virtual {
            let mut core = self.shared.locked();
            let (log, ends) = (core.observation.log.next(), core.observation.ends.next());
            core.observation.taps.hold(self.id, log, ends);
        }
    }

    /// Notes that the owner of this tap has taken the entries of the log and the ends before these numbers; time waits for the rest too.
    pub fn heard(&self, log: u64, ends: u64) {
        if self.shared.is_virtual {
            self.shared.locked().observation.taps.heard(self.id, log, ends);
        }
    }

    /// Waits until time waits for this tap, at most `timeout`: for the thread that holds time.
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
            self.known.push(ChannelState::new(self.tells_present));
        }
        for segment in arrived.segments.drain(..) {
            self.count += 1;
            self.segments.push((self.count, segment));
        }
    }

    /// Returns true if a later ring of the same source is in force.
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
            known.put(&mut out.runs[channel], time_ns, number, false, &bytes);
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

impl Drop for Tap {
    fn drop(&mut self) {
        // Of a closed system nothing runs any more; a system whose supervisor panicked takes no command.
        if !self.shared.core.is_poisoned() {
            let _closed = self.shared.command(|core| {
                let sources = core.observation.taps.detach(self.id);
                core.carrier().renew_tables(sources);
                Ok(())
            });
        }
        self.inbox.relieve();
    }
}

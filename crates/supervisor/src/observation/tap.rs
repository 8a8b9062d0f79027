// SPDX-License-Identifier: Apache-2.0
//! Taps, which deliver all values of some SVVs and private cells, at the full rate at which blocks store them, to scopes and recorders.
//!
//! | | the kernels | a tap |
//! |---|---|---|
//! | can hold up the other | never | never; under the virtual clock, it can hold time on request |
//! | loses values | never | if it is read too late: a ring holds 2 s of firings, at least 256 |
//! | knows its losses | | exactly, by channel, if the writer numbers its values |
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

/// Maximum time for kernels to switch to a new table. They switch within a firing; a longer delay means that a processor is not running.
const ATTACH_MAX: Duration = Duration::from_secs(5);

/// Tap that observes values of a running system; see [`System::tap`]. Dropping it ends the observation.
pub struct Tap {
    shared: Arc<SystemState>,
    id: u64,
    channels: Vec<TapChannel>,
    inbox: Arc<Inbox>,
    /// Segments with their numbers.
    segments: Vec<(u64, Segment)>,
    count: u64,
    known: Vec<ChannelState>,
    tells_present: bool,
    row: Row,
}

impl System {
    /// Observes SVVs, by name, and private cells of instances, by `INSTANCE:CELL`: delivers every value stored after this call, once, in
    /// order, with its number and time. The tap follows an SVV to another writer, even in another source or on another processor, and
    /// follows an instance that is recreated under the same name. Fails if a name does not exist.
    ///
    /// Computations are not affected. Each tap costs one copy of its observed values per firing.
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

    /// Observes all items that match these names, where `*` stands for any sequence of characters and `?` for a single character,
    /// including items created later. If `cells` is true, also observes the private cells of all instances. The first value of each item
    /// is its current one, with its number and time. Fails if a name without `*` or `?` does not exist.
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
            _ => Err(refuse(Class::InvalidState, "a kernel did not answer", "check with statistics() whether its processor is overloaded")),
        }
    }
}

impl Tap {
    /// Returns the observed channels, in the order requested.
    pub fn channels(&self) -> &[TapChannel] {
        &self.channels
    }

    /// Makes the virtual clock wait for the reader of this tap, so that nothing is lost at any speed. Time must be advanced on another
    /// thread.
    pub fn hold_time(&self) {
        if self.shared.is_virtual {
            let mut core = self.shared.locked();
            let (log, ends) = (core.observation.log.next(), core.observation.ends.next());
            core.observation.taps.hold(self.id, log, ends);
        }
    }

    /// Records that the owner of this tap has received the log entries and ends before these numbers; the virtual clock waits for the
    /// remaining ones as well.
    pub fn heard(&self, log: u64, ends: u64) {
        if self.shared.is_virtual {
            self.shared.locked().observation.taps.heard(self.id, log, ends);
        }
    }

    /// Waits at most `timeout` until the virtual clock waits for this tap. For use by the thread that holds time.
    pub fn wait(&self, timeout: Duration) {
        self.inbox.wait_pressed(timeout);
    }

    /// Takes all values that have arrived since the previous take. Allocates only if `out` has never held that many values; not for use
    /// on the real-time path.
    pub fn take(&mut self, out: &mut Samples) {
        self.collect();
        out.clear(self.channels.len());
        self.take_stores(out);
        let mut index = 0;
        while index < self.segments.len() {
            // Check before taking its rows: a ring receives no more rows once its successor is in force.
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

    /// Returns true if a later ring of the same source has taken effect.
    fn is_over(&self, index: usize) -> bool {
        let source = self.segments[index].1.source;
        self.segments[index + 1..].iter().any(|(_, later)| later.source == source && later.end.reader().written() > 0)
    }

    fn take_stores(&mut self, out: &mut Samples) {
        let mut arrived = self.inbox.locked();
        // Values of channels added meanwhile wait for the next take.
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
        // A closed system runs nothing, and a system whose supervisor panicked accepts no command.
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

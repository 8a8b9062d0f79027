// SPDX-License-Identifier: Apache-2.0
//! Events, time and statistics of a host, as read by a supervisor.
use super::*;

impl Host {
    /// Returns the next event, if there is one. Called only by the supervisor. The events of all sources, including acknowledgements of
    /// scripts, are returned in the order in which they occurred.
    pub fn poll(&self) -> Option<Event> {
        if let Some(event) = self.remote_sources.pop_first() {
            return Some(event);
        }
        let event = self.next_event()?;
        Some(if self.remote_sources.is_any() { self.remote_sources.serve(event) } else { event })
    }

    fn next_event(&self) -> Option<Event> {
        let rings = self.shared.supervisor.rings();
        let sources = self.sources();
        let next = sources.iter().filter_map(|source| Some((source.listener().next_serial(&source.done)?, source))).min_by_key(|(serial, _)| *serial);
        if let Some(told) = self.remote_sources.take_told(next.as_ref().map(|(serial, _)| *serial)) {
            return Some(told);
        }
        if let Some(event) = sources.iter().find_map(|source| self.given_up(source)) {
            return Some(event);
        }
        if let Some(text) = self.shared.take_replaced() {
            return Some(Event::Replaced { text, time_ns: self.now_ns() });
        }
        let Some((serial, source)) = next else {
            self.polled.store(rings, Ordering::Release);
            return None;
        };
        source.listener().take(source.id, serial)
    }

    /// Returns, once, the event that reports that the watchdog has given up on a source, because its block cannot be aborted or its
    /// thread has exited.
    fn given_up(&self, source: &Source) -> Option<Event> {
        let (is_deaf, is_gone) = (source.is_deaf.load(Ordering::Acquire), source.is_gone.load(Ordering::Acquire));
        if !(is_deaf || is_gone) || source.is_told.swap(true, Ordering::AcqRel) {
            return None;
        }
        let time_ns = self.now_ns();
        Some(if is_gone { Event::Ended { source: source.id, time_ns } } else { Event::Deaf { source: source.id, time_ns } })
    }

    /// Waits, under the monotonic clock, until there is an event, `unpark` is called, or `until_ns` is reached. Call it after `poll` has
    /// returned `None`; not for the real-time path of a source. Under the virtual clock, it returns immediately.
    pub fn park(&self, until_ns: Option<i64>) {
        if self.executor.is_none() {
            self.shared.supervisor.sleep(self.polled.load(Ordering::Acquire), until_ns.map(|until| (self.epoch_ns + until).max(0)));
        }
    }

    /// Returns the number of rings of the supervisor's bell so far. Read it before `poll` and other checks, and pass it to
    /// [`Host::park_since`], so that no event that arrives in the meantime is missed, even if other threads poll too.
    pub fn rings(&self) -> u32 {
        self.shared.supervisor.rings()
    }

    /// Parks a supervisor that shares polling with other threads; returns immediately if its bell was rung since `seen`.
    pub fn park_since(&self, seen: u32, until_ns: Option<i64>) {
        if self.executor.is_none() {
            self.shared.supervisor.sleep(seen, until_ns.map(|until| (self.epoch_ns + until).max(0)));
        }
    }

    /// Makes the calling thread poll in the supervisor's place until [`Host::stop_attending`]. Reports from kernels then do not wake the
    /// supervisor, unless the calling thread does not poll within 1 ms.
    pub fn attend(&self) {
        self.shared.supervisor.attend();
    }

    /// Ends [`Host::attend`]. `seen`: value of [`Host::rings`] before the last `poll` that found nothing; any later notification wakes
    /// the supervisor.
    pub fn stop_attending(&self, seen: u32) {
        self.shared.supervisor.leave(seen);
    }

    /// Wakes `park`, now or at its next call.
    pub fn unpark(&self) {
        self.shared.supervisor.ring();
    }

    /// Returns, under the virtual clock, the time of the next event (a release, a pending request, an arrival on the carrier).
    pub fn next_time(&self) -> Option<i64> {
        let firing = self.executor().next().map(|(time, _)| time);
        let arrival = self.carrier.lock().expect("nobody panics with the lock held").next_arrival();
        [firing, arrival].into_iter().flatten().min()
    }

    /// Sets the virtual clock to the time of the next firing, if that is not after `limit_ns`, and runs that firing (with any that
    /// preempt it). The effects of a firing that ends after `limit_ns` are not visible until the clock reaches its end. Returns false,
    /// without changing the clock, if there is no such firing. Fails if more than 10,000 requested firings fall on one instant; the
    /// remaining ones are refused.
    pub fn fire_next(&self, limit_ns: i64) -> Result<bool, String> {
        containment::prepare_thread();
        let executor = self.executor();
        loop {
            let firing = executor.next();
            let arrival = self.carrier.lock().expect("nobody panics with the lock held").next_arrival();
            if let Some(arrival) = arrival.filter(|&arrival| arrival <= limit_ns && firing.is_none_or(|(time, _)| arrival <= time)) {
                self.deliver(arrival.max(self.now_ns()));
                continue;
            }
            let Some((time, index)) = firing.filter(|&(time, _)| time <= limit_ns) else { return Ok(false) };
            executor.fire(index, time, limit_ns, &self.now_ns)?;
            if let Some(trace) = self.trace.get() {
                trace.gather();
            }
            return Ok(true);
        }
    }

    /// Returns, under the virtual clock, the end of all computations so far.
    pub fn busy_until_ns(&self) -> i64 {
        self.executor().busy_until_ns()
    }

    /// Advances the virtual clock to a time before the next event.
    pub fn set_now(&self, now_ns: i64) {
        self.now_ns.fetch_max(now_ns, Ordering::Relaxed);
    }

    /// Returns the period of a timer; `None` for other sources.
    pub fn period_ns(&self, source: SourceId) -> Option<i64> {
        self.source(source).period_ns()
    }

    /// Returns the counters and histograms of a source.
    pub fn statistics(&self, source: SourceId) -> Statistics {
        if let Some(remote) = self.remote(source) {
            return remote.statistics(source);
        }
        self.source(source).statistics()
    }

    /// Makes the probe sample the blocks of a source for at least `for_ns`, one per firing. If several requests overlap, sampling stops
    /// at the latest of their ends.
    pub fn probe(&self, source: SourceId, for_ns: u64) {
        if let Some(remote) = self.remote(source) {
            remote.probe(source, for_ns);
        }
        let until_ns = monotonic_ns().saturating_add(i64::try_from(for_ns).unwrap_or(i64::MAX));
        self.source(source).probe_until_ns.fetch_max(until_ns, Ordering::Relaxed);
    }

    /// Returns true if the probe currently samples the blocks of a source.
    pub fn probes(&self, source: SourceId) -> bool {
        self.source(source).probe_until_ns.load(Ordering::Relaxed) > monotonic_ns()
    }

    /// Returns the durations of the sampled invocations of a block in `source`.
    pub fn block_times(&self, source: SourceId, block: &kernel::Block) -> BlockTimes {
        match self.remote(source) {
            Some(remote) => remote.block_times(block.id()),
            None => block.block_times(),
        }
    }
}

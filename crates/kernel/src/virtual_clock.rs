// SPDX-License-Identifier: Apache-2.0
//! All sources under the virtual clock: one thread, ordered by time, priority, RTP, source.
//!
//! A firing of a source with a virtual cost occupies [release, release + cost). What is released in that time by a source of
//! higher priority on the same RTP, or by any source of another RTP, may run inside it: at its points (inside and between latches,
//! between steps, inside and between publications) the seed chooses whether what is due next starts there, as a firing within the
//! firing; how likely that is, the seed chooses once a firing, so that some are interrupted early and some at their very end.
//! What was not chosen runs after it. So a preempted firing is exactly a stack of calls, and every interleaving at these points
//! comes with some seed.
use crate::clock::monotonic_ns;
use crate::firing::Kernel;
use crate::preempt::{Never, Preempt};
use crate::source::{Source, add};
use std::cell::{Cell, RefCell, UnsafeCell};
use std::cmp::Reverse;
use std::sync::Arc;
use std::sync::atomic::{AtomicI64, Ordering};

/// More firings than these in one instant are a loop.
const FIRINGS_AN_INSTANT: u32 = 10_000;

/// Powers of two that the rarity of preemption is chosen from.
const RARITIES: u64 = 8;

/// The executor. One thread at a time uses it (the host holds a lock).
pub(crate) struct Virtual {
    /// Boxed, so that a kernel stays where it is while others are added.
    #[allow(clippy::vec_box, reason = "a firing holds its own member while sources are added")]
    sources: RefCell<Vec<Box<Member>>>,
    seed: Cell<u64>,
    instant: Cell<(i64, u32)>,
}

struct Member {
    source: Arc<Source>,
    kernel: UnsafeCell<Kernel>,
    /// Number of the next release of a timer, or of the next firing.
    next: Cell<u64>,
    fires: Cell<bool>,
}

impl Virtual {
    pub(crate) fn new(seed: u64) -> Virtual {
        Virtual { sources: RefCell::default(), seed: Cell::new(seed ^ 0x9e37_79b9_7f4a_7c15), instant: Cell::new((i64::MIN, 0)) }
    }

    pub(crate) fn add(&self, mut kernel: Kernel, now_ns: i64) {
        let next = kernel.source.period_ns().map_or(1, |period| now_ns / period + 1) as u64;
        kernel.firing = next - 1;
        let source = kernel.source.clone();
        self.sources.borrow_mut().push(Box::new(Member { source, kernel: UnsafeCell::new(kernel), next: Cell::new(next), fires: Cell::new(false) }));
    }

    /// Carries out what was submitted to `source`.
    pub(crate) fn carry_out(&self, source: usize, now_ns: i64) {
        let member = self.member(source);
        // SAFETY: one thread, and no firing is under way between two calls of the host.
        unsafe { &mut *member.kernel.get() }.carry_out_all(now_ns);
    }

    /// The kernel of a source, between two firings.
    pub(crate) fn with_kernel<T>(&self, source: usize, then: impl FnOnce(&mut Kernel) -> T) -> T {
        // SAFETY: as for `carry_out`.
        then(unsafe { &mut *self.member(source).kernel.get() })
    }

    /// When the next firing is, and of which source.
    pub(crate) fn next(&self) -> Option<(i64, usize)> {
        let sources = self.sources.borrow();
        let due = sources.iter().enumerate().filter_map(|(index, member)| Some((member.release_ns()?, index)));
        due.min_by_key(|&(time, index)| {
            let spec = &sources[index].source.spec;
            (time, Reverse(spec.priority), spec.rtp, index)
        })
    }

    /// Runs the next firing, at `time_ns` of source `index`; what preempts it runs within.
    pub(crate) fn fire(&self, index: usize, time_ns: i64, clock: &AtomicI64) -> Result<(), String> {
        let (instant, count) = self.instant.get();
        let count = if instant == time_ns { count + 1 } else { 1 };
        self.instant.set((time_ns, count));
        let member = self.member(index);
        if count > FIRINGS_AN_INSTANT {
            return Err(format!(
                "more than {FIRINGS_AN_INSTANT} firings at {time_ns} ns, the last of source '{}': sources raise each other without time passing; let a timer drive one of them",
                member.source.spec.name
            ));
        }
        self.run(member, time_ns, clock, None);
        Ok(())
    }

    pub(crate) fn close(&self) {
        for member in self.sources.borrow_mut().drain(..) {
            member.kernel.into_inner().close();
        }
    }

    fn member(&self, index: usize) -> &Member {
        let member: *const Member = &raw const *self.sources.borrow()[index];
        // SAFETY: members are boxed and stay until `close`, which the host calls when nothing else runs.
        unsafe { &*member }
    }

    fn run(&self, member: &Member, release_ns: i64, clock: &AtomicI64, outer: Option<&Within<'_>>) {
        clock.fetch_max(release_ns, Ordering::Relaxed);
        let number = member.next.replace(member.next.get() + 1);
        if member.source.period_ns().is_none() {
            member.source.requests.fetch_sub(1, Ordering::SeqCst);
        }
        member.fires.set(true);
        // SAFETY: a source that fires is never started again within its firing, so this is the one reference.
        let kernel = unsafe { &mut *member.kernel.get() };
        kernel.firing = number - 1;
        kernel.carry_out_all(release_ns);
        let cost_ns = member.source.spec.virtual_cost_ns as i64;
        let started_ns = monotonic_ns();
        if cost_ns == 0 {
            kernel.fire(number, release_ns, started_ns, &Never);
        } else {
            let rarity = (1 << (self.random() % RARITIES)) - 1;
            kernel.fire(number, release_ns, started_ns, &Within { executor: self, member, end_ns: release_ns + cost_ns, rarity, clock, outer });
        }
        kernel.wake();
        member.source.counters.jitter.add(0);
        member.source.counters.duration.add(cost_ns);
        member.skip(release_ns + cost_ns);
        member.fires.set(false);
        if let Some(outer) = outer {
            outer.member.source.guard.excuse(monotonic_ns() - started_ns);
        }
    }

    fn random(&self) -> u64 {
        // xorshift64: small, and the same everywhere.
        let mut x = self.seed.get();
        x ^= x << 13;
        x ^= x >> 7;
        x ^= x << 17;
        self.seed.set(x);
        x
    }
}

impl Member {
    /// Releases of a timer that its own firing, which ended at `end_ns`, was not over for: skipped, but for the last.
    fn skip(&self, end_ns: i64) {
        let Some(period_ns) = self.source.period_ns() else { return };
        let skipped = (end_ns - self.next.get() as i64 * period_ns) / period_ns;
        if skipped > 0 {
            add(&self.source.counters.overruns, skipped as u64);
            self.next.set(self.next.get() + skipped as u64);
        }
    }

    fn release_ns(&self) -> Option<i64> {
        match self.source.period_ns() {
            Some(period_ns) => Some(self.next.get() as i64 * period_ns),
            None => (self.source.requests.load(Ordering::SeqCst) > 0).then(|| self.source.requested_ns.load(Ordering::SeqCst) as i64),
        }
    }
}

/// A firing with a cost, in which others may start.
struct Within<'a> {
    executor: &'a Virtual,
    member: &'a Member,
    end_ns: i64,
    /// At one point in `rarity` + 1, a power of two, something starts.
    rarity: u64,
    clock: &'a AtomicI64,
    outer: Option<&'a Within<'a>>,
}

impl Within<'_> {
    /// True where `other` may run inside this firing and all that it is in.
    fn yields_to(&self, other: &Member) -> bool {
        let (this, spec) = (&self.member.source.spec, &other.source.spec);
        (spec.rtp != this.rtp || spec.priority > this.priority) && self.outer.is_none_or(|outer| outer.yields_to(other))
    }
}

impl Preempt for Within<'_> {
    const POSSIBLE: bool = true;

    fn point(&self) {
        while self.executor.random() & self.rarity == 0 {
            let found = {
                let sources = self.executor.sources.borrow();
                let due = sources.iter().enumerate().filter(|(_, other)| !other.fires.get() && self.yields_to(other));
                let due = due.filter_map(|(index, other)| Some((other.release_ns().filter(|&release| release < self.end_ns)?, index)));
                due.min_by_key(|&(time, index)| (time, Reverse(sources[index].source.spec.priority), index))
            };
            let Some((release_ns, index)) = found else { return };
            self.executor.run(self.executor.member(index), release_ns, self.clock, Some(self));
        }
    }
}

impl Kernel {
    /// The end of a source: devices are safe, and closed though others may still hold them; but where an heir has them.
    pub(crate) fn close(&mut self) {
        if self.source.leaving.load(Ordering::Acquire) {
            return;
        }
        for device in &self.table.devices {
            // SAFETY: this is the kernel of the device's source, and its last call.
            unsafe {
                device.safe_state();
                device.close();
            }
        }
    }
}

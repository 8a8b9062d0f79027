// SPDX-License-Identifier: Apache-2.0
//! Sources under the virtual clock: one thread, ordered by time, priority, RTP, source.
//!
//! A firing of a source with a virtual cost occupies [release, release + cost). If a source of higher priority on the same RTP, or any
//! source of another RTP, is released in that time, it may run inside the firing. At the preemption points (inside and between latches,
//! between steps, inside and between publications), the seed determines whether the next due firing starts there, nested in this one. The
//! seed chooses the probability once per firing, so that some firings are interrupted early and some at their very end. Firings that did
//! not start inside run after it. A preempted firing is thus exactly a stack of calls, and every interleaving at these points occurs for
//! some seed. A timer that cannot preempt the firing loses its releases in that time, except the last.
//!
//! A firing whose end is later than the time that the clock may reach *stands*: its steps have run, but none of its effects is visible
//! until the clock reaches its end; until then, its image is unchanged. Scripts for its source, except readings, wait until then, and so
//! do sources that cannot preempt it.
use kernel::Table;
use kernel::clock::monotonic_ns;
use kernel::counters::add;
use kernel::firing::ComputeResult;
use kernel::preempt::{Never, Preempt};
use kernel::shared::Source;
use kernel::state::Kernel;
use opengpac::floats::Standard;
use std::cell::{Cell, RefCell, UnsafeCell};
use std::cmp::Reverse;
use std::sync::Arc;
use std::sync::atomic::{AtomicI64, Ordering};

/// Maximum number of requested firings in one instant; a larger number indicates a loop. Timers do not count.
const FIRINGS_AN_INSTANT: u32 = 10_000;

/// Number of powers of two from which the rarity of preemption is drawn.
const RARITIES: u64 = 8;

/// The executor, used by one thread at a time (the host holds a lock).
pub(crate) struct Virtual {
    /// Sources, boxed so that kernels do not move when sources are added.
    #[allow(clippy::vec_box, reason = "a firing holds its own member while sources are added")]
    sources: RefCell<Vec<Box<Member>>>,
    seed: Cell<u64>,
    /// Last instant, and the number of requests served in it.
    instant: Cell<(i64, u32)>,
    /// Time up to which the clock may currently advance.
    limit_ns: Cell<i64>,
    /// Latest end of a firing with a cost.
    busy_until_ns: Cell<i64>,
    /// Number of standing firings.
    standing: Cell<usize>,
}

struct Member {
    source: Arc<Source>,
    kernel: UnsafeCell<Kernel>,
    /// Number of the next release of a timer, or of the next firing of another source.
    next: Cell<u64>,
    fires: Cell<bool>,
    standing: Cell<Option<StandingFiring>>,
    /// Values stored by a standing firing, to be written to the image at its end.
    unseen: RefCell<Vec<StoredCell>>,
}

/// A cell, and its current or previous contents.
type StoredCell = (kernel::Cell, Vec<u8>);

/// A firing whose steps have run but which has not ended.
#[derive(Clone, Copy)]
struct StandingFiring {
    release_ns: i64,
    end_ns: i64,
    computed: ComputeResult,
}

impl Virtual {
    pub(crate) fn new(seed: u64) -> Virtual {
        Virtual {
            sources: RefCell::default(),
            seed: Cell::new(seed ^ 0x9e37_79b9_7f4a_7c15),
            instant: Cell::new((i64::MIN, 0)),
            limit_ns: Cell::new(i64::MAX),
            busy_until_ns: Cell::new(i64::MIN),
            standing: Cell::new(0),
        }
    }

    pub(crate) fn add(&self, mut kernel: Kernel, now_ns: i64) {
        let next = kernel.source.period_ns().map_or(1, |period| now_ns / period + 1) as u64;
        kernel.firing = next - 1;
        let source = kernel.source.clone();
        let (kernel, next) = (UnsafeCell::new(kernel), Cell::new(next));
        self.sources.borrow_mut().push(Box::new(Member {
            source,
            kernel,
            next,
            fires: Cell::new(false),
            standing: Cell::new(None),
            unseen: RefCell::default(),
        }));
    }

    /// Carries out scripts submitted to `source`. If a firing of that source stands, carries out only read-only scripts; the others
    /// follow when the firing ends.
    pub(crate) fn carry_out(&self, source: usize, now_ns: i64) {
        let _standard = Standard::enter();
        let member = self.member(source);
        // SAFETY: one thread, and no step runs between two calls of the host.
        let kernel = unsafe { &mut *member.kernel.get() };
        if member.standing.get().is_some() { kernel.answer_readings(now_ns) } else { kernel.carry_out_all(now_ns) }
    }

    /// Runs a function on the kernel of a source, between two firings.
    pub(crate) fn with_kernel<T>(&self, source: usize, then: impl FnOnce(&mut Kernel) -> T) -> T {
        let _standard = Standard::enter();
        // SAFETY: as for `carry_out`.
        then(unsafe { &mut *self.member(source).kernel.get() })
    }

    /// Returns the time and source of the next event: the start of a firing, or the end of a standing one. At the same instant, ends
    /// precede starts.
    pub(crate) fn next(&self) -> Option<(i64, usize)> {
        let sources = self.sources.borrow();
        let due = sources.iter().enumerate().filter_map(|(index, member)| Some((self.served_ns(&sources, member)?, index)));
        due.min_by_key(|&(time, index)| {
            let spec = &sources[index].source.spec;
            (time, sources[index].standing.get().is_none(), Reverse(spec.priority), spec.rtp, index)
        })
    }

    #[allow(clippy::vec_box, reason = "see `sources`")]
    fn served_ns(&self, sources: &[Box<Member>], member: &Member) -> Option<i64> {
        if let Some(standing) = member.standing.get() {
            return Some(standing.end_ns);
        }
        let release_ns = member.release_ns()?;
        Some(self.held_until_ns(sources, member).map_or(release_ns, |end_ns| release_ns.max(end_ns)))
    }

    /// Returns the time until which standing firings delay a source that cannot preempt them.
    #[allow(clippy::vec_box, reason = "see `sources`")]
    fn held_until_ns(&self, sources: &[Box<Member>], member: &Member) -> Option<i64> {
        if self.standing.get() == 0 {
            return None;
        }
        sources.iter().filter(|other| !other.yields_to(member)).filter_map(|other| Some(other.standing.get()?.end_ns)).max()
    }

    /// Returns the time at which the first standing firing ends.
    #[allow(clippy::vec_box, reason = "see `sources`")]
    fn first_end_ns(&self, sources: &[Box<Member>]) -> i64 {
        if self.standing.get() == 0 {
            return i64::MAX;
        }
        sources.iter().filter_map(|member| Some(member.standing.get()?.end_ns)).min().unwrap_or(i64::MAX)
    }

    /// Returns the latest end of all completed firings that have a cost.
    pub(crate) fn busy_until_ns(&self) -> i64 {
        self.busy_until_ns.get()
    }

    /// Serves source `index` at `time_ns`: runs its next firing, with any that preempt it, or the rest of a standing one. A firing that
    /// ends after `limit_ns` stands. Fails if there were too many requests at this instant; all pending requests are then refused.
    pub(crate) fn fire(&self, index: usize, time_ns: i64, limit_ns: i64, clock: &AtomicI64) -> Result<(), String> {
        // It runs on one of the program's threads, whose floating-point settings are arbitrary.
        let _standard = Standard::enter();
        self.limit_ns.set(limit_ns);
        clock.fetch_max(time_ns, Ordering::Relaxed);
        let member = self.member(index);
        if let Some(standing) = member.standing.take() {
            self.standing.set(self.standing.get() - 1);
            self.conclude(member, standing);
            return Ok(());
        }
        let Some(release_ns) = member.release_ns() else { return Ok(()) };
        if member.source.period_ns().is_none() {
            let (instant, count) = self.instant.get();
            let count = if instant == time_ns { count + 1 } else { 1 };
            self.instant.set((time_ns, count));
            if count > FIRINGS_AN_INSTANT {
                return Err(self.refuse_requests(member, time_ns));
            }
        }
        self.run(member, release_ns, clock, None);
        Ok(())
    }

    /// Returns the number of requests not yet served by a firing.
    fn requested(&self) -> u64 {
        self.sources.borrow().iter().map(|member| member.source.requests.pending.load(Ordering::SeqCst)).sum()
    }

    /// Returns true if one more request would exceed the limit of an instant.
    pub(crate) fn is_full(&self) -> bool {
        self.requested() >= u64::from(FIRINGS_AN_INSTANT)
    }

    /// Refuses all pending requests, so that the clock can continue. Returns the error message.
    fn refuse_requests(&self, last: &Member, time_ns: i64) -> String {
        self.instant.set((i64::MIN, 0));
        let refused: u64 = self.sources.borrow().iter().map(|member| member.source.requests.pending.swap(0, Ordering::SeqCst)).sum();
        format!(
            "more than {FIRINGS_AN_INSTANT} requested firings at {time_ns} ns, the last of source '{}': {refused} requests are refused; if sources raise each other without time passing, drive one of them with a timer",
            last.source.spec.name
        )
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
        // A preempted firing finds the control words as its own blocks have left them.
        let _standard = outer.map(|_| Standard::enter());
        let number = member.next.replace(member.next.get() + 1);
        if member.source.period_ns().is_none() {
            member.source.requests.pending.fetch_sub(1, Ordering::SeqCst);
        }
        member.fires.set(true);
        // SAFETY: a source that fires is never started again within its firing, so this is the one reference.
        let kernel = unsafe { &mut *member.kernel.get() };
        kernel.firing = number - 1;
        kernel.carry_out_all(release_ns);
        let end_ns = release_ns.saturating_add(i64::try_from(member.source.spec.virtual_cost_ns).unwrap_or(i64::MAX));
        let started_ns = monotonic_ns();
        if end_ns == release_ns {
            kernel.fire(number, release_ns, started_ns, &Never);
            self.over(member, kernel, release_ns, end_ns);
        } else {
            let rarity = (1 << (self.random() % RARITIES)) - 1;
            let within = Within { executor: self, member, end_ns, rarity, clock, outer };
            if end_ns > self.limit_ns.get() {
                let before = stored(&kernel.table);
                let computed = kernel.compute(number, release_ns, started_ns, &within);
                let now = before.iter().map(|(cell, _)| (cell.clone(), cell.load())).collect();
                before.iter().rev().for_each(|(cell, bytes)| cell.store(bytes));
                member.unseen.replace(now);
                member.standing.set(Some(StandingFiring { release_ns, end_ns, computed }));
                self.standing.set(self.standing.get() + 1);
            } else {
                kernel.fire(number, release_ns, started_ns, &within);
                self.busy_until_ns.set(self.busy_until_ns.get().max(end_ns));
                self.over(member, kernel, release_ns, end_ns);
            }
        }
        if let Some(outer) = outer {
            outer.member.source.containment.excuse(monotonic_ns() - started_ns);
        }
    }

    /// Runs the rest of a standing firing, then the scripts submitted to its source in the meantime.
    fn conclude(&self, member: &Member, StandingFiring { release_ns, end_ns, computed }: StandingFiring) {
        // SAFETY: nothing of this source runs while its firing stands, so this is the one reference.
        let kernel = unsafe { &mut *member.kernel.get() };
        member.unseen.take().iter().for_each(|(cell, bytes)| cell.store(bytes));
        kernel.conclude(computed, release_ns, &Never);
        self.over(member, kernel, release_ns, end_ns);
        kernel.carry_out_all(end_ns);
    }

    fn over(&self, member: &Member, kernel: &mut Kernel, release_ns: i64, end_ns: i64) {
        kernel.wake();
        member.source.counters.jitter.add(0);
        member.source.counters.duration.add(end_ns - release_ns);
        for other in self.sources.borrow().iter().filter(|other| !member.yields_to(other)) {
            other.skip(end_ns);
        }
        member.fires.set(false);
    }

    fn random(&self) -> u64 {
        // xorshift64: small, and identical on all platforms.
        let mut x = self.seed.get();
        x ^= x << 13;
        x ^= x >> 7;
        x ^= x << 17;
        self.seed.set(x);
        x
    }
}

/// Returns the values of all cells that the steps of a table write.
fn stored(table: &Table) -> Vec<StoredCell> {
    let outputs = table.steps.iter().filter_map(|step| step.block.as_ref()).flat_map(|block| block.stores()).map(|(_, cell)| cell);
    let copied = table.copies.iter().flat_map(|copies| &copies.1).map(|(_, to)| to);
    let windows = table.appends.iter().flat_map(|appends| &appends.1).map(|append| append.window.cell());
    outputs.chain(copied).chain(windows).map(|cell| (cell.clone(), cell.load())).collect()
}

impl Member {
    /// Returns true if `other` may run inside a firing of this source.
    fn yields_to(&self, other: &Member) -> bool {
        let (this, spec) = (&self.source.spec, &other.source.spec);
        spec.rtp != this.rtp || spec.priority > this.priority
    }

    /// Skips all but the last of a timer's releases up to `end_ns` that could not start because a firing was still running: the timer's
    /// own, or one on the same RTP that it cannot preempt.
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
            None => (self.source.requests.pending.load(Ordering::SeqCst) > 0).then(|| self.source.requests.since_ns.load(Ordering::SeqCst) as i64),
        }
    }
}

/// A firing with a cost, in which others may start.
struct Within<'a> {
    executor: &'a Virtual,
    member: &'a Member,
    end_ns: i64,
    /// Rarity of starts: on average, a firing starts at one in `rarity` + 1 points; that number is a power of two.
    rarity: u64,
    clock: &'a AtomicI64,
    outer: Option<&'a Within<'a>>,
}

impl Within<'_> {
    /// Returns true if `other` may run inside this firing and all firings that contain it.
    fn yields_to(&self, other: &Member) -> bool {
        self.member.yields_to(other) && self.outer.is_none_or(|outer| outer.yields_to(other))
    }
}

impl Preempt for Within<'_> {
    const POSSIBLE: bool = true;

    fn point(&self) {
        while self.executor.random() & self.rarity == 0 {
            let found = {
                let sources = self.executor.sources.borrow();
                let end_ns = self.end_ns.min(self.executor.first_end_ns(&sources));
                let in_time = |release: &i64| *release < end_ns && *release <= self.executor.limit_ns.get();
                let free = |other: &Member| !other.fires.get() && self.yields_to(other) && self.executor.held_until_ns(&sources, other).is_none();
                let due = sources.iter().enumerate().filter(|(_, other)| free(other));
                let due = due.filter_map(|(index, other)| Some((other.release_ns().filter(in_time)?, index)));
                due.min_by_key(|&(time, index)| (time, Reverse(sources[index].source.spec.priority), index))
            };
            let Some((release_ns, index)) = found else { return };
            self.executor.run(self.executor.member(index), release_ns, self.clock, Some(self));
        }
    }
}

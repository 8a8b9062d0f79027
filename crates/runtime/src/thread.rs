// SPDX-License-Identifier: Apache-2.0
//! A source under the monotonic clock: a thread that waits for its releases and requests.
use crate::reminder::Reminder;
use crate::rights;
use kernel::clock::monotonic_ns;
use kernel::containment;
use kernel::counters::add;
use kernel::preempt::Never;
use kernel::state::Kernel;
use std::hint::spin_loop;
use std::sync::atomic::Ordering;
use std::sync::mpsc::Sender;

/// Time before a release at which a thread wakes up and spins, provided that it has its own core and the required privileges.
const SPIN_NS: i64 = 30_000;

/// Minimum period for spinning; a source with a shorter period only sleeps, because spinning would use a large share of the core.
const SPIN_PERIOD_MIN_NS: i64 = 10 * SPIN_NS;

/// Runs the thread of one source until it is closed. Signals `ready` after requesting its privileges.
pub(crate) fn run(mut kernel: Kernel, epoch_ns: i64, ready: &Sender<()>) {
    let (missing, real_time) = rights::take(&kernel.source.spec);
    *kernel.source.rights_missing.lock().expect("nobody panics with the lock held") = missing;
    containment::prepare_thread();
    forks::bind_thread();
    kernel.source.containment.bind_thread();
    // The thread that made the source may have given up waiting.
    let _told = ready.send(());
    let spins = real_time && kernel.source.spec.core.is_some() && kernel.source.period_ns().is_some_and(|period| period >= SPIN_PERIOD_MIN_NS);
    match kernel.source.period_ns() {
        Some(period_ns) => timer(&mut kernel, epoch_ns, period_ns.max(1), spins),
        None => software(&mut kernel, epoch_ns),
    }
    kernel.carry_out_all(monotonic_ns() - epoch_ns);
    // It sends no reminders after this.
    kernel.shared.supervisor.remind();
    if kernel.source.is_lost.load(Ordering::Acquire) {
        // Its devices are safe. Its exit may need a lock that it holds itself, so it never exits.
        loop {
            // SAFETY: a wait.
            unsafe { libc::pause() };
        }
    }
    kernel.close();
}

/// Runs a timer: firing k is released at epoch + k · period. A missed release consumes its number; there is never a burst.
fn timer(kernel: &mut Kernel, epoch_ns: i64, period_ns: i64, spins: bool) {
    let mut next = (monotonic_ns() - epoch_ns) / period_ns + 1;
    kernel.firing = next as u64 - 1;
    let mut reminder = Reminder::default();
    while !kernel.source.closing.load(Ordering::Acquire) {
        let release_ns = next * period_ns;
        if !wait(kernel, &mut reminder, epoch_ns, release_ns, spins) {
            continue;
        }
        let now_ns = monotonic_ns() - epoch_ns;
        let late_ns = now_ns - release_ns;
        if late_ns >= period_ns {
            let skipped = late_ns / period_ns;
            add(&kernel.source.counters.overruns, skipped as u64);
            next += skipped;
            kernel.look_for_standstill(late_ns, period_ns, now_ns);
        }
        kernel.firing = next as u64 - 1;
        kernel.carry_out_all(now_ns);
        fire(kernel, next as u64, next * period_ns, now_ns, epoch_ns);
        next += 1;
    }
}

/// Interval at which a software source with commanded devices checks for a suspension, because it has no releases to compare with the
/// clock.
const LOOK_NS: i64 = 500_000_000;

/// Runs a software source: each request causes one firing.
fn software(kernel: &mut Kernel, epoch_ns: i64) {
    let mut reminder = Reminder::default();
    while !kernel.source.closing.load(Ordering::Acquire) {
        let seen = kernel.source.bell().rings();
        let now_ns = monotonic_ns() - epoch_ns;
        // Before new reports: those of an earlier firing may have been handled since.
        reminder.look(&kernel.shared.supervisor, now_ns);
        kernel.carry_out_all(now_ns);
        let remind_ns = reminder.look(&kernel.shared.supervisor, now_ns);
        if kernel.source.requests.pending.load(Ordering::SeqCst) == 0 {
            let look_ns = kernel.commands_devices().then_some(now_ns + LOOK_NS);
            kernel.source.bell().sleep(seen, remind_ns.into_iter().chain(look_ns).min().map(|at_ns| epoch_ns + at_ns));
            if let Some(late_ns) = look_ns.map(|at_ns| monotonic_ns() - epoch_ns - at_ns) {
                kernel.look_for_standstill(late_ns, 0, now_ns + LOOK_NS + late_ns);
            }
            continue;
        }
        let requested_ns = kernel.source.requests.since_ns.swap(now_ns as u64, Ordering::SeqCst) as i64;
        kernel.source.requests.pending.fetch_sub(1, Ordering::SeqCst);
        let number = kernel.firing + 1;
        fire(kernel, number, requested_ns.min(now_ns), now_ns, epoch_ns);
    }
}

fn fire(kernel: &mut Kernel, number: u64, release_ns: i64, now_ns: i64, epoch_ns: i64) {
    kernel.fire(number, release_ns, epoch_ns + now_ns, &Never);
    kernel.wake();
    kernel.source.counters.jitter.add(now_ns - release_ns);
    kernel.source.counters.duration.add(monotonic_ns() - epoch_ns - now_ns);
}

/// Waits for the release, carrying out scripts in the meantime. Returns false if the thread was woken earlier.
fn wait(kernel: &mut Kernel, reminder: &mut Reminder, epoch_ns: i64, release_ns: i64, spins: bool) -> bool {
    let sleep_until_ns = release_ns - if spins { SPIN_NS } else { 0 };
    let seen = kernel.source.bell().rings();
    let now_ns = monotonic_ns() - epoch_ns;
    // Before new reports: those of an earlier firing may have been handled since.
    reminder.look(&kernel.shared.supervisor, now_ns);
    if now_ns >= release_ns {
        return true;
    }
    kernel.carry_out_all(now_ns);
    let remind_ns = reminder.look(&kernel.shared.supervisor, now_ns).unwrap_or(i64::MAX);
    if now_ns < sleep_until_ns {
        kernel.source.bell().sleep(seen, Some(epoch_ns + sleep_until_ns.min(remind_ns)));
        return false;
    }
    while monotonic_ns() - epoch_ns < release_ns {
        if !kernel.source.mailbox.is_empty() || kernel.source.closing.load(Ordering::Relaxed) {
            return false;
        }
        spin_loop();
    }
    true
}

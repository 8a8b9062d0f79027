// SPDX-License-Identifier: Apache-2.0
//! A thread that receives a signal late for want of a core is not deaf; one that masks signals is.
#![allow(clippy::disallowed_methods, reason = "threads without a core have no real-time priority")]
#![allow(clippy::undocumented_unsafe_blocks, reason = "threads are pinned and masked by hand")]
use kernel::clock::monotonic_ns;
use kernel::containment::{Containment, install};
use runtime::waits_for_a_core;
use std::ffi::c_void;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
use std::thread::JoinHandle;

const WAITS: u32 = 0;
const RUNS: u32 = 1;
const ENDS: u32 = 2;

/// Spins until told to end.
unsafe extern "C" fn spins(state: *mut c_void) {
    let state = unsafe { &*state.cast::<AtomicU32>() };
    state.store(RUNS, Ordering::SeqCst);
    while state.load(Ordering::SeqCst) != ENDS {
        std::hint::spin_loop();
    }
}

/// Sleeps until told to end.
unsafe extern "C" fn sleeps(state: *mut c_void) {
    let word = unsafe { &*state.cast::<AtomicU32>() };
    word.store(RUNS, Ordering::SeqCst);
    while word.load(Ordering::SeqCst) != ENDS {
        unsafe { libc::syscall(libc::SYS_futex, word.as_ptr(), libc::FUTEX_WAIT, RUNS, std::ptr::null::<libc::timespec>()) };
    }
}

/// A loop on its own thread.
struct Loop {
    containment: Arc<Containment>,
    state: Arc<AtomicU32>,
    /// Returns true if the loop exceeded its budget.
    thread: JoinHandle<bool>,
}

impl Loop {
    fn begin(body: unsafe extern "C" fn(*mut c_void), prepare: fn()) -> Loop {
        Loop::within(Containment::new(0), body, prepare)
    }

    fn within(containment: Containment, body: unsafe extern "C" fn(*mut c_void), prepare: fn()) -> Loop {
        install();
        let (containment, state) = (Arc::new(containment), Arc::new(AtomicU32::new(WAITS)));
        let (its, word) = (containment.clone(), state.clone());
        let thread = std::thread::spawn(move || {
            prepare();
            unsafe { its.run(body, word.as_ptr().cast(), monotonic_ns() - 1) }.is_some()
        });
        while state.load(Ordering::SeqCst) == WAITS {
            std::thread::yield_now();
        }
        Loop { containment, state, thread }
    }

    /// Behaves as if a step were running.
    fn is_in_a_step(&self) {
        unsafe { self.containment.step().write_volatile(3) };
    }

    fn end(self) -> bool {
        self.state.store(ENDS, Ordering::SeqCst);
        unsafe { libc::syscall(libc::SYS_futex, self.state.as_ptr(), libc::FUTEX_WAKE, 1) };
        self.thread.join().unwrap()
    }
}

fn mask_all() {
    unsafe {
        let mut all = std::mem::zeroed();
        libc::sigfillset(&mut all);
        libc::pthread_sigmask(libc::SIG_SETMASK, &all, std::ptr::null_mut());
    }
}

/// Pins the calling thread to a core.
fn pin_to(core: usize) {
    unsafe {
        let mut only: libc::cpu_set_t = std::mem::zeroed();
        libc::CPU_SET(core, &mut only);
        assert_eq!(libc::sched_setaffinity(0, size_of_val(&only), &only), 0);
    }
}

/// Returns the first core that this process may run on.
fn a_core() -> usize {
    unsafe {
        let mut allowed: libc::cpu_set_t = std::mem::zeroed();
        assert_eq!(libc::sched_getaffinity(0, size_of_val(&allowed), &mut allowed), 0);
        (0..libc::CPU_SETSIZE as usize).find(|core| libc::CPU_ISSET(*core, &allowed)).unwrap()
    }
}

#[test]
fn who_has_no_core_is_not_deaf() {
    // Pinned to the same core as the watching thread, at a lower priority.
    let watching = std::thread::spawn(|| {
        let one = Loop::begin(spins, || {
            pin_to(a_core());
            unsafe { libc::sched_setscheduler(0, libc::SCHED_IDLE, &libc::sched_param { sched_priority: 0 }) };
        });
        pin_to(a_core());
        assert!((0..1000).all(|_| !one.containment.watch(monotonic_ns(), waits_for_a_core)), "it could only not run");
        one.end();
    });
    watching.join().unwrap();
}

#[test]
fn who_masks_the_signal_is_deaf_whether_it_runs_or_sleeps() {
    for body in [spins, sleeps] {
        let one = Loop::begin(body, mask_all);
        one.is_in_a_step();
        while !one.containment.watch(monotonic_ns(), waits_for_a_core) {
            std::thread::yield_now();
        }
        assert!(one.end(), "its source stops if it comes back");
    }
}

/// Budget of loops that are charged for what they use.
const BUDGET_NS: i64 = 200_000_000;

#[test]
fn who_has_no_core_spends_nothing_where_waits_do_not_count() {
    let watching = std::thread::spawn(|| {
        let one = Loop::within(Containment::new(BUDGET_NS).without_waits(), spins, || {
            pin_to(a_core());
            unsafe { libc::sched_setscheduler(0, libc::SCHED_IDLE, &libc::sched_param { sched_priority: 0 }) };
        });
        pin_to(a_core());
        let until_ns = monotonic_ns() + 4 * BUDGET_NS;
        while monotonic_ns() < until_ns {
            assert_eq!(one.containment.spent(monotonic_ns(), waits_for_a_core), None, "it could only wait");
        }
        one.end();
    });
    watching.join().unwrap();
}

#[test]
fn who_spins_or_sleeps_spends_its_budget_where_waits_do_not_count() {
    for body in [spins, sleeps] {
        let one = Loop::within(Containment::new(BUDGET_NS).without_waits(), body, || {});
        let started_ns = monotonic_ns();
        while one.containment.spent(monotonic_ns(), waits_for_a_core).is_none() {
            std::thread::park_timeout(std::time::Duration::from_millis(10));
        }
        assert!(monotonic_ns() - started_ns > BUDGET_NS / 2, "half of it is not charged");
        assert!(!one.end(), "nobody has sent it a signal");
    }
}

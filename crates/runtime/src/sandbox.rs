// SPDX-License-Identifier: Apache-2.0
//! A block's entry called outside every firing, as a trial does, under the guard that firings have.
use kernel::clock::monotonic_ns;
use kernel::floats;
use kernel::guard::Call;
use kernel::guard::{self, Guard, OUTSIDE};
use kernel::steps;
use opengpac::Invocation;
use opengpac::abi::{Run, outcome};
use std::ffi::c_void;
use std::sync::Arc;
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::Duration;

/// How often its watchdog looks.
const LOOK_EVERY: Duration = Duration::from_millis(10);

/// Time of one call: that of a firing under the virtual clock.
const BUDGET_NS: i64 = crate::clock::BUDGET_VIRTUAL_NS;

/// Calls of entries that a signal or a spent budget ends, not the process. Not for the real-time path.
pub struct Sandbox {
    guard: Arc<Guard>,
    /// Dropped, it ends the watchdog.
    watches: Option<Sender<()>>,
    watchdog: Option<JoinHandle<()>>,
}

impl Sandbox {
    /// Installs the handlers and starts the watchdog; without one, where no thread can be made, an endless loop stays one.
    pub fn new() -> Sandbox {
        guard::install();
        let guard = Arc::new(Guard::new(BUDGET_NS));
        let (watches, ended) = channel();
        let watched = guard.clone();
        let watch = move || {
            while ended.recv_timeout(LOOK_EVERY) == Err(RecvTimeoutError::Timeout) {
                let _deaf = watched.watch(monotonic_ns());
            }
        };
        let watchdog = std::thread::Builder::new().name("trial-watchdog".into()).spawn(watch).ok();
        Sandbox { guard, watches: Some(watches), watchdog }
    }

    /// Calls an entry. What it returned, or the outcome `SIGNAL`.
    ///
    /// # Safety
    /// As for [`Run`]. After a signal the instance is not called again.
    pub unsafe fn call(&self, run: Run, instance: *mut c_void, invocation: &Invocation) -> u64 {
        guard::prepare_thread();
        guard::trust(run);
        let call = Call { run, instance, invocation };
        self.guard.set_calls(&raw const call);
        let mut frame = Frame { guard: &raw const *self.guard, run, instance, invocation, result: 0 };
        let (ended, changed) = floats::outside(|| {
            // SAFETY: the guard lives as long as this; the body keeps nothing that must be dropped.
            unsafe { self.guard.run(body, (&raw mut frame).cast(), monotonic_ns()) }
        });
        let returned = if changed { outcome::FLOATS } else { frame.result };
        ended.map_or(returned, |over| steps::ended_by(&over))
    }
}

impl Default for Sandbox {
    fn default() -> Sandbox {
        Sandbox::new()
    }
}

impl Drop for Sandbox {
    fn drop(&mut self) {
        drop(self.watches.take());
        if let Some(watchdog) = self.watchdog.take() {
            let _ = watchdog.join();
        }
    }
}

struct Frame {
    guard: *const Guard,
    run: Run,
    instance: *mut c_void,
    invocation: *const Invocation,
    result: u64,
}

unsafe extern "C" fn body(frame: *mut c_void) {
    // SAFETY: `call` passes its own frame, and answers for what is in it.
    unsafe {
        let frame = frame.cast::<Frame>();
        let step = (*(*frame).guard).step();
        step.write_volatile(0);
        let result = ((*frame).run)((*frame).instance, (*frame).invocation);
        step.write_volatile(OUTSIDE);
        (*frame).result = result;
    }
}

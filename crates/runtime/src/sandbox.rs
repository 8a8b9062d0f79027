// SPDX-License-Identifier: Apache-2.0
//! Calls of a block's entry outside any firing, as in a trial, under the same containment as in firings.
use crate::waiting::waits_for_a_core;
use kernel::clock::monotonic_ns;
use kernel::containment::Call;
use kernel::containment::{self, Containment, OUTSIDE};
use kernel::floats;
use kernel::steps;
use opengpac::Invocation;
use opengpac::abi::{Run, outcome};
use std::ffi::c_void;
use std::sync::Arc;
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::Duration;

/// Poll period of the watchdog.
const LOOK_EVERY: Duration = Duration::from_millis(10);

/// Time budget of one call: the same as for a firing under the virtual clock.
const BUDGET_NS: i64 = crate::clock::BUDGET_VIRTUAL_NS;

/// Sandbox for calls of entries: a signal or an exceeded budget ends the call rather than the process. Not for the real-time path.
pub struct Sandbox {
    containment: Arc<Containment>,
    /// Channel that stops the watchdog when it is closed.
    watches: Option<Sender<()>>,
    watchdog: Option<JoinHandle<()>>,
}

impl Sandbox {
    /// Installs the handlers and starts the watchdog. If the watchdog's thread cannot be created, endless loops are not aborted.
    pub fn new() -> Sandbox {
        Sandbox::with_budget(BUDGET_NS)
    }

    /// Creates a sandbox for a block whose body is run by the interpreter of this process. It has no budget, because a call aborted there
    /// would never release the interpreter's lock.
    pub fn interpreted() -> Sandbox {
        Sandbox::with_budget(i64::MAX)
    }

    fn with_budget(budget_ns: i64) -> Sandbox {
        containment::install();
        let containment = Arc::new(Containment::new(budget_ns).without_waits());
        let (watches, ended) = channel();
        let watched = containment.clone();
        let watch = move || {
            while ended.recv_timeout(LOOK_EVERY) == Err(RecvTimeoutError::Timeout) {
                let _deaf = watched.watch(monotonic_ns(), waits_for_a_core);
            }
        };
        let watchdog = std::thread::Builder::new().name("trial-watchdog".into()).spawn(watch).ok();
        Sandbox { containment, watches: Some(watches), watchdog }
    }

    /// Calls an entry. Returns its result, or the outcome `SIGNAL`.
    ///
    /// # Safety
    /// Same as for [`Run`]. After a signal, the instance must not be called again.
    pub unsafe fn call(&self, run: Run, instance: *mut c_void, invocation: &Invocation) -> u64 {
        containment::prepare_thread();
        containment::trust(run);
        let call = Call { run, instance, invocation };
        self.containment.set_calls(&raw const call);
        let mut frame = Frame { containment: &raw const *self.containment, run, instance, invocation, result: 0 };
        let (ended, changed) = floats::outside(|| {
            // SAFETY: the containment lives as long as this; the body keeps nothing that must be dropped.
            unsafe { self.containment.run(body, (&raw mut frame).cast(), monotonic_ns()) }
        });
        let returned = if changed { outcome::FLOATS } else { frame.result };
        ended.map_or(returned, |over| if over.has_forked() { outcome::FORKED } else { steps::ended_by(&over) })
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
    containment: *const Containment,
    run: Run,
    instance: *mut c_void,
    invocation: *const Invocation,
    result: u64,
}

unsafe extern "C" fn body(frame: *mut c_void) {
    // SAFETY: `call` passes its own frame, and answers for what is in it.
    unsafe {
        let frame = frame.cast::<Frame>();
        let step = (*(*frame).containment).step();
        step.write_volatile(0);
        let result = ((*frame).run)((*frame).instance, (*frame).invocation);
        step.write_volatile(OUTSIDE);
        (*frame).result = result;
    }
}

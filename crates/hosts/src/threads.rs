// SPDX-License-Identifier: Apache-2.0
//! The threads on which zenoh reads and writes.
use std::cell::Cell;
use std::sync::Once;

/// Environment variable from which zenoh reads its thread configuration, once per process.
const VARIABLE: &str = "ZENOH_RUNTIME";
/// Setting that makes reading, writing and accepting take turns on one thread. By default zenoh (1.10) reads and writes the same TLS
/// stream on two threads at once, which the stream does not allow, and which corrupted memory under load: eclipse-zenoh/zenoh, issue
/// 2557.
const ONE: &str = "(rx: (worker_threads: 1), tx: (handover: rx), acc: (handover: rx))";

/// Makes zenoh use one thread for its links in this process, unless the variable is already set. Must be called before the first zenoh
/// session is opened.
pub(crate) fn one_for_links() {
    static SAID: Once = Once::new();
    SAID.call_once(|| {
        if std::env::var_os(VARIABLE).is_none() {
            // SAFETY: the standard library has a lock against Rust code that reads the environment meanwhile. C code that reads it has
            // none; it would have to do so in the microsecond in which the first session of this process begins.
            unsafe { std::env::set_var(VARIABLE, ONE) };
        }
    });
}

thread_local! {
    /// True if the priority of this thread, on which packets arrive, has been raised.
    static HASTENED: Cell<bool> = const { Cell::new(false) };
}

/// Gives the thread on which packets arrive and leave precedence over those of ordinary programs, if permitted, because values wait for
/// it. It never gets a real-time priority, because network traffic could keep it running without limit. Called on that thread when a
/// packet has arrived.
pub(crate) fn hasten() {
    if !HASTENED.replace(true) {
        // SAFETY: sets how this thread is scheduled. A refusal is harmless.
        unsafe { libc::setpriority(libc::PRIO_PROCESS, libc::gettid().cast_unsigned(), NICE) };
    }
}

/// Nice value of that thread: one step below the maximum priority.
const NICE: i32 = -19;

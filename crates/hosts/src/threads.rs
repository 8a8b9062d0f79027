// SPDX-License-Identifier: Apache-2.0
//! The threads on which zenoh reads and writes.
use std::cell::Cell;
use std::sync::Once;

/// Environment variable in which zenoh looks up its threads, once per process.
const VARIABLE: &str = "ZENOH_RUNTIME";
/// Setting by which reading, writing and accepting take turns on one thread. By default zenoh (1.10) reads and writes the same TLS stream
/// on two threads at once, which the stream does not allow, and which damaged memory under load: eclipse-zenoh/zenoh, issue 2557.
const ONE: &str = "(rx: (worker_threads: 1), tx: (handover: rx), acc: (handover: rx))";

/// Makes zenoh use one thread for its links in this process, unless the variable is set already. Must precede its first session.
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
    /// True if this thread, on which a packet has arrived, has been hastened.
    static HASTENED: Cell<bool> = const { Cell::new(false) };
}

/// Schedules the thread on which packets arrive and leave ahead of those of ordinary programs, if permitted, because values wait for it.
/// It never gets a real-time priority: traffic from a network does not bound its run time. Called on that thread when a packet has
/// arrived.
pub(crate) fn hasten() {
    if !HASTENED.replace(true) {
        // SAFETY: sets how this thread is scheduled. A refusal is harmless.
        unsafe { libc::setpriority(libc::PRIO_PROCESS, libc::gettid().cast_unsigned(), NICE) };
    }
}

/// Niceness of that thread: one less urgent than the maximum.
const NICE: i32 = -19;

// SPDX-License-Identifier: Apache-2.0
//! The threads on which zenoh reads and writes.
use std::cell::Cell;
use std::sync::Once;

/// Where zenoh looks its threads up, once in a process.
const VARIABLE: &str = "ZENOH_RUNTIME";
/// Setting by which reading, writing and accepting take turns on one thread. Left to itself zenoh (1.10) reads and writes the same TLS stream on two
/// threads
/// at once, which the stream does not allow, and memory was damaged so under load: eclipse-zenoh/zenoh, issue 2557.
const ONE: &str = "(rx: (worker_threads: 1), tx: (handover: rx), acc: (handover: rx))";

/// Has zenoh use one thread for its links in this process, unless the variable says otherwise already. Before its first session.
pub(crate) fn one_for_links() {
    static SAID: Once = Once::new();
    SAID.call_once(|| {
        if std::env::var_os(VARIABLE).is_none() {
            // SAFETY: the standard library has a lock against Rust code that reads the environment meanwhile. C code that does has none; it
            // would have to be at it in the microsecond in which the first session of this process begins.
            unsafe { std::env::set_var(VARIABLE, ONE) };
        }
    });
}

thread_local! {
    /// True if this thread, on which a packet has come, was seen to.
    static HASTENED: Cell<bool> = const { Cell::new(false) };
}

/// Makes the thread on which packets come and go run before those of ordinary programs, if the right is given: values wait for it. Never at
/// a real-time priority: what a network sends is no measure of how long it runs. Called on it, when a packet has come.
pub(crate) fn hasten() {
    if !HASTENED.replace(true) {
        // SAFETY: how this thread is scheduled. What is not given is not needed.
        unsafe { libc::setpriority(libc::PRIO_PROCESS, libc::gettid().cast_unsigned(), NICE) };
    }
}

/// Niceness of that thread: just behind the most that can be asked for.
const NICE: i32 = -19;

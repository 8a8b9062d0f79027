// SPDX-License-Identifier: Apache-2.0
//! Privileges that the guard requests from the operating system, so that it outranks every kernel.
use scheduling::Children;

/// Highest priority. A source at 99 would delay the guard by at most one firing, because a thread of equal priority gets its turn when
/// the source sleeps.
const PRIORITY: u8 = 99;

/// Requests the privileges; returns those not granted, one line each.
pub(crate) fn take() -> Vec<String> {
    let mut missing = Vec::new();
    // SAFETY: these concern this process and thread alone: ends that are asked for are ignored (it ends by itself when nothing is
    // left to guard), and waits end when they should.
    unsafe {
        for signal in [libc::SIGTERM, libc::SIGINT, libc::SIGHUP, libc::SIGQUIT, libc::SIGPIPE] {
            libc::signal(signal, libc::SIG_IGN);
        }
        libc::prctl(libc::PR_SET_NAME, c"opengpac-guard".as_ptr());
    }
    if !scheduling::prioritise(PRIORITY, Children::Ordinary) {
        missing.push(format!("the guard runs without priority {PRIORITY}: no permission for real-time scheduling (set rtprio in limits.conf)"));
    }
    // SAFETY: the memory of this process itself.
    if !(process_kit::may_lock_all() && unsafe { libc::mlockall(libc::MCL_CURRENT | libc::MCL_FUTURE) } == 0) {
        missing.push("the guard's memory is not locked: no permission to lock all of it (set memlock in limits.conf to unlimited)".to_owned());
    }
    missing
}

// SPDX-License-Identifier: Apache-2.0
//! A real-time priority comes with the limit, and its inheritance as requested; a core that does not exist is refused.
use scheduling::{Children, pin, prioritise};

/// Returns the scheduling policy of the calling thread, without the flag of inheritance.
fn policy() -> i32 {
    // SAFETY: reads the policy of this thread.
    (unsafe { libc::sched_getscheduler(0) }) & !libc::SCHED_RESET_ON_FORK
}

/// Returns the processor time that a real-time thread of this process may use without sleeping, µs.
fn limit_us() -> u64 {
    let mut limit = libc::rlimit { rlim_cur: 0, rlim_max: 0 };
    // SAFETY: fills in a local struct.
    assert_eq!(unsafe { libc::getrlimit(libc::RLIMIT_RTTIME, &raw mut limit) }, 0);
    limit.rlim_cur
}

#[test]
fn a_priority_comes_with_a_limit_and_only_heirs_have_it_too() {
    for (children, inherited) in [(Children::Ordinary, libc::SCHED_OTHER), (Children::Inherit, libc::SCHED_FIFO)] {
        let (granted, own, child) = std::thread::spawn(move || {
            let granted = prioritise(1, children);
            (granted, policy(), std::thread::spawn(policy).join().unwrap())
        })
        .join()
        .unwrap();
        assert!(limit_us() <= 5_000_000);
        let expected = if granted { (libc::SCHED_FIFO, inherited) } else { (libc::SCHED_OTHER, libc::SCHED_OTHER) };
        assert_eq!((own, child), expected, "{children:?}");
    }
}

#[test]
fn a_priority_beyond_the_range_is_limited_to_it() {
    let priority = std::thread::spawn(|| {
        let granted = prioritise(200, Children::Ordinary);
        let mut parameter = libc::sched_param { sched_priority: 0 };
        // SAFETY: fills in a local struct.
        unsafe { libc::sched_getparam(0, &raw mut parameter) };
        (granted, parameter.sched_priority)
    });
    let (granted, priority) = priority.join().unwrap();
    assert_eq!(priority, if granted { 99 } else { 0 });
}

#[test]
fn a_core_that_does_not_exist_is_refused() {
    assert!(!pin(libc::CPU_SETSIZE as usize));
    assert!(!pin(libc::CPU_SETSIZE as usize - 1));
}

// SPDX-License-Identifier: Apache-2.0
//! What this process has: descriptors, threads, memory; how often its thread waited or allocated.
use std::ffi::CStr;
use std::time::{Duration, Instant};

pub(crate) fn descriptors() -> usize {
    std::fs::read_dir("/proc/self/fd").map_or(0, Iterator::count)
}

pub(crate) fn threads() -> usize {
    std::fs::read_dir("/proc/self/task").map_or(0, Iterator::count)
}

/// Waits until there are no more than before; how many there are then.
pub(crate) fn settled(count: fn() -> usize, before: usize) -> usize {
    let deadline = Instant::now() + Duration::from_secs(10);
    while count() > before && Instant::now() < deadline {
        std::thread::sleep(Duration::from_millis(5));
    }
    count()
}

/// Bytes that are allocated and not given back.
pub(crate) fn allocated() -> i64 {
    // SAFETY: it takes nothing and gives numbers.
    let info = unsafe { libc::mallinfo2() };
    i64::try_from(info.uordblks.saturating_add(info.hblkhd)).unwrap_or(i64::MAX)
}

/// Bytes of memory that this process has in use, as the system sees it.
pub(crate) fn resident() -> i64 {
    let text = std::fs::read_to_string("/proc/self/statm").unwrap_or_default();
    text.split_whitespace().nth(1).and_then(|pages| pages.parse::<i64>().ok()).map_or(0, |pages| pages * 4096)
}

/// How often this thread has given up its processor to wait for something.
pub(crate) fn waits() -> i64 {
    // SAFETY: a struct of numbers, which the call fills.
    let mut usage: libc::rusage = unsafe { std::mem::zeroed() };
    // SAFETY: it is told where the struct lies.
    unsafe { libc::getrusage(libc::RUSAGE_THREAD, &raw mut usage) };
    usage.ru_nvcsw
}

/// How often this thread has asked for memory, where the process was started with what counts that; none: it was not.
pub(crate) fn allocations() -> Option<u64> {
    type Counter = unsafe extern "C" fn() -> u64;
    // SAFETY: looks a name up.
    let found = unsafe { libc::dlsym(libc::RTLD_DEFAULT, c"opengpac_allocations".as_ptr()) };
    if found.is_null() {
        return None;
    }
    // SAFETY: the function of `counting.c`.
    Some(unsafe { std::mem::transmute::<*mut libc::c_void, Counter>(found)() })
}

/// The real-time sanitizer, where this process was started with it.
#[derive(Clone, Copy)]
pub(crate) struct Sanitizer {
    enter: unsafe extern "C" fn(),
    exit: unsafe extern "C" fn(),
}

impl Sanitizer {
    pub(crate) fn find() -> Option<Sanitizer> {
        let find = |name: &CStr| {
            // SAFETY: looks a name up.
            let found = unsafe { libc::dlsym(libc::RTLD_DEFAULT, name.as_ptr()) };
            // SAFETY: these functions of the sanitizer take nothing and give nothing.
            (!found.is_null()).then(|| unsafe { std::mem::transmute::<*mut libc::c_void, unsafe extern "C" fn()>(found) })
        };
        let begin = find(c"__rtsan_ensure_initialized")?;
        // SAFETY: as above.
        unsafe { begin() };
        Some(Sanitizer { enter: find(c"__rtsan_realtime_enter")?, exit: find(c"__rtsan_realtime_exit")? })
    }

    /// Ends the process where what is called makes a call that may block.
    pub(crate) fn watch<T>(self, call: impl FnOnce() -> T) -> T {
        // SAFETY: see `find`; both are called on this thread.
        unsafe { (self.enter)() };
        let made = call();
        // SAFETY: as above.
        unsafe { (self.exit)() };
        made
    }
}

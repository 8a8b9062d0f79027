// SPDX-License-Identifier: Apache-2.0
//! Measurements of this process: its descriptors, threads and memory, and the waits and allocations of its thread.
use std::ffi::CStr;
use std::fs::File;
use std::io::Write;
use std::os::fd::{AsFd, AsRawFd, FromRawFd, OwnedFd};
use std::time::{Duration, Instant};

pub(crate) fn descriptors() -> usize {
    std::fs::read_dir("/proc/self/fd").map_or(0, Iterator::count)
}

pub(crate) fn threads() -> usize {
    std::fs::read_dir("/proc/self/task").map_or(0, Iterator::count)
}

/// Returns the number of child processes that have not been reaped.
pub(crate) fn processes() -> usize {
    let us = std::process::id().to_string();
    // State and parent follow the name, which may contain any characters.
    let parent = |text: &str| text.rsplit_once(')').and_then(|(_, rest)| rest.split_whitespace().nth(1).map(str::to_owned));
    let is_ours = |entry: &std::fs::DirEntry| std::fs::read_to_string(entry.path().join("stat")).is_ok_and(|text| parent(&text).as_ref() == Some(&us));
    std::fs::read_dir("/proc").map_or(0, |all| all.flatten().filter(is_ours).count())
}

/// Waits until a count is no higher than before, for a limited time. Returns the count.
pub(crate) fn settled(count: fn() -> usize, before: usize) -> usize {
    let deadline = Instant::now() + Duration::from_secs(10);
    while count() > before && Instant::now() < deadline {
        std::thread::sleep(Duration::from_millis(5));
    }
    count()
}

/// Returns the number of allocated bytes that have not been freed.
pub(crate) fn allocated() -> i64 {
    // SAFETY: the call takes nothing and returns numbers.
    let info = unsafe { libc::mallinfo2() };
    i64::try_from(info.uordblks.saturating_add(info.hblkhd)).unwrap_or(i64::MAX)
}

/// Returns the resident memory of this process, in bytes.
pub(crate) fn resident() -> i64 {
    let text = std::fs::read_to_string("/proc/self/statm").unwrap_or_default();
    text.split_whitespace().nth(1).and_then(|pages| pages.parse::<i64>().ok()).map_or(0, |pages| pages * 4096)
}

/// Returns the CPU time used by this thread.
pub(crate) fn processor_ns() -> i64 {
    let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: the pointer is to a local struct of the expected type.
    unsafe { libc::clock_gettime(libc::CLOCK_THREAD_CPUTIME_ID, &raw mut time) };
    time.tv_sec * 1_000_000_000 + time.tv_nsec
}

/// Redirected standard output and standard error of this process, restored on drop.
struct DivertedOutput([OwnedFd; 2]);

impl DivertedOutput {
    fn to(file: &File) -> std::io::Result<DivertedOutput> {
        let kept = DivertedOutput([std::io::stdout().as_fd().try_clone_to_owned()?, std::io::stderr().as_fd().try_clone_to_owned()?]);
        flush();
        for name in [1, 2] {
            // SAFETY: both descriptors are open.
            unsafe { libc::dup2(file.as_raw_fd(), name) };
        }
        Ok(kept)
    }
}

impl Drop for DivertedOutput {
    fn drop(&mut self) {
        flush();
        for (kept, name) in self.0.iter().zip([1, 2]) {
            // SAFETY: both descriptors are open.
            unsafe { libc::dup2(kept.as_raw_fd(), name) };
        }
    }
}

/// Flushes the buffers of standard output, in C and in Rust.
fn flush() {
    // The output is counted, not read: output that cannot be written does not count.
    let _written = std::io::stdout().flush();
    // SAFETY: a null pointer means every stream.
    unsafe { libc::fflush(std::ptr::null_mut()) };
}

/// Makes a call and counts the bytes that this process writes to its standard output and standard error during the call. Returns the
/// result of the call and the count.
pub(crate) fn printed<T>(call: impl FnOnce() -> T) -> std::io::Result<(T, u64)> {
    // SAFETY: the arguments are a name and valid flags.
    let descriptor = unsafe { libc::memfd_create(c"printed".as_ptr(), libc::MFD_CLOEXEC) };
    if descriptor < 0 {
        return Err(std::io::Error::last_os_error());
    }
    // SAFETY: the descriptor was just made, and has no other owner.
    let file = File::from(unsafe { OwnedFd::from_raw_fd(descriptor) });
    let diverted = DivertedOutput::to(&file)?;
    let made = call();
    drop(diverted);
    Ok((made, file.metadata()?.len()))
}

/// Returns the number of times that this thread has blocked (voluntary context switches).
pub(crate) fn waits() -> i64 {
    // SAFETY: the struct contains only numbers, and the call fills it.
    let mut usage: libc::rusage = unsafe { std::mem::zeroed() };
    // SAFETY: the pointer is to a local struct of the expected type.
    unsafe { libc::getrusage(libc::RUSAGE_THREAD, &raw mut usage) };
    usage.ru_nvcsw
}

/// Returns the number of allocations by this thread; `None` if the process was not started with an allocation counter.
pub(crate) fn allocations() -> Option<u64> {
    type Counter = unsafe extern "C" fn() -> u64;
    // SAFETY: the call only looks up a name.
    let found = unsafe { libc::dlsym(libc::RTLD_DEFAULT, c"opengpac_allocations".as_ptr()) };
    if found.is_null() {
        return None;
    }
    // SAFETY: the symbol is the function of `counting.c`.
    Some(unsafe { std::mem::transmute::<*mut libc::c_void, Counter>(found)() })
}

/// The real-time sanitizer, if this process was started with it.
#[derive(Clone, Copy)]
pub(crate) struct Sanitizer {
    enter: unsafe extern "C" fn(),
    exit: unsafe extern "C" fn(),
}

impl Sanitizer {
    pub(crate) fn find() -> Option<Sanitizer> {
        let find = |name: &CStr| {
            // SAFETY: the call only looks up a name.
            let found = unsafe { libc::dlsym(libc::RTLD_DEFAULT, name.as_ptr()) };
            // SAFETY: these functions of the sanitizer have no arguments and no result.
            (!found.is_null()).then(|| unsafe { std::mem::transmute::<*mut libc::c_void, unsafe extern "C" fn()>(found) })
        };
        let begin = find(c"__rtsan_ensure_initialized")?;
        // SAFETY: as above.
        unsafe { begin() };
        Some(Sanitizer { enter: find(c"__rtsan_realtime_enter")?, exit: find(c"__rtsan_realtime_exit")? })
    }

    /// Calls the closure. The process is terminated if the closure makes a call that may block.
    pub(crate) fn watch<T>(self, call: impl FnOnce() -> T) -> T {
        // SAFETY: see `find`; both are called on this thread.
        unsafe { (self.enter)() };
        let made = call();
        // SAFETY: as above.
        unsafe { (self.exit)() };
        made
    }
}

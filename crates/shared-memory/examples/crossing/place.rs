// SPDX-License-Identifier: Apache-2.0
//! Cores, clocks, and bare shared memory.
use std::path::PathBuf;
use std::ptr::NonNull;
use std::sync::OnceLock;

pub const PRIORITY: u8 = 60;

/// Returns the core of the far side: the last core that this process may use at its start. The near side uses the core below it.
pub fn core() -> usize {
    static CORE: OnceLock<usize> = OnceLock::new();
    // SAFETY: fills in a local set.
    *CORE.get_or_init(|| unsafe {
        let mut cores: libc::cpu_set_t = std::mem::zeroed();
        libc::sched_getaffinity(0, size_of::<libc::cpu_set_t>(), &mut cores);
        (0..libc::CPU_SETSIZE as usize).rev().find(|core| libc::CPU_ISSET(*core, &cores)).unwrap_or(0)
    })
}

/// Pins this thread, and the threads that it starts, to a core, and gives them a real-time priority if permitted.
pub fn pin(core: usize) {
    scheduling::pin(core);
    scheduling::prioritise(PRIORITY, scheduling::Children::Inherit);
}

pub fn now_ns() -> i64 {
    let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: fills in a local struct.
    unsafe { libc::clock_gettime(libc::CLOCK_MONOTONIC, &mut time) };
    time.tv_sec * 1_000_000_000 + time.tv_nsec
}

/// Sleeps for a time.
pub fn rest(ns: i64) {
    let time = libc::timespec { tv_sec: 0, tv_nsec: ns };
    // SAFETY: reads a local struct.
    unsafe { libc::nanosleep(&time, std::ptr::null_mut()) };
}

/// Creates the folder of this measurement, which [`clear`] removes.
pub fn folder(run: u64) -> PathBuf {
    let folder = PathBuf::from(format!("/dev/shm/crossing-{run:x}"));
    std::fs::create_dir_all(&folder).expect("there is shared memory");
    folder
}

/// Returns the run of this process and of the processes that it starts.
pub fn run() -> u64 {
    static RUN: OnceLock<u64> = OnceLock::new();
    *RUN.get_or_init(shared_memory::new_run)
}

/// Returns the prefix of the files that iceoryx2 creates next to the folder.
pub fn prefix(run: u64) -> String {
    format!("crossing-{run:x}-")
}

/// Removes all files of this measurement.
pub fn clear() {
    std::fs::remove_dir_all(folder(run())).expect("it is ours");
    for entry in std::fs::read_dir("/dev/shm").expect("there is shared memory").flatten() {
        if entry.file_name().to_str().is_some_and(|name| name.starts_with(&prefix(run()))) {
            std::fs::remove_file(entry.path()).expect("it is ours");
        }
    }
}

/// Returns memory, initially zero, that is shared by every process that requests the same name and run, and stays mapped as long as the
/// process lives.
pub fn bare(name: &str, len: usize, run: u64) -> NonNull<u8> {
    let path = folder(run).join(name);
    let file = std::fs::OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path).expect("there is shared memory");
    file.set_len(len as u64).expect("there is room");
    let (access, flags) = (libc::PROT_READ | libc::PROT_WRITE, libc::MAP_SHARED | libc::MAP_POPULATE);
    // SAFETY: creates a new mapping at an address of the system's choice.
    let base = unsafe { libc::mmap(std::ptr::null_mut(), len, access, flags, std::os::fd::AsRawFd::as_raw_fd(&file), 0) };
    assert_ne!(base, libc::MAP_FAILED);
    NonNull::new(base.cast()).expect("nothing is mapped at address 0")
}

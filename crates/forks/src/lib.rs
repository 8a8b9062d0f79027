// SPDX-License-Identifier: Apache-2.0
//! Keeps the real-time system of a process out of processes that are forked from it.
//!
//! A fork copies the thread that calls it, with all memory and descriptors. Where that thread runs blocks or drives a device, the copy would
//! fire, command and publish beside the original. Four barriers stand against that:
//!
//! | barrier | where it acts |
//! |---|---|
//! | [`bind_thread`] | a child that a bound thread makes by `fork()` ends before `fork()` returns there |
//! | [`UnforkedMemory`], [`keep_from_children`] | memory that the child does not have: its first access ends it, however it was made |
//! | [`Device`] | a descriptor in whose place a child that is made by `fork()` finds `/dev/null` |
//! | [`end_if_child`] | one load of a word that the operating system sets to 0 in every child, before a device or another process is touched |
//!
//! Memory and the word hold for `clone` and `SYS_fork` as well, which call no handlers. None of the four sees `vfork()`, whose child shares all memory.
#[cfg(not(target_os = "linux"))]
compile_error!("children are told from their parents by MADV_WIPEONFORK, which Linux has");

mod device;
mod memory;

pub use device::Device;
pub use memory::{UnforkedMemory, keep_from_children};
use std::cell::Cell;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicPtr, AtomicU32, Ordering};

/// Status with which a forked child ends: EX_SOFTWARE.
pub const ENDED: i32 = 70;

type Handler = Option<unsafe extern "C" fn()>;

unsafe extern "C" {
    fn pthread_atfork(prepare: Handler, parent: Handler, child: Handler) -> libc::c_int;
}

/// Value of the word in the process that has claimed it.
const HERE: u32 = 1;

/// The word of a process that has claimed nothing: it is nobody's child.
static UNCLAIMED: AtomicU32 = AtomicU32::new(HERE);

static WORD: AtomicPtr<AtomicU32> = AtomicPtr::new((&raw const UNCLAIMED).cast_mut());

thread_local! {
    static IS_BOUND: Cell<bool> = const { Cell::new(false) };
}

/// Makes the calling process the one whose children are told apart. Idempotent; in a forked child, it makes the child a process of its own
/// right. Not for the real-time path.
pub fn claim_process() {
    static CLAIMED: OnceLock<()> = OnceLock::new();
    CLAIMED.get_or_init(|| {
        if let Some(page) = memory::wiped_page() {
            WORD.store(page, Ordering::Release);
        }
        // SAFETY: the handler calls nothing but what a child may call between fork and exec.
        unsafe { pthread_atfork(None, None, Some(in_the_child)) };
    });
    word().store(HERE, Ordering::Release);
}

/// The word that is 0 in every child of this process, for code in C. It stays for as long as the process.
pub fn word() -> &'static AtomicU32 {
    // SAFETY: the page is never unmapped, and the static lives as long as the program.
    unsafe { &*WORD.load(Ordering::Relaxed) }
}

/// Returns whether this process was forked from one that had claimed it.
#[inline]
pub fn is_child() -> bool {
    word().load(Ordering::Relaxed) != HERE
}

/// Ends this process at once if it was forked from one that had claimed it. Otherwise it costs one load of a word in the cache.
#[inline]
pub fn end_if_child() {
    if is_child() {
        end_child();
    }
}

#[cold]
fn end_child() -> ! {
    // SAFETY: ends this process alone; nothing of its parent is flushed or freed.
    unsafe { libc::_exit(ENDED) }
}

/// Binds the calling thread to its process: a child that it forks ends before it runs anything of ours. For threads that run blocks or
/// drivers.
pub fn bind_thread() {
    claim_process();
    IS_BOUND.set(true);
}

/// Runs in each child that was made by `fork()`, in its one thread.
unsafe extern "C" fn in_the_child() {
    if IS_BOUND.get() {
        end_child();
    }
    device::leave();
    // The operating system has done that already, unless it is older than Linux 4.14.
    word().store(0, Ordering::Relaxed);
}

// SPDX-License-Identifier: Apache-2.0
//! Keeps the real-time system of a process out of processes forked from it.
//!
//! A fork copies the calling thread, with all memory and descriptors. If that thread runs blocks or drives a device, the copy would fire,
//! command and publish in parallel with the original. Four barriers prevent this:
//!
//! | barrier | effect |
//! |---|---|
//! | [`bind_thread`] | a child that a bound thread creates by `fork()` exits before `fork()` returns in it |
//! | [`UnforkedMemory`], [`keep_from_children`] | memory that the child does not have: its first access ends it, however it was created |
//! | [`Device`] | a descriptor that is replaced with `/dev/null` in a child created by `fork()` |
//! | [`end_if_child`] | one load of a word that the operating system sets to 0 in every child, before a device or another process is accessed |
//!
//! The memory and the word also work for `clone` and `SYS_fork`, which call no handlers. None of the four detects `vfork()`, whose child
//! shares all memory.
#[cfg(not(target_os = "linux"))]
compile_error!("this crate tells children from their parents by MADV_WIPEONFORK, which only Linux has");

mod device;
mod memory;

pub use device::Device;
pub use memory::{UnforkedMemory, keep_from_children};
use std::cell::Cell;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicPtr, AtomicU32, Ordering};

/// Exit status of a forked child: EX_SOFTWARE.
pub const ENDED: i32 = 70;

type Handler = Option<unsafe extern "C" fn()>;

unsafe extern "C" {
    fn pthread_atfork(prepare: Handler, parent: Handler, child: Handler) -> libc::c_int;
}

/// Value of the word in the process that has claimed it.
const HERE: u32 = 1;

/// Word of a process that has not claimed itself, and so never counts as a child.
static UNCLAIMED: AtomicU32 = AtomicU32::new(HERE);

static WORD: AtomicPtr<AtomicU32> = AtomicPtr::new((&raw const UNCLAIMED).cast_mut());

thread_local! {
    static IS_BOUND: Cell<bool> = const { Cell::new(false) };
}

/// Marks the calling process as the original, so that its children can be recognised. Idempotent. In a forked child, makes the child
/// itself an original. Not for the real-time path.
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

/// Returns the word that is 0 in every child of this process, for C code. It is valid for the lifetime of the process.
pub fn word() -> &'static AtomicU32 {
    // SAFETY: the page is never unmapped, and the static lives as long as the program.
    unsafe { &*WORD.load(Ordering::Relaxed) }
}

/// Returns true if this process was forked from one that had claimed itself.
#[inline]
pub fn is_child() -> bool {
    word().load(Ordering::Relaxed) != HERE
}

/// Ends this process immediately if it was forked from one that had claimed itself. Otherwise costs only one load of a cached word.
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

/// Binds the calling thread to its process: a child that it forks exits before running any code of this program. For threads that run
/// blocks or drivers.
pub fn bind_thread() {
    claim_process();
    IS_BOUND.set(true);
}

/// Handler that runs in each child created by `fork()`, in its only thread.
unsafe extern "C" fn in_the_child() {
    if IS_BOUND.get() {
        end_child();
    }
    device::leave();
    // The operating system has done so already, unless it is older than Linux 4.14.
    word().store(0, Ordering::Relaxed);
}

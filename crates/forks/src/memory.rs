// SPDX-License-Identifier: Apache-2.0
//! Memory that forked children do not inherit, or inherit wiped.
use std::ffi::c_void;
use std::ptr::{self, NonNull};
use std::sync::atomic::AtomicU32;

/// Private memory, initially zero, that no forked child has.
#[derive(Debug)]
pub struct UnforkedMemory {
    start: NonNull<u8>,
    len: usize,
}

// SAFETY: a mapping, bound to no thread; who reaches into it answers for how.
unsafe impl Send for UnforkedMemory {}
// SAFETY: as for `Send`.
unsafe impl Sync for UnforkedMemory {}

impl UnforkedMemory {
    /// Maps at least `len` bytes, page-aligned. Returns `None` if the operating system has no memory left.
    pub fn new(len: usize) -> Option<UnforkedMemory> {
        let start = map(len)?;
        // SAFETY: the mapping was made just now.
        unsafe { keep_from_children(start.as_ptr(), len) };
        Some(UnforkedMemory { start, len })
    }

    /// Returns the address of the first byte.
    pub fn start(&self) -> *mut u8 {
        self.start.as_ptr()
    }
}

impl Drop for UnforkedMemory {
    fn drop(&mut self) {
        // SAFETY: the mapping is this value's own.
        unsafe { libc::munmap(self.start().cast::<c_void>(), self.len) };
    }
}

/// Keeps the pages of a mapping from children forked later: an access to them terminates the child with SIGSEGV.
///
/// # Safety
/// `start` must be the first byte of a mapping of `len` bytes that belongs to the caller.
pub unsafe fn keep_from_children(start: *mut u8, len: usize) {
    // SAFETY: the caller's word. Where it is refused, a child is still ended by its word before it touches anything.
    unsafe { libc::madvise(start.cast::<c_void>(), len, libc::MADV_DONTFORK) };
}

/// Maps a page whose first word the operating system sets to 0 in every child.
pub(crate) fn wiped_page() -> Option<*mut AtomicU32> {
    let start = map(size_of::<AtomicU32>())?;
    // SAFETY: the mapping was made just now. Where it is refused, only children of `fork()` are told apart, by a handler.
    unsafe { libc::madvise(start.as_ptr().cast::<c_void>(), size_of::<AtomicU32>(), libc::MADV_WIPEONFORK) };
    Some(start.as_ptr().cast::<AtomicU32>())
}

fn map(len: usize) -> Option<NonNull<u8>> {
    let (access, way) = (libc::PROT_READ | libc::PROT_WRITE, libc::MAP_PRIVATE | libc::MAP_ANONYMOUS);
    // SAFETY: a mapping at an address that the operating system chooses.
    let start = unsafe { libc::mmap(ptr::null_mut(), len, access, way, -1, 0) };
    if start == libc::MAP_FAILED { None } else { NonNull::new(start.cast::<u8>()) }
}

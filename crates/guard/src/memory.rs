// SPDX-License-Identifier: Apache-2.0
//! Memory that processes share: an unnamed file in memory, so that nothing is left behind when the last of them ends.
use std::io;
use std::os::fd::{AsFd, AsRawFd, BorrowedFd, FromRawFd, OwnedFd};
use std::sync::atomic::AtomicU64;

/// Shared memory, mapped. Its size is sealed: nobody can take pages away under another process.
#[derive(Debug)]
pub struct SharedMemory {
    descriptor: OwnedFd,
    start: *mut u8,
    len: usize,
}

// SAFETY: it is memory that other processes use too: whoever reaches into it must do so by atomics or by a rule of its own,
// wherever its thread runs. The mapping is not bound to a thread.
unsafe impl Send for SharedMemory {}
// SAFETY: as for `Send`.
unsafe impl Sync for SharedMemory {}

const SEALS: i32 = libc::F_SEAL_SHRINK | libc::F_SEAL_GROW | libc::F_SEAL_SEAL;

impl SharedMemory {
    /// New memory of `len` bytes, zero, every page of it present.
    ///
    /// # Errors
    /// What the operating system refuses: no memory, no descriptors left.
    pub fn new(len: usize) -> io::Result<SharedMemory> {
        // SAFETY: the name ends in NUL.
        let made = unsafe { libc::memfd_create(c"opengpac".as_ptr(), libc::MFD_CLOEXEC | libc::MFD_ALLOW_SEALING) };
        if made < 0 {
            return Err(io::Error::last_os_error());
        }
        // SAFETY: a descriptor that was made just now and that nobody else has.
        let descriptor = unsafe { OwnedFd::from_raw_fd(made) };
        let size = libc::off_t::try_from(len).map_err(|_| io::Error::from(io::ErrorKind::OutOfMemory))?;
        // SAFETY: calls on a descriptor of our own.
        if unsafe { libc::ftruncate(descriptor.as_raw_fd(), size) != 0 || libc::fcntl(descriptor.as_raw_fd(), libc::F_ADD_SEALS, SEALS) != 0 } {
            return Err(io::Error::last_os_error());
        }
        SharedMemory::map(descriptor, len)
    }

    /// Memory that another process made and sent.
    ///
    /// # Errors
    /// `InvalidData` for a descriptor that is no memory of this kind or not sealed, or holds less than `len_min` bytes.
    pub fn received(descriptor: OwnedFd, len_min: usize) -> io::Result<SharedMemory> {
        // SAFETY: asks about a descriptor of our own.
        let seals = unsafe { libc::fcntl(descriptor.as_raw_fd(), libc::F_GET_SEALS) };
        if seals < 0 || seals & libc::F_SEAL_SHRINK == 0 {
            return Err(io::Error::new(io::ErrorKind::InvalidData, "the descriptor is no sealed shared memory"));
        }
        // SAFETY: all zeroes is a valid value, which the call fills.
        let mut about: libc::stat = unsafe { std::mem::zeroed() };
        // SAFETY: writes into the value above.
        if unsafe { libc::fstat(descriptor.as_raw_fd(), &mut about) } != 0 {
            return Err(io::Error::last_os_error());
        }
        match usize::try_from(about.st_size) {
            Ok(len) if len >= len_min => SharedMemory::map(descriptor, len),
            _ => Err(io::Error::new(io::ErrorKind::InvalidData, format!("the shared memory has {} bytes instead of {len_min}", about.st_size))),
        }
    }

    fn map(descriptor: OwnedFd, len: usize) -> io::Result<SharedMemory> {
        let (access, way) = (libc::PROT_READ | libc::PROT_WRITE, libc::MAP_SHARED | libc::MAP_POPULATE);
        // SAFETY: a mapping at an address that the operating system chooses.
        let start = unsafe { libc::mmap(std::ptr::null_mut(), len, access, way, descriptor.as_raw_fd(), 0) };
        if start == libc::MAP_FAILED {
            return Err(io::Error::last_os_error());
        }
        Ok(SharedMemory { descriptor, start: start.cast(), len })
    }

    /// Where it starts in this process: on a page.
    pub fn start(&self) -> *mut u8 {
        self.start
    }

    /// Bytes.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether it has no bytes: never, for no mapping is empty.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// The word at `offset`, a multiple of 8 within it.
    pub fn word(&self, offset: usize) -> &AtomicU64 {
        assert!(offset.is_multiple_of(8) && offset + 8 <= self.len, "no word at {offset} of {} bytes", self.len);
        // SAFETY: within the mapping and aligned, as was just checked; it lives as long as `self`.
        unsafe { AtomicU64::from_ptr(self.start.add(offset).cast()) }
    }

    /// A second descriptor of the same memory, to send to another process.
    ///
    /// # Errors
    /// No descriptors left.
    pub fn descriptor(&self) -> io::Result<OwnedFd> {
        self.descriptor.try_clone()
    }
}

impl AsFd for SharedMemory {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.descriptor.as_fd()
    }
}

impl Drop for SharedMemory {
    fn drop(&mut self) {
        // SAFETY: the mapping is this value's own, and its borrows have ended.
        unsafe { libc::munmap(self.start.cast(), self.len) };
    }
}

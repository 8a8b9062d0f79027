// SPDX-License-Identifier: Apache-2.0
//! Memory shared by processes: an unnamed in-memory file whose size is sealed, so that no process can remove pages that another one uses,
//! and nothing remains after the last of them exits.
use std::io;
use std::os::fd::{AsFd, AsRawFd, BorrowedFd, FromRawFd, OwnedFd};
use std::ptr::NonNull;
use std::sync::atomic::AtomicU64;

/// Size of a cache line in bytes; data written by different ends are on different lines.
pub(crate) const LINE: usize = 64;

/// Shared memory, mapped here but not in forked children. Other processes may write to it at any time, so every word must be checked
/// before it is trusted.
#[derive(Debug)]
pub struct SealedMemory {
    descriptor: OwnedFd,
    start: NonNull<u8>,
    len: usize,
}

// SAFETY: it is memory that other processes use too: what reaches into it must do so by atomics or by a rule of its own,
// wherever its thread runs. The mapping is not bound to a thread.
unsafe impl Send for SealedMemory {}
// SAFETY: as for `Send`.
unsafe impl Sync for SealedMemory {}

/// Seals without which another process could kill this one, because an access beyond the end of a file raises SIGBUS.
const SEALS: i32 = libc::F_SEAL_SHRINK | libc::F_SEAL_GROW | libc::F_SEAL_SEAL;

impl SealedMemory {
    /// Creates `len` bytes of zeroed memory with every page present, so that no later access can fail for lack of memory.
    ///
    /// # Errors
    /// Fails if the operating system has no memory or no descriptors left.
    pub fn new(len: usize) -> io::Result<SealedMemory> {
        // SAFETY: the name ends in NUL.
        let made = unsafe { libc::memfd_create(c"opengpac".as_ptr(), libc::MFD_CLOEXEC | libc::MFD_ALLOW_SEALING) };
        if made < 0 {
            return Err(io::Error::last_os_error());
        }
        // SAFETY: a descriptor that was made just now and that nobody else has.
        let descriptor = unsafe { OwnedFd::from_raw_fd(made) };
        let size = libc::off_t::try_from(len).map_err(|_| io::Error::from(io::ErrorKind::OutOfMemory))?;
        // SAFETY: reserves room in a file of our own.
        match unsafe { libc::posix_fallocate(descriptor.as_raw_fd(), 0, size) } {
            0 => {}
            error => return Err(io::Error::from_raw_os_error(error)),
        }
        // SAFETY: a call on a descriptor of our own.
        if unsafe { libc::fcntl(descriptor.as_raw_fd(), libc::F_ADD_SEALS, SEALS) } != 0 {
            return Err(io::Error::last_os_error());
        }
        SealedMemory::map(descriptor, len)
    }

    /// Maps `len` bytes of memory that another process created.
    ///
    /// # Errors
    /// `InvalidData` if the descriptor is not memory of this kind, is not sealed, or has the wrong size.
    pub fn received(descriptor: OwnedFd, len: usize) -> io::Result<SealedMemory> {
        match sealed_len(descriptor.as_fd())? {
            there if there == len => SealedMemory::map(descriptor, len),
            there => Err(invalid(format!("the shared memory has {there} bytes instead of {len}"))),
        }
    }

    /// Maps the first `len` bytes of memory that another process created and that may be longer.
    ///
    /// # Errors
    /// Same as for [`received`](Self::received); also fails if the memory is shorter.
    pub(crate) fn beginning(descriptor: OwnedFd, len: usize) -> io::Result<SealedMemory> {
        match sealed_len(descriptor.as_fd())? {
            there if there >= len => SealedMemory::map(descriptor, len),
            there => Err(invalid(format!("the shared memory has {there} bytes instead of {len} or more"))),
        }
    }

    fn map(descriptor: OwnedFd, len: usize) -> io::Result<SealedMemory> {
        let (access, way) = (libc::PROT_READ | libc::PROT_WRITE, libc::MAP_SHARED | libc::MAP_POPULATE);
        // SAFETY: a mapping at an address that the operating system chooses.
        let start = unsafe { libc::mmap(std::ptr::null_mut(), len, access, way, descriptor.as_raw_fd(), 0) };
        if start == libc::MAP_FAILED {
            return Err(io::Error::last_os_error());
        }
        // SAFETY: the mapping was made just now.
        unsafe { forks::keep_from_children(start.cast(), len) };
        Ok(SealedMemory { descriptor, start: NonNull::new(start.cast()).expect("the operating system maps nothing at address 0"), len })
    }

    /// Returns the start address in this process, which is page-aligned.
    pub fn start(&self) -> *mut u8 {
        self.start.as_ptr()
    }

    /// Returns the length in bytes.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Returns true if the length is 0; always false, because mappings are not empty.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Returns the address of byte `offset`. Panics if it is out of bounds.
    pub(crate) fn at(&self, offset: usize) -> NonNull<u8> {
        assert!(offset < self.len, "byte {offset} of {}", self.len);
        // SAFETY: inside the mapping.
        unsafe { self.start.add(offset) }
    }

    /// Returns the word at `offset`, a multiple of 8 within the memory.
    pub fn word(&self, offset: usize) -> &AtomicU64 {
        assert!(offset.is_multiple_of(8) && offset + 8 <= self.len, "no word at {offset} of {} bytes", self.len);
        // SAFETY: within the mapping and aligned, as was just checked; it lives as long as `self`.
        unsafe { AtomicU64::from_ptr(self.start().add(offset).cast()) }
    }

    /// Returns a second descriptor of the same memory, to send to another process.
    ///
    /// # Errors
    /// Fails if no descriptors are left.
    pub fn descriptor(&self) -> io::Result<OwnedFd> {
        self.descriptor.try_clone()
    }
}

impl AsFd for SealedMemory {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.descriptor.as_fd()
    }
}

impl Drop for SealedMemory {
    fn drop(&mut self) {
        // SAFETY: the mapping is this value's own, and its borrows have ended.
        unsafe { libc::munmap(self.start().cast(), self.len) };
    }
}

/// Returns the size of a sealed memory in bytes, which never changes.
fn sealed_len(descriptor: BorrowedFd<'_>) -> io::Result<usize> {
    // SAFETY: asks about an open descriptor.
    let seals = unsafe { libc::fcntl(descriptor.as_raw_fd(), libc::F_GET_SEALS) };
    if seals < 0 || seals & SEALS != SEALS {
        return Err(invalid("the memory is not sealed: its owner could still shrink it".to_owned()));
    }
    // SAFETY: all zeroes is a valid value, which the call fills.
    let mut about: libc::stat = unsafe { std::mem::zeroed() };
    // SAFETY: writes into the value above.
    if unsafe { libc::fstat(descriptor.as_raw_fd(), &mut about) } != 0 {
        return Err(io::Error::last_os_error());
    }
    usize::try_from(about.st_size).map_err(|_| invalid(format!("the shared memory has {} bytes", about.st_size)))
}

fn invalid(message: String) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, message)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs::File;

    #[test]
    fn nobody_shrinks_it() {
        let memory = SealedMemory::new(100).expect("there is memory");
        let file = File::from(memory.descriptor().expect("a descriptor"));
        for len in [0, 99, 101] {
            assert!(file.set_len(len).is_err(), "{len} bytes");
        }
        // A hole consists of zeros: reading it gives a value that nobody wrote, but no fault.
        memory.word(0).store(7, std::sync::atomic::Ordering::Relaxed);
        assert_eq!(memory.word(0).load(std::sync::atomic::Ordering::Relaxed), 7);
    }

    #[test]
    fn what_is_not_sealed_or_of_another_size_is_refused() {
        let memory = SealedMemory::new(128).expect("there is memory");
        let received = |len| SealedMemory::received(memory.descriptor().expect("a descriptor"), len).map_err(|error| error.to_string());
        assert!(received(128).is_ok());
        assert_eq!(received(64).expect_err("less").as_str(), "the shared memory has 128 bytes instead of 64");
        assert_eq!(received(256).expect_err("more").as_str(), "the shared memory has 128 bytes instead of 256");
        // SAFETY: the name ends in NUL, and the descriptor that is made is nobody else's.
        let open = unsafe { OwnedFd::from_raw_fd(libc::memfd_create(c"open".as_ptr(), libc::MFD_CLOEXEC | libc::MFD_ALLOW_SEALING)) };
        let refused = SealedMemory::received(open, 0).expect_err("it is not sealed").to_string();
        assert_eq!(refused, "the memory is not sealed: its owner could still shrink it");
        let file = File::open("/proc/self/exe").expect("this program");
        assert!(SealedMemory::received(file.into(), 1).is_err());
    }
}

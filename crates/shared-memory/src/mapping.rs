// SPDX-License-Identifier: Apache-2.0
//! A file of the shared memory's file system, mapped: the memory that processes have in common.
use std::fs::File;
use std::io;
use std::os::fd::AsRawFd;
use std::ptr::NonNull;

/// Bytes of a cache line: what different ends write lies on different lines.
pub(crate) const LINE: usize = 64;

/// Mapped memory; it stays where it is, and stays readable when the file is removed or another process that mapped it is killed.
pub(crate) struct Mapping {
    base: NonNull<u8>,
    len: usize,
}

impl Mapping {
    /// Maps `file`, of which `len` bytes are made sure to exist (zeros where there was nothing), so that no access of it can fail later for
    /// want of memory. Every page is there when it returns, so the first access is no slower than the others.
    ///
    /// # Errors
    /// No room, mostly: `ENOSPC`.
    pub fn new(file: &File, len: usize) -> io::Result<Self> {
        let size = i64::try_from(len).map_err(|_| io::Error::from_raw_os_error(libc::EFBIG))?;
        // SAFETY: reserves room in an open file.
        match unsafe { libc::posix_fallocate(file.as_raw_fd(), 0, size) } {
            0 => {}
            error => return Err(io::Error::from_raw_os_error(error)),
        }
        let (access, flags) = (libc::PROT_READ | libc::PROT_WRITE, libc::MAP_SHARED | libc::MAP_POPULATE);
        // SAFETY: a new mapping at an address of the system's choice.
        let base = unsafe { libc::mmap(std::ptr::null_mut(), len, access, flags, file.as_raw_fd(), 0) };
        if base == libc::MAP_FAILED {
            return Err(io::Error::last_os_error());
        }
        Ok(Mapping { base: NonNull::new(base.cast()).expect("the system maps nothing at address 0"), len })
    }

    /// The address of byte `offset`. Panics where it is not inside.
    pub fn at(&self, offset: usize) -> NonNull<u8> {
        assert!(offset < self.len, "byte {offset} of {}", self.len);
        // SAFETY: inside the mapping.
        unsafe { self.base.add(offset) }
    }

    /// Makes all bytes zero. Only where nobody else uses them.
    pub fn clear(&self) {
        // SAFETY: the whole mapping, which the caller has for itself.
        unsafe { self.base.write_bytes(0, self.len) }
    }
}

impl Drop for Mapping {
    fn drop(&mut self) {
        // SAFETY: mapped by `new` with this length, and nobody has a reference into it that outlives it.
        unsafe { libc::munmap(self.base.as_ptr().cast(), self.len) };
    }
}

// SAFETY: an address and a length; what lies there is accessed under the rules of `layout`.
unsafe impl Send for Mapping {}
// SAFETY: as above.
unsafe impl Sync for Mapping {}

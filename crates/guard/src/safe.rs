// SPDX-License-Identifier: Apache-2.0
//! Writes that bring outputs to their safe state without their driver.
use device::SafeHandle;
use std::io;
use std::os::fd::{AsFd, AsRawFd, BorrowedFd};

/// Makes the outputs of a handle safe, as a guard does. Never blocks.
///
/// # Errors
/// `WouldBlock` if a buffer is full; otherwise the error of the write.
pub fn make_safe(handle: &SafeHandle) -> io::Result<()> {
    write(handle.descriptor.as_fd(), &handle.writes)
}

/// Writes each of `writes` at its offset, in order; ignores the offsets if the descriptor is not seekable.
pub(crate) fn write(descriptor: BorrowedFd<'_>, writes: &[(u64, Vec<u8>)]) -> io::Result<()> {
    writes.iter().try_for_each(|(offset, bytes)| write_at(descriptor, *offset, bytes))
}

/// Writes all of `bytes` at `offset`; ignores `offset` if the descriptor is not seekable.
fn write_at(descriptor: BorrowedFd<'_>, mut offset: u64, mut bytes: &[u8]) -> io::Result<()> {
    let number = descriptor.as_raw_fd();
    while !bytes.is_empty() {
        let mut poll = libc::pollfd { fd: number, events: libc::POLLOUT, revents: 0 };
        // SAFETY: one entry of our own; no time to wait.
        if unsafe { libc::poll(&mut poll, 1, 0) } == 0 {
            return Err(io::Error::new(io::ErrorKind::WouldBlock, "its buffer is full"));
        }
        let at = libc::off_t::try_from(offset).map_err(|_| io::Error::from(io::ErrorKind::InvalidInput))?;
        // SAFETY: writes bytes that are there.
        let mut written = unsafe { libc::pwrite(number, bytes.as_ptr().cast(), bytes.len(), at) };
        if written < 0 && io::Error::last_os_error().raw_os_error() == Some(libc::ESPIPE) {
            // SAFETY: as above.
            written = unsafe { libc::write(number, bytes.as_ptr().cast(), bytes.len()) };
        }
        match usize::try_from(written) {
            Ok(0) => return Err(io::Error::from(io::ErrorKind::WriteZero)),
            Ok(written) => {
                offset += written as u64;
                bytes = &bytes[written..];
            }
            Err(_) => match io::Error::last_os_error() {
                error if error.kind() == io::ErrorKind::Interrupted => {}
                error => return Err(error),
            },
        }
    }
    Ok(())
}

// SPDX-License-Identifier: Apache-2.0
//! Descriptors of devices, which forked children do not inherit.
//!
//! A child created by `fork()` has copies of all descriptors. While it lives, a serial line stays locked, a connection stays open for the
//! other side, and a bus has a second socket: the parent can neither close nor reopen its devices. The handler in the child replaces each
//! descriptor with `/dev/null`. It does not close them, because the child would then open its own files under the same numbers, which the
//! drivers in its memory could access.
use crate::claim_process;
use std::fs::File;
use std::io::{Read, Result, Write};
use std::ops::{Deref, DerefMut};
use std::os::fd::{AsFd, AsRawFd, BorrowedFd, IntoRawFd, RawFd};
use std::sync::atomic::{AtomicI32, Ordering};

/// Maximum number of descriptors that are kept from children; further descriptors stay open in them.
const DEVICES_MAX: usize = 1024;

/// Number of a child's descriptors that are checked; duplicates with higher numbers stay open.
const DESCRIPTORS_MAX: RawFd = 4096;

const FREE: i32 = -1;
/// Marks a slot whose owner has not written its descriptor yet.
const TAKEN: i32 = -2;

/// Slots for descriptors, read by the handler in the child, which must not take a lock. A slot belongs to the [`Device`] that has claimed
/// it.
static DEVICES: [AtomicI32; DEVICES_MAX] = [const { AtomicI32::new(FREE) }; DEVICES_MAX];

/// Descriptor of `/dev/null`, which replaces each device; [`FREE`] until the process has opened it.
static NULL: AtomicI32 = AtomicI32::new(FREE);

/// Descriptor of a device that is `/dev/null` in forked children.
#[derive(Debug)]
pub struct Device<T: AsRawFd> {
    inner: T,
    place: Option<usize>,
}

impl<T: AsRawFd> Device<T> {
    /// Keeps a descriptor out of children forked after this call. Not for the real-time path.
    pub fn new(inner: T) -> Device<T> {
        claim_process();
        open_null();
        let claim = |place: &AtomicI32| place.compare_exchange(FREE, TAKEN, Ordering::AcqRel, Ordering::Relaxed).is_ok();
        let place = DEVICES.iter().position(claim);
        if let Some(place) = place {
            DEVICES[place].store(inner.as_raw_fd(), Ordering::Release);
        }
        Device { inner, place }
    }
}

impl<T: AsRawFd> Drop for Device<T> {
    fn drop(&mut self) {
        // Before the descriptor is closed, because its number may be reused immediately.
        if let Some(place) = self.place {
            DEVICES[place].store(FREE, Ordering::Release);
        }
    }
}

impl<T: AsRawFd> Deref for Device<T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.inner
    }
}

impl<T: AsRawFd> DerefMut for Device<T> {
    fn deref_mut(&mut self) -> &mut T {
        &mut self.inner
    }
}

impl<T: AsRawFd> AsRawFd for Device<T> {
    fn as_raw_fd(&self) -> RawFd {
        self.inner.as_raw_fd()
    }
}

impl<T: AsRawFd + AsFd> AsFd for Device<T> {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.inner.as_fd()
    }
}

impl<T: AsRawFd + Read> Read for Device<T> {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize> {
        self.inner.read(buffer)
    }
}

impl<T: AsRawFd + Write> Write for Device<T> {
    fn write(&mut self, bytes: &[u8]) -> Result<usize> {
        self.inner.write(bytes)
    }

    fn flush(&mut self) -> Result<()> {
        self.inner.flush()
    }
}

fn open_null() {
    if NULL.load(Ordering::Relaxed) != FREE {
        return;
    }
    let Ok(null) = File::options().read(true).write(true).open("/dev/null") else { return };
    let null = null.into_raw_fd();
    if NULL.compare_exchange(FREE, null, Ordering::AcqRel, Ordering::Relaxed).is_err() {
        // SAFETY: another thread was faster, and nobody has this one.
        unsafe { libc::close(null) };
    }
}

/// Returns an identity that is shared by all descriptors of a file, and by no other file.
fn identity(descriptor: RawFd) -> Option<(libc::dev_t, libc::ino_t)> {
    // SAFETY: all zeros is a value of this struct of numbers, and the call writes one.
    unsafe {
        let mut about: libc::stat = std::mem::zeroed();
        (libc::fstat(descriptor, &raw mut about) == 0).then_some((about.st_dev, about.st_ino))
    }
}

/// Replaces each device, and each duplicate (such as a guard's), with `/dev/null`. Runs in the child, before `fork()` returns in it.
pub(crate) fn leave() {
    let null = NULL.load(Ordering::Acquire);
    // A child of a child finds it there already. It is not a device, and other descriptors of the process may refer to it.
    let blank = identity(null);
    let mut files = [(0, 0); DEVICES_MAX];
    let mut count = 0;
    for place in &DEVICES {
        let device = place.load(Ordering::Acquire);
        let file = if device >= 0 { identity(device) } else { None };
        if let Some(file) = file.filter(|_| file != blank) {
            files[count] = file;
            count += 1;
        }
    }
    let files = &files[..count];
    if files.is_empty() {
        return;
    }
    for descriptor in 0..DESCRIPTORS_MAX {
        if !identity(descriptor).is_some_and(|file| files.contains(&file)) {
            continue;
        }
        // SAFETY: the descriptor is a copy that this child alone has; both calls may be made between fork and exec.
        let is_replaced = null >= 0 && unsafe { libc::dup3(null, descriptor, libc::O_CLOEXEC) } >= 0;
        if !is_replaced {
            // SAFETY: as above.
            unsafe { libc::close(descriptor) };
        }
    }
}

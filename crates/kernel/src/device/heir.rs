// SPDX-License-Identifier: Apache-2.0
//! A device that one host runs and another one is about to take over, in one process.
//!
//! The heir has images of its own: it sees what the device read last, and what blocks store for it reaches nobody. When the host that
//! runs the device has ended, the heir's own source takes over driver and last outputs between two firings, and nothing was made safe
//! in between.
use super::{Channel, Device, DeviceError, Driver, SafeHandle, Unreached};
use interconnect::{Carrier, ConnectionSpec, Memory, Receiver};
use std::mem;
use std::sync::atomic::{AtomicI64, Ordering};
use std::sync::{Arc, Mutex};

/// What an heir sees of the device that it is to take over.
pub(crate) struct Looks {
    of: Arc<Device>,
    /// Empty while it goes back.
    view: Option<Box<dyn Receiver>>,
}

/// Where others can see what a device read last, and how long nobody wrote it while it was handed over.
pub(super) struct Seen {
    view: Mutex<Option<Box<dyn Receiver>>>,
    gap_ns: AtomicI64,
}

/// No gap is known.
const NO_GAP: i64 = -1;

impl Default for Seen {
    fn default() -> Seen {
        Seen { view: Mutex::default(), gap_ns: AtomicI64::new(NO_GAP) }
    }
}

impl Seen {
    /// The first write after a device was taken over.
    pub(super) fn written(&self, gap_ns: i64) {
        self.gap_ns.store(gap_ns, Ordering::Release);
    }
}

impl Looks {
    /// What the device read last.
    pub(super) fn read(&mut self, release_ns: i64, readings: &mut [u8]) -> Result<(), DeviceError> {
        if self.of.is_lost() {
            return Err(DeviceError { message: format!("device '{}' is lost where it runs", self.of.name) });
        }
        let view = self.view.as_mut().expect("it goes back when this is dropped");
        let _news = view.latch(release_ns);
        readings.copy_from_slice(&view.group()[..readings.len()]);
        Ok(())
    }
}

impl Drop for Looks {
    fn drop(&mut self) {
        *self.of.seen.view.lock().expect("nobody panics with the lock held") = self.view.take();
    }
}

impl Device {
    /// Opens it so that an heir can see what it reads: with each reading goes one copy of it. Errors: as of [`Device::open`].
    pub fn open_seen(name: &str, driver: Box<dyn Driver>, now_ns: i64) -> Result<Arc<Device>, DeviceError> {
        let mut device = Device::open(name, driver, now_ns)?;
        Arc::get_mut(&mut device).expect("nobody else has it yet").show();
        Ok(device)
    }

    fn show(&mut self) {
        let spec = ConnectionSpec { writer: 0, reader: 0, asynchronous_len: self.readings.len().max(1), queue_row_len: 0, queue_depth: 0 };
        let (sender, receiver) = Memory.connect(&spec);
        self.service.get_mut().shows = Some(sender);
        *self.seen.view.get_mut().expect("nobody panics with the lock held") = Some(receiver);
    }

    /// One that is to take over `of`: it reads what that reads, and writes nothing until [`Op::Inherit`](crate::Op::Inherit). Where it is dropped before
    /// that, nothing has been.
    ///
    /// # Errors
    /// In words: the device is not opened by [`Device::open_seen`], or has an heir already.
    pub fn heir(of: &Arc<Device>) -> Result<Arc<Device>, DeviceError> {
        let refuse = |why: &str| DeviceError { message: format!("device '{}' cannot be taken over: {why}", of.name) };
        let channels: Vec<Channel> = of.channels.clone();
        let mut device = Device::open(&of.name, Box::new(Unreached(channels)), 0)?;
        let view = of.seen.view.lock().expect("nobody panics with the lock held").take().ok_or_else(|| refuse("somebody else is about to do so"))?;
        let mut looks = Looks { of: of.clone(), view: Some(view) };
        let mut readings = vec![0; device.readings.len()];
        looks.read(0, &mut readings)?;
        device.readings.store(&readings);
        let copied = |handle: &SafeHandle| Ok(SafeHandle { descriptor: handle.descriptor.try_clone()?, writes: handle.writes.clone() });
        let handles: std::io::Result<Vec<SafeHandle>> = of.safe_handles().iter().map(copied).collect();
        let heir = Arc::get_mut(&mut device).expect("nobody else has it yet");
        heir.show();
        heir.safe_handles = Mutex::new(Arc::new(handles.map_err(|why| refuse(&why.to_string()))?));
        heir.service.get_mut().looks = Some(looks);
        Ok(device)
    }

    /// After it was taken over: from the release of the last write before to that of the first write after, ns. None as long as there was none.
    pub fn gap_ns(&self) -> Option<i64> {
        Some(self.seen.gap_ns.load(Ordering::Acquire)).filter(|gap| *gap != NO_GAP)
    }

    /// Takes over driver and last outputs of the device that it is heir of; nothing where it is none. `ahead_ns`: how much the clock of the
    /// host before was ahead of this one's. What it gives is to be freed elsewhere.
    ///
    /// # Safety
    /// Called by the kernel of its source alone, when the host of the device before has ended.
    pub(crate) unsafe fn inherit(&self, ahead_ns: i64) -> Option<Looks> {
        // SAFETY: the caller is the one that touches it.
        let service = unsafe { &mut *self.service.get() };
        let looks = service.looks.take()?;
        // SAFETY: its kernel has ended.
        let before = unsafe { &mut *looks.of.service.get() };
        mem::swap(&mut service.driver, &mut before.driver);
        mem::swap(&mut service.out, &mut before.out);
        service.ahead_ns = before.ahead_ns + ahead_ns;
        service.written_ns = before.written_ns.map(|written| written - ahead_ns);
        service.is_new = service.written_ns.is_some();
        Some(looks)
    }
}

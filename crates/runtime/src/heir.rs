// SPDX-License-Identifier: Apache-2.0
//! A device that is run by one host and about to be taken over by another one in the same process.
//!
//! The heir has its own images: it sees the latest readings of the device, and values that blocks store for it have no effect. When the
//! host that runs the device has ended, the heir's source takes over the driver and the last outputs between two firings, without an
//! intermediate safe state.
use crate::remote_device;
use device::{DeviceError, Driver, SafeHandle};
use interconnect::{Carrier, ConnectionSpec, Memory, Receiver};
use kernel::{Device, Service, View};
use std::mem;
use std::sync::Arc;

/// View that an heir has of the device it will take over.
struct Looks {
    of: Arc<Device>,
    /// View of the readings; `None` while it is being returned.
    view: Option<Box<dyn Receiver>>,
}

impl View for Looks {
    fn read(&mut self, release_ns: i64, readings: &mut [u8]) -> Result<(), DeviceError> {
        if self.of.is_lost() {
            return Err(DeviceError { message: format!("device '{}' was lost by its processor", self.of.name()) });
        }
        let view = self.view.as_mut().expect("it goes back when this is dropped");
        let _news = view.latch(release_ns);
        readings.copy_from_slice(&view.group()[..readings.len()]);
        Ok(())
    }

    unsafe fn give(&self, heir: &mut Service, ahead_ns: i64) {
        // SAFETY: its kernel has ended.
        let before = unsafe { self.of.service() };
        mem::swap(&mut heir.driver, &mut before.driver);
        mem::swap(&mut heir.out, &mut before.out);
        heir.ahead_ns = before.ahead_ns + ahead_ns;
        heir.written_ns = before.written_ns.map(|written| written - ahead_ns);
        heir.is_new = heir.written_ns.is_some();
    }
}

impl Drop for Looks {
    fn drop(&mut self) {
        *self.of.seen().view.lock().expect("nobody panics with the lock held") = self.view.take();
    }
}

/// Opens a device so that an heir can see its readings, at the cost of one copy per reading.
///
/// # Errors
/// Same as for [`Device::open`].
pub fn open_seen(name: &str, driver: Box<dyn Driver>, now_ns: i64) -> Result<Arc<Device>, DeviceError> {
    let mut device = Device::open(name, driver, now_ns)?;
    show(Arc::get_mut(&mut device).expect("nobody else has it yet"));
    Ok(device)
}

fn show(device: &mut Device) {
    let asynchronous_len = device.images().0.len().max(1);
    let (sender, receiver) = Memory.connect(&ConnectionSpec { writer: 0, reader: 0, asynchronous_len, queue_row_len: 0, queue_depth: 0 });
    device.service_mut().shows = Some(sender);
    *device.seen().view.lock().expect("nobody panics with the lock held") = Some(receiver);
}

/// Creates the heir of `of`: it sees the same readings, and writes nothing until [`Op::Inherit`](kernel::Op::Inherit). Dropping it before
/// that has no effect on `of`.
///
/// # Errors
/// Fails with a message if the device was not opened by [`open_seen`], or already has an heir.
pub fn heir(of: &Arc<Device>) -> Result<Arc<Device>, DeviceError> {
    let refuse = |why: &str| DeviceError { message: format!("device '{}' cannot be taken over: {why}", of.name()) };
    let mut device = remote_device::recorded(of.name(), of.channels().to_vec())?;
    let view = of.seen().view.lock().expect("nobody panics with the lock held").take().ok_or_else(|| refuse("another system is already taking it over"))?;
    let mut looks = Looks { of: of.clone(), view: Some(view) };
    let mut readings = vec![0; device.images().0.len()];
    looks.read(0, &mut readings)?;
    device.images().0.store(&readings);
    let copied = |handle: &SafeHandle| Ok(SafeHandle { descriptor: handle.descriptor.try_clone()?, writes: handle.writes.clone(), latches: handle.latches });
    let handles: std::io::Result<Vec<SafeHandle>> = of.safe_handles().iter().map(copied).collect();
    device.set_safe_handles(Arc::new(handles.map_err(|why| refuse(&why.to_string()))?));
    let heir = Arc::get_mut(&mut device).expect("nobody else has it yet");
    show(heir);
    heir.service_mut().looks = Some(Box::new(looks));
    Ok(device)
}

/// Makes `heir` take over the driver and the last outputs of its device; does nothing if it is not an heir. `ahead_ns`: lead of the
/// previous host's clock over this host's. The returned view must be freed off the real-time path.
///
/// # Safety
/// Must be called only by the kernel of the heir's source, after the host of the previous device has ended.
pub(crate) unsafe fn inherit(heir: &Device, ahead_ns: i64) -> Option<Box<dyn View>> {
    // SAFETY: the caller is the one that touches it.
    let service = unsafe { heir.service() };
    let looks = service.looks.take()?;
    // SAFETY: the caller's word.
    unsafe { looks.give(service, ahead_ns) };
    Some(looks)
}

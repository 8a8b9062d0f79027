// SPDX-License-Identifier: Apache-2.0
//! Reopening of a lost device: another driver replaces the failed one between two firings. Cells, claims and tables are kept.
//!
//! Many machines accept only one driver at a time, so this takes two steps: the old driver is handed out, and closed by the receiving
//! thread; then the new driver, opened in the meantime off the real-time path, is installed.
use crate::remote_device;
use device::Direction;
use kernel::{Device, Reopening};
use std::mem;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// One step of a renewal.
pub struct Renewal {
    device: Arc<Device>,
    /// Device whose driver replaces that of the lost device. `None` if a record is played back.
    by: Option<Arc<Device>>,
    /// True if the device is no longer lost.
    is_open: bool,
    is_done: Arc<AtomicBool>,
}

/// Previous driver of a device.
pub struct RetiredDriver {
    holder: Arc<Device>,
    is_done: Arc<AtomicBool>,
}

impl RetiredDriver {
    /// Closes the driver, off the real-time path; does nothing if the driver has not been handed out.
    pub fn close(self) {
        if self.is_done.load(Ordering::Acquire) {
            // SAFETY: no kernel has the holder in a table, and the one that put the driver there is through with it.
            unsafe { self.holder.close() }
        }
    }
}

impl Renewal {
    /// Retires the driver of a lost device; its replacement is installed later.
    pub fn retire(device: &Arc<Device>) -> (Renewal, RetiredDriver) {
        let empty = remote_device::recorded(device.name(), device.channels().to_vec()).expect("a driver that does nothing opens");
        let is_done = Arc::<AtomicBool>::default();
        let retired = RetiredDriver { holder: empty.clone(), is_done: is_done.clone() };
        (Renewal { device: device.clone(), by: Some(empty), is_open: false, is_done }, retired)
    }

    /// Installs the driver of `fresh`, which must have no other user, in the device.
    ///
    /// # Errors
    /// Fails with a message if its channels differ.
    pub fn open(device: &Arc<Device>, fresh: Arc<Device>) -> Result<Renewal, String> {
        let face = |of: &Device| of.channels().iter().map(|c| (c.name.clone(), c.direction, c.type_text.clone(), c.offset, c.len)).collect::<Vec<_>>();
        if face(device) != face(&fresh) {
            return Err(format!("its driver now has different channels than those with which device '{}' was opened", device.name()));
        }
        device.set_safe_handles(fresh.safe_handles());
        Ok(Renewal { device: device.clone(), by: Some(fresh), is_open: true, is_done: Arc::default() })
    }

    /// Creates the renewal of a device of a record that is played back; its readings come from the record.
    pub fn recorded(device: Arc<Device>, is_open: bool) -> Renewal {
        Renewal { device, by: None, is_open, is_done: Arc::default() }
    }

    /// Returns the flag that is set once the renewal has been carried out.
    pub fn is_done(&self) -> Arc<AtomicBool> {
        self.is_done.clone()
    }

    /// Carries out the renewal of a device that does not belong to any source.
    ///
    /// # Safety
    /// No kernel may have the device in its table.
    pub unsafe fn alone(&self) {
        // SAFETY: the caller's word.
        unsafe { self.carry_out() }
    }
}

impl Reopening for Renewal {
    fn device(&self) -> &Arc<Device> {
        &self.device
    }

    fn is_open(&self) -> bool {
        self.is_open
    }

    unsafe fn carry_out(&self) {
        let device = &*self.device;
        // SAFETY: the caller is the one that touches it.
        let service = unsafe { device.service() };
        if let Some(by) = &self.by {
            // SAFETY: no kernel has it in a table, and the maker of this waits for the end of it.
            let other = unsafe { by.service() };
            mem::swap(&mut service.driver, &mut other.driver);
            mem::swap(&mut service.ahead_ns, &mut other.ahead_ns);
            mem::swap(&mut service.is_closed, &mut other.is_closed);
        }
        (service.written_ns, service.is_new) = (None, false);
        for channel in device.channels().iter().filter(|channel| channel.direction == Direction::Write) {
            service.out[channel.offset..channel.offset + channel.len].copy_from_slice(&channel.safe);
        }
        if self.is_open {
            device.standing().found();
        }
        self.is_done.store(true, Ordering::Release);
    }
}

// SPDX-License-Identifier: Apache-2.0
//! Guarding of devices on processors that are threads of this process.
use crate::system::System;
use kernel::Device;

impl System {
    /// Passes the guard the handles that make a device safe, if the device was opened on a processor that is a thread of this process. If
    /// this fails, the failure is logged and the device operates without the guard.
    pub(crate) fn guard_device(&self, processor: &str, device: &Device) {
        let handles = device.safe_handles();
        if handles.is_empty() || self.shared.is_virtual {
            return;
        }
        let held = match self.shared.places.get() {
            Some(places) => self.shared.guarded.hold(&**places, &self.shared.host, processor, device.name(), &handles),
            None => Err("this system has no way to start processes".to_owned()),
        };
        if let Err(why) = held {
            let mut core = self.shared.locked();
            let now_ns = core.host.now_ns();
            core.observation.log.add(now_ns, "guard", device.name(), format!("device '{}' is not guarded: {why}", device.name()));
        }
    }
}

// SPDX-License-Identifier: Apache-2.0
//! A timer that could not fire for long, with everybody who watches it: the whole process tree was paused, or the machine. Its outputs kept
//! their last values meanwhile, and nobody knows what has become of the world.
use crate::state::Kernel;
use device::DeviceError;

/// So many periods a slow timer may miss, whatever the bound.
const PERIODS_MAX: i64 = 10;

impl Kernel {
    /// Looks at a timer that fires `late_ns` after its release. Where that is beyond the bound, each device of it that is commanded goes to its safe state
    /// and is lost, as if the guard had seen it: its verbs end, and a person opens it again.
    #[cold]
    pub fn look_for_standstill(&mut self, late_ns: i64, period_ns: i64, now_ns: i64) {
        if late_ns <= self.shared.standstill_ns().max(period_ns.saturating_mul(PERIODS_MAX)) {
            return;
        }
        for index in 0..self.table.devices.len() {
            let device = &self.table.devices[index];
            if device.is_lost() || !device.is_commanded() {
                continue;
            }
            // What the device itself says of the time says more.
            // SAFETY: this is the kernel of the device's source.
            let own = unsafe { device.read(now_ns, None) };
            // SAFETY: as above.
            unsafe { device.lose() };
            let message = format!(
                "its source '{}' stood still for {:.1} s (its process was stopped, or the machine), while its outputs kept their values; they are safe now",
                self.source.spec.name,
                late_ns as f64 * 1e-9
            );
            self.device_lost(index, own.err().unwrap_or(DeviceError { message }), now_ns);
        }
    }
}

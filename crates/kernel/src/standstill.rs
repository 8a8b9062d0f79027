// SPDX-License-Identifier: Apache-2.0
//! A source that could not fire for long, with everybody who watches it: the whole process tree was paused, or the machine. Its outputs kept
//! their last values meanwhile, and nobody knows what has become of the world.
use crate::event::Event;
use crate::state::Kernel;
use device::DeviceError;

/// So many periods a slow timer may miss, whatever the bound.
const PERIODS_MAX: i64 = 10;
/// A shorter standstill is not told: a machine may be held up for so long, and the guard does not judge by less.
const TOLD_NS: i64 = 500_000_000;

impl Kernel {
    /// Looks at a source that runs `late_ns` after it should have. Where that is beyond the bound, each device of it that is commanded goes to its safe
    /// state and is lost, as if the guard had seen it: its verbs end, and a person opens it again. The supervisor is told of every long standstill.
    #[cold]
    pub fn look_for_standstill(&mut self, late_ns: i64, period_ns: i64, now_ns: i64) {
        let periods_ns = period_ns.saturating_mul(PERIODS_MAX);
        let bound_ns = self.shared.standstill_ns().max(periods_ns);
        if late_ns <= bound_ns.min(TOLD_NS.max(periods_ns)) {
            return;
        }
        let is_unattended = late_ns > bound_ns;
        if is_unattended {
            self.lose_commanded(late_ns, now_ns);
        }
        self.tell(Event::StoodStill { source: self.source.id, late_ns, is_unattended, time_ns: now_ns }, &[], &[]);
    }

    fn lose_commanded(&mut self, late_ns: i64, now_ns: i64) {
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

    /// Returns true if somebody has to attend to a device of this source that is commanded.
    pub fn commands_devices(&self) -> bool {
        self.table.devices.iter().any(|device| !device.is_lost() && device.is_commanded())
    }
}

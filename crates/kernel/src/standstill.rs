// SPDX-License-Identifier: Apache-2.0
//! Suspension: a source could not fire for a long time, and nothing that monitors it could run, because the whole process tree or the
//! machine was paused. Its outputs kept their last values, and the state of the plant is unknown.
use crate::event::Event;
use crate::state::Kernel;
use device::DeviceError;

/// Number of periods that a slow timer may miss, regardless of the maximum suspension.
const PERIODS_MAX: i64 = 10;
/// Minimum length of a suspension that is reported. Shorter delays occur without a fault, and the guard does not react to them.
const TOLD_NS: i64 = 500_000_000;

impl Kernel {
    /// Checks for a suspension of a source that runs `late_ns` late. If it exceeds the maximum, brings each commanded device to its safe
    /// state and marks it lost, as the guard would have done: its verbs end, and a person must reopen it. Reports every long suspension
    /// to the supervisor.
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
            // The time that the device itself reports is more accurate. SAFETY: this is the kernel of the device's source.
            let own = unsafe { device.read(now_ns, None) };
            // SAFETY: as above.
            unsafe { device.lose() };
            let message = format!(
                "its source '{}' was suspended for {:.1} s (its process or the machine was stopped), during which its outputs kept their values; they are in their safe states now",
                self.source.spec.name,
                late_ns as f64 * 1e-9
            );
            self.device_lost(index, own.err().unwrap_or(DeviceError { message }), now_ns);
        }
    }

    /// Returns true if a device of this source is commanded and must not be left unattended.
    pub fn commands_devices(&self) -> bool {
        self.table.devices.iter().any(|device| !device.is_lost() && device.is_commanded())
    }
}

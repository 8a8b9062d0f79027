// SPDX-License-Identifier: Apache-2.0
//! Time charged to a loop: the time for which its thread ran or slept, but not the time for which it only waited for a core.

/// Maximum sleep time charged between two checks, ns: the thread may have been asleep only for the instant of the check.
const SLEEP_MAX_NS: i64 = 20_000_000;

/// Time charged to one loop since it was first checked.
#[derive(Debug, Default)]
pub(crate) struct Charge {
    /// Time at which the loop was started, which identifies it.
    started_ns: i64,
    looked_ns: i64,
    /// CPU time of the thread at the last check.
    run_ns: i64,
    charged_ns: i64,
}

impl Charge {
    /// Adds the time since the last check of the same loop, and returns the sum. `waits` returns true if the thread is waiting for a
    /// core.
    pub(crate) fn add(&mut self, started_ns: i64, now_ns: i64, run_ns: i64, waits: impl FnOnce() -> bool) -> i64 {
        if self.started_ns != started_ns {
            *self = Charge { started_ns, looked_ns: now_ns, run_ns, charged_ns: 0 };
            return 0;
        }
        let ran_ns = run_ns - self.run_ns;
        let idle_ns = (now_ns - self.looked_ns - ran_ns).clamp(0, SLEEP_MAX_NS);
        self.charged_ns += ran_ns + if waits() { 0 } else { idle_ns };
        (self.looked_ns, self.run_ns) = (now_ns, run_ns);
        self.charged_ns
    }

    /// Records that the loop that started at `started_ns` is treated as if it had started `late_ns` later.
    pub(crate) fn forgive(&mut self, started_ns: i64, late_ns: i64) {
        if self.started_ns == started_ns {
            self.started_ns += late_ns;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: i64 = 1_000_000;

    /// Returns the charge after checks 10 ms apart. Each entry contains the CPU time used since the previous check, ms, and whether the
    /// thread is waiting for a core.
    fn charged(looks: &[(i64, bool)]) -> i64 {
        let (mut charge, mut now_ns, mut run_ns) = (Charge::default(), 1_000 * MS, 77 * MS);
        assert_eq!(charge.add(5, now_ns, run_ns, || true), 0);
        looks.iter().fold(0, |_, (ran_ms, waits)| {
            (now_ns, run_ns) = (now_ns + 10 * MS, run_ns + ran_ms * MS);
            charge.add(5, now_ns, run_ns, || *waits) / MS
        })
    }

    #[test]
    fn a_loop_is_charged_for_running_and_sleeping_and_not_for_waiting() {
        assert_eq!(charged(&[(10, true), (10, false)]), 20, "it runs");
        assert_eq!(charged(&[(0, false); 5]), 50, "it sleeps");
        assert_eq!(charged(&[(0, true), (1, true), (0, true)]), 1, "it has no core");
        assert_eq!(charged(&[(4, true), (4, false)]), 14);
    }

    #[test]
    fn a_late_look_charges_no_long_sleep() {
        let mut charge = Charge::default();
        charge.add(5, 0, 0, || false);
        assert_eq!(charge.add(5, 900 * MS, 0, || false), SLEEP_MAX_NS);
        assert_eq!(charge.add(5, 1_800 * MS, 900 * MS, || false), SLEEP_MAX_NS + 900 * MS, "it ran");
    }

    #[test]
    fn another_loop_begins_at_nothing_and_a_forgiven_one_keeps_its_charge() {
        let mut charge = Charge::default();
        charge.add(5, 0, 0, || true);
        assert_eq!(charge.add(5, 10 * MS, 10 * MS, || true), 10 * MS);
        charge.forgive(4, 3);
        charge.forgive(5, 3);
        assert_eq!(charge.add(8, 20 * MS, 20 * MS, || true), 20 * MS);
        assert_eq!(charge.add(9, 30 * MS, 30 * MS, || true), 0);
    }
}

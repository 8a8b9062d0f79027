// SPDX-License-Identifier: Apache-2.0
//! The distributed clock of an emulated subdevice: a local time that drifts, the system time derived from it, and SYNC0.
//!
//! A main device writes the time of the reference clock; the clock compares it with its own time and runs faster or slower, by a
//! proportional and an integral part. The clock itself chooses the rate of this correction, as in real subdevices.

/// Time constant with which a difference is corrected (the proportional part), in comparisons.
const GAIN: f64 = 200.0;
/// Time constant with which the drift is learned (the integral part), in comparisons.
const LEARNING: f64 = 400.0;
/// Maximum change of the clock's rate.
const PUSH_MAX: f64 = 1e-3;
/// Number of comparisons over which the displayed difference is averaged.
const SHOWN: f64 = 8.0;

#[derive(Clone, Debug)]
pub struct Clock {
    local_ns: f64,
    /// True time to which the clock has advanced.
    now_ns: u64,
    /// Drift of the oscillator, as a fraction of its rate.
    drift: f64,
    learned: f64,
    push: f64,
    push_until_ns: u64,
    compared_ns: u64,
    difference_ns: f64,
    sync: Option<Sync>,
}

/// SYNC0: the system time of the next event, and the period.
#[derive(Clone, Copy, Debug)]
struct Sync {
    next_ns: u64,
    cycle_ns: u64,
}

impl Clock {
    /// Creates a clock that is `ahead_ns` ahead of true time and runs too fast by `drift_ppm` parts per million.
    pub fn new(ahead_ns: u64, drift_ppm: f64) -> Clock {
        Clock {
            local_ns: ahead_ns as f64,
            now_ns: 0,
            drift: drift_ppm * 1e-6,
            learned: 0.0,
            push: 0.0,
            push_until_ns: 0,
            compared_ns: 0,
            difference_ns: 0.0,
            sync: None,
        }
    }

    /// Advances to a true time.
    pub fn go_on(&mut self, now_ns: u64) {
        let span_ns = now_ns.saturating_sub(self.now_ns) as f64;
        let pushed_ns = self.push_until_ns.min(now_ns).saturating_sub(self.now_ns) as f64;
        self.local_ns += span_ns * (1.0 + self.drift + self.learned) + pushed_ns * self.push;
        self.now_ns = self.now_ns.max(now_ns);
    }

    pub fn local_ns(&self) -> u64 {
        self.local_ns as u64
    }

    /// Handles a comparison of the clock's time with that of the reference clock, and corrects the clock towards the reference clock. The
    /// difference is in ns.
    pub fn compare(&mut self, difference_ns: i32) {
        let span_ns = self.now_ns.saturating_sub(self.compared_ns).max(1_000);
        let is_first = self.compared_ns == 0;
        self.compared_ns = self.now_ns;
        let difference = f64::from(difference_ns);
        self.difference_ns += (difference - self.difference_ns) / if is_first { 1.0 } else { SHOWN };
        if is_first {
            return;
        }
        let wanted = -difference / (GAIN * span_ns as f64);
        self.push = wanted.clamp(-PUSH_MAX, PUSH_MAX);
        self.push_until_ns = self.now_ns + span_ns;
        if self.push == wanted {
            self.learned = (self.learned + self.push / LEARNING).clamp(-PUSH_MAX, PUSH_MAX);
        }
    }

    /// Returns the value of the difference register: sign and magnitude.
    pub fn difference(&self) -> u32 {
        let magnitude = self.difference_ns.abs().round() as u32 & 0x7FFF_FFFF;
        magnitude | u32::from(self.difference_ns < 0.0) << 31
    }

    /// Starts or stops SYNC0. A start time in the past never takes effect.
    pub fn set_sync(&mut self, start: Option<(u64, u32)>, system_ns: u64) {
        let usable = start.filter(|(next_ns, cycle_ns)| *next_ns > system_ns && *cycle_ns > 0);
        self.sync = usable.map(|(next_ns, cycle_ns)| Sync { next_ns, cycle_ns: cycle_ns.into() });
    }

    /// Returns the number of SYNC0 events since the last call.
    pub fn synced(&mut self, system_ns: u64) -> u64 {
        let Some(sync) = &mut self.sync else { return 0 };
        if system_ns < sync.next_ns {
            return 0;
        }
        let count = ((system_ns - sync.next_ns) / sync.cycle_ns).saturating_add(1);
        sync.next_ns = sync.next_ns.saturating_add(count.saturating_mul(sync.cycle_ns));
        count
    }

    /// Returns the system time of the next SYNC0.
    pub fn next_sync_ns(&self) -> Option<u64> {
        self.sync.map(|sync| sync.next_ns)
    }
}

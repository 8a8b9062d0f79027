// SPDX-License-Identifier: Apache-2.0
//! The distributed clock of an emulated subdevice: a local time that drifts, the time of all that is made of it, and SYNC0.
//!
//! A main device writes the time of the reference clock; the clock compares it with its own and goes faster or slower, by a proportional and
//! an integral part. How quickly it does that is its own affair, as it is with real ones.

/// So many comparisons take away most of a difference, and so many more learn the drift.
const GAIN: f64 = 200.0;
const LEARNING: f64 = 400.0;
/// The most by which it goes faster or slower.
const PUSH_MAX: f64 = 1e-3;
/// Number of comparisons of which its shown difference is the mean.
const SHOWN: f64 = 8.0;

#[derive(Clone, Debug)]
pub struct Clock {
    local_ns: f64,
    /// True time, as far as it has gone on.
    now_ns: u64,
    /// Drift of its quartz, as a part of 1.
    drift: f64,
    learned: f64,
    push: f64,
    push_until_ns: u64,
    compared_ns: u64,
    difference_ns: f64,
    sync: Option<Sync>,
}

/// SYNC0: the time of all at which the next one comes, and how often.
#[derive(Clone, Copy, Debug)]
struct Sync {
    next_ns: u64,
    cycle_ns: u64,
}

impl Clock {
    /// Makes a clock that is ahead of the true time, and too fast by that many millionths.
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

    /// Goes on to a true time.
    pub fn go_on(&mut self, now_ns: u64) {
        let span_ns = now_ns.saturating_sub(self.now_ns) as f64;
        let pushed_ns = self.push_until_ns.min(now_ns).saturating_sub(self.now_ns) as f64;
        self.local_ns += span_ns * (1.0 + self.drift + self.learned) + pushed_ns * self.push;
        self.now_ns = self.now_ns.max(now_ns);
    }

    pub fn local_ns(&self) -> u64 {
        self.local_ns as u64
    }

    /// Its own time against that of the reference clock, which it is pushed towards; ns.
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

    /// Returns the register of its difference: sign and magnitude.
    pub fn difference(&self) -> u32 {
        let magnitude = self.difference_ns.abs().round() as u32 & 0x7FFF_FFFF;
        magnitude | u32::from(self.difference_ns < 0.0) << 31
    }

    /// Begins SYNC0, or ends it. One that is to begin in the past never comes.
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

    /// Returns when SYNC0 comes next, in the time of all.
    pub fn next_sync_ns(&self) -> Option<u64> {
        self.sync.map(|sync| sync.next_ns)
    }
}

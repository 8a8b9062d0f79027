// SPDX-License-Identifier: Apache-2.0
//! Function blocks in Rust: blocks that are measured in the rows, and blocks that record times.
use opengpac::{Condition, FunctionBlock, Invocation, Outcome, Step};
use std::sync::atomic::{AtomicI64, AtomicU64, Ordering};

/// CLOCK_MONOTONIC.
pub fn now_ns() -> i64 {
    let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: fills in a local struct.
    unsafe { libc::clock_gettime(libc::CLOCK_MONOTONIC, &mut time) };
    time.tv_sec * 1_000_000_000 + time.tv_nsec
}

/// Gain: y = k u.
#[derive(FunctionBlock)]
pub struct Gain {
    /// input
    #[input]
    u: f64,
    /// k times the input
    #[output]
    y: f64,
    /// gain
    #[param(default = 1.0)]
    k: f64,
}

impl Step for Gain {
    fn step(&mut self, _: &Invocation) -> Outcome {
        self.y = self.k * self.u;
        Outcome::Done
    }
}

/// PID: y = kp e + sum of ki e + kd times the change of e, with e = setpoint - u.
#[derive(FunctionBlock)]
pub struct Pid {
    /// current position
    #[input]
    u: f64,
    /// effort
    #[output]
    y: f64,
    /// desired position
    #[param(default = 0.5)]
    setpoint: f64,
    /// proportional gain
    #[param(default = 0.7)]
    kp: f64,
    /// integral gain per invocation
    #[param(default = 0.01)]
    ki: f64,
    /// derivative gain, in invocations
    #[param(default = 0.1)]
    kd: f64,
    /// maximum effort in either direction
    #[param(default = 10.0)]
    limit: f64,
    /// sum of ki e
    #[state]
    integral: f64,
    /// e of the previous invocation
    #[state]
    before: f64,
}

fn clamp(x: f64, limit: f64) -> f64 {
    let low = if x < limit { x } else { limit };
    if low > -limit { low } else { -limit }
}

impl Step for Pid {
    fn step(&mut self, _: &Invocation) -> Outcome {
        let error = self.setpoint - self.u;
        self.integral = clamp(self.integral + self.ki * error, self.limit);
        self.y = clamp(self.kp * error + self.integral + self.kd * (error - self.before), self.limit);
        self.before = error;
        Outcome::Done
    }
}

/// Number of invocations of the stopwatch that remain in this burst. The two statics that follow contain the times of its first and last
/// invocations.
pub static LEFT: AtomicU64 = AtomicU64::new(0);
pub static FIRST_NS: AtomicI64 = AtomicI64::new(0);
pub static LAST_NS: AtomicI64 = AtomicI64::new(0);

/// Records the times of its first and last invocations in a burst; the last step of a table.
#[derive(FunctionBlock)]
pub struct Stopwatch {
    /// 0 before the first invocation of a burst
    #[state]
    running: u32,
}

impl Step for Stopwatch {
    fn step(&mut self, _: &Invocation) -> Outcome {
        let left = LEFT.load(Ordering::Relaxed) - 1;
        if self.running == 0 {
            FIRST_NS.store(now_ns(), Ordering::Relaxed);
            self.running = 1;
        }
        if left == 0 {
            LAST_NS.store(now_ns(), Ordering::Relaxed);
            self.running = 0;
        }
        LEFT.store(left, Ordering::Release);
        Outcome::Done
    }
}

/// Recorded times, ns, in the order in which they were recorded.
pub static MARKS: [AtomicI64; MARKS_MAX] = [const { AtomicI64::new(0) }; MARKS_MAX];
pub static MARKED: AtomicU64 = AtomicU64::new(0);
pub const MARKS_MAX: usize = 1 << 16;

/// Records a time, ns, in the next free entry.
fn keep(time_ns: i64) {
    let place = MARKED.load(Ordering::Relaxed);
    if let Some(mark) = MARKS.get(place as usize) {
        mark.store(time_ns, Ordering::Relaxed);
    }
    MARKED.store(place + 1, Ordering::Release);
}

/// Records the time of each of its invocations.
#[derive(FunctionBlock)]
pub struct Marker {
    /// 0
    #[param(default = 0)]
    _spare: u32,
}

impl Step for Marker {
    fn step(&mut self, _: &Invocation) -> Outcome {
        keep(now_ns());
        Outcome::Done
    }
}

/// Gain with a condition that is never met: y = k u.
#[derive(FunctionBlock)]
pub struct WatchedGain {
    /// input
    #[input]
    u: f64,
    /// k times the input
    #[output]
    y: f64,
    /// gain
    #[param(default = 1.0)]
    k: f64,
    /// the magnitude of the output exceeds 1e300
    #[condition]
    broken: Condition,
}

impl Step for WatchedGain {
    fn step(&mut self, _: &Invocation) -> Outcome {
        self.y = self.k * self.u;
        if self.y.abs() > 1e300 {
            self.broken.report();
        }
        Outcome::Done
    }
}

/// Reports on every nth invocation.
#[derive(FunctionBlock)]
pub struct Every {
    /// n
    #[param(default = 4)]
    n: u64,
    /// this invocation is the nth one
    #[condition]
    reached: Condition,
}

impl Step for Every {
    fn step(&mut self, invocation: &Invocation) -> Outcome {
        if (invocation.number + 1).is_multiple_of(self.n) {
            self.reached.report();
        }
        Outcome::Done
    }
}

/// Writes the time: y = now.
#[derive(FunctionBlock)]
pub struct Stamp {
    /// CLOCK_MONOTONIC, ns
    #[output]
    y: i64,
}

impl Step for Stamp {
    fn step(&mut self, _: &Invocation) -> Outcome {
        self.y = now_ns();
        Outcome::Done
    }
}

/// Records the age of its input.
#[derive(FunctionBlock)]
pub struct InputAge {
    /// time at which the input was written, ns
    #[input(asynchronous)]
    u: i64,
}

impl Step for InputAge {
    fn step(&mut self, _: &Invocation) -> Outcome {
        keep(now_ns() - self.u);
        Outcome::Done
    }
}

/// Value of CLOCK_MONOTONIC at time 0 of the host's clock.
pub static LATE_FROM_NS: AtomicI64 = AtomicI64::new(0);

/// Records the lateness of each of its invocations relative to its release.
#[derive(FunctionBlock)]
pub struct Lateness {
    /// 0
    #[param(default = 0)]
    _spare: u32,
}

impl Step for Lateness {
    fn step(&mut self, invocation: &Invocation) -> Outcome {
        keep(now_ns() - LATE_FROM_NS.load(Ordering::Relaxed) - invocation.now_ns);
        Outcome::Done
    }
}

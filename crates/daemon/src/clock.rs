// SPDX-License-Identifier: Apache-2.0
//! Clock of the control interface.
use std::sync::LazyLock;
use std::time::{Duration, Instant};

/// Origin of the time reported to clients. It is random, so that times from another run are not valid in this one.
static BEGUN: LazyLock<(Instant, u64)> = LazyLock::new(|| (now(), u64::from(getrandom::u32().unwrap_or(1 << 31)) + (1 << 32)));

/// Returns the current time on the runtime's clock, which a test may hold.
pub fn now() -> Instant {
    tokio::time::Instant::now().into_std()
}

/// Delay of a check above which the whole process is considered to have been suspended.
const STOOD_STILL: Duration = Duration::from_millis(250);

/// Periodic checks on the machine's clock. If a check is late, the process was suspended, and data that arrived in the meantime have not
/// been received yet.
pub struct Looks {
    every: Duration,
    due: Instant,
}

impl Looks {
    /// Creates periodic checks, the first of which is due now.
    #[must_use]
    pub fn new(every: Duration) -> Looks {
        Looks { every, due: Instant::now() }
    }

    /// Performs one check. Returns its delay if the process was suspended.
    pub fn look(&mut self) -> Option<Duration> {
        let now = Instant::now();
        let late = now.saturating_duration_since(self.due);
        self.due = now + self.every;
        (late > STOOD_STILL).then_some(late)
    }
}

/// Returns the time reported to clients in the heartbeat of a stream, ms.
pub fn told_ms() -> u64 {
    let (begun, offset_ms) = *BEGUN;
    offset_ms + u64::try_from(now().duration_since(begun).as_millis()).expect("less than 500 million years")
}

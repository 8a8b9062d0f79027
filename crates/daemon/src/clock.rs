// SPDX-License-Identifier: Apache-2.0
//! Clock of the control interface.
use std::sync::LazyLock;
use std::time::{Duration, Instant};

/// Origin of the time reported to clients. It is random, so that a time from another run is not valid in this one.
static BEGUN: LazyLock<(Instant, u64)> = LazyLock::new(|| (now(), u64::from(getrandom::u32().unwrap_or(1 << 31)) + (1 << 32)));

/// Returns the current time by the runtime's clock, which a test may hold.
pub fn now() -> Instant {
    tokio::time::Instant::now().into_std()
}

/// Delay from which a check was held up together with its process.
const STOOD_STILL: Duration = Duration::from_millis(250);

/// Periodic checks by the machine's clock: a late check was held up, and data that arrived meanwhile is still waiting to be received.
pub struct Looks {
    every: Duration,
    due: Instant,
}

impl Looks {
    /// Makes checks, the first of which is due now.
    #[must_use]
    pub fn new(every: Duration) -> Looks {
        Looks { every, due: Instant::now() }
    }

    /// Performs one check. Returns its delay if the process was held up.
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

// SPDX-License-Identifier: Apache-2.0
//! The clock of the control interface.
use std::sync::LazyLock;
use std::time::{Duration, Instant};

/// The time at which the clock that clients are told begins. It is random, so that a time of another run is none of this one.
static BEGUN: LazyLock<(Instant, u64)> = LazyLock::new(|| (now(), u64::from(getrandom::u32().unwrap_or(1 << 31)) + (1 << 32)));

/// Returns the present time by the clock of the runtime, which a test may let stand still.
pub fn now() -> Instant {
    tokio::time::Instant::now().into_std()
}

/// A look that is later than that was held up with its process.
const STOOD_STILL: Duration = Duration::from_millis(250);

/// Looks at regular intervals by the clock of the machine: one that is late was held up, and what came meanwhile is still on its way in.
pub struct Looks {
    every: Duration,
    due: Instant,
}

impl Looks {
    /// Makes looks of which the first is due now.
    #[must_use]
    pub fn new(every: Duration) -> Looks {
        Looks { every, due: Instant::now() }
    }

    /// Takes one look. Returns how late it is, where the process stood still.
    pub fn look(&mut self) -> Option<Duration> {
        let now = Instant::now();
        let late = now.saturating_duration_since(self.due);
        self.due = now + self.every;
        (late > STOOD_STILL).then_some(late)
    }
}

/// Returns the time that clients are told by the heartbeat of a stream, ms.
pub fn told_ms() -> u64 {
    let (begun, offset_ms) = *BEGUN;
    offset_ms + u64::try_from(now().duration_since(begun).as_millis()).expect("less than 500 million years")
}

// SPDX-License-Identifier: Apache-2.0
//! The clock of the control interface.
use std::sync::LazyLock;
use std::time::Instant;

/// The time at which the clock that clients are told begins. It is random, so that a time of another run is none of this one.
static BEGUN: LazyLock<(Instant, u64)> = LazyLock::new(|| (now(), u64::from(getrandom::u32().unwrap_or(1 << 31)) + (1 << 32)));

/// Returns the present time by the clock of the runtime, which a test may let stand still.
pub fn now() -> Instant {
    tokio::time::Instant::now().into_std()
}

/// Returns the time that clients are told by the heartbeat of a stream, ms.
pub fn told_ms() -> u64 {
    let (begun, offset_ms) = *BEGUN;
    offset_ms + u64::try_from(now().duration_since(begun).as_millis()).expect("less than 500 million years")
}

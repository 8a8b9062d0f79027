// SPDX-License-Identifier: Apache-2.0
//! Silence of the other side, as measured by this side, which polls occasionally.
use std::time::{Duration, Instant};

/// Maximum time counted between two polls: any excess counts as a suspension of this side or of the whole machine, not as silence of the
/// other side.
const LOOK_MAX: Duration = Duration::from_millis(250);

/// Time since the last message of the other side.
pub struct Silence {
    looked: Instant,
    lasted: Duration,
}

impl Silence {
    /// Starts measuring silence now.
    #[must_use]
    pub fn begins() -> Silence {
        Silence { looked: Instant::now(), lasted: Duration::ZERO }
    }

    /// Records a poll; `heard`: a message has arrived since the previous poll.
    pub fn looked(&mut self, heard: bool) {
        self.looked_at(heard, Instant::now());
    }

    fn looked_at(&mut self, heard: bool, now: Instant) {
        let since = now.saturating_duration_since(self.looked).min(LOOK_MAX);
        self.looked = now;
        self.lasted = if heard { Duration::ZERO } else { self.lasted + since };
    }

    /// Returns the measured duration of the silence.
    #[must_use]
    pub fn lasted(&self) -> Duration {
        self.lasted
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn looks_without_a_word_add_up_and_a_word_ends_them() {
        let (mut silence, begun) = (Silence::begins(), Instant::now());
        (1..=20u32).for_each(|look| silence.looked_at(false, begun + look * Duration::from_millis(100)));
        assert!(silence.lasted() > Duration::from_millis(1800), "{:?}", silence.lasted());
        silence.looked_at(true, begun + Duration::from_millis(2100));
        assert_eq!(silence.lasted(), Duration::ZERO);
    }

    #[test]
    fn a_side_that_stood_still_itself_blames_nobody() {
        let (mut silence, begun) = (Silence::begins(), Instant::now());
        silence.looked_at(false, begun + Duration::from_secs(60));
        assert!(silence.lasted() <= LOOK_MAX, "{:?}", silence.lasted());
    }
}

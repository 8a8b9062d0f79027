// SPDX-License-Identifier: Apache-2.0
//! Monitors the presence of a node by the signs of life received from it and their times.
use crate::nmt::NodeState;

/// Maximum number of consecutive missed heartbeats.
const BEATS_MAX: i64 = 3;

/// Signs of life of a node.
#[derive(Default)]
pub struct SignsOfLife {
    /// Time of the latest sign of life; `None` before the first one.
    when_ns: Option<i64>,
    /// True if the node's process data have arrived since the last SYNC.
    pub is_fresh: bool,
    /// Number of consecutive cycles without process data.
    pub cycles: u32,
    beats: i64,
    /// State of a node that is no longer operational or has restarted.
    left: Option<NodeState>,
}

/// Sign of life that is missing.
#[derive(Debug, PartialEq, Eq)]
pub enum Missing {
    Beats,
    Cycles,
    Left(NodeState),
}

impl SignsOfLife {
    /// Starts expecting signs of life again.
    pub fn expect(&mut self) {
        *self = SignsOfLife::default();
    }

    /// Records a sign of life.
    pub fn data(&mut self, now_ns: i64) {
        (self.when_ns, self.beats) = (Some(now_ns), 0);
    }

    /// Records that the node's process data have arrived.
    pub fn fresh(&mut self, now_ns: i64) {
        self.data(now_ns);
        (self.is_fresh, self.cycles) = (true, 0);
    }

    pub fn heartbeat(&mut self, now_ns: i64, state: NodeState) {
        self.data(now_ns);
        self.left = Some(state).filter(|state| *state != NodeState::Operational);
    }

    /// Returns the problem in this cycle, if any, and the number of newly missed heartbeats.
    pub fn missing(&mut self, now_ns: i64, heartbeat_ns: i64, lost_after: u32) -> (Option<Missing>, u64) {
        let silent_ns = now_ns - *self.when_ns.get_or_insert(now_ns);
        // A heartbeat may be late by half a period.
        let beats = ((silent_ns - heartbeat_ns / 2) / heartbeat_ns).max(0);
        let more = (beats - self.beats).max(0);
        self.beats = beats;
        let missing = match self.left {
            Some(state) => Some(Missing::Left(state)),
            None if self.cycles >= lost_after => Some(Missing::Cycles),
            None if beats >= BEATS_MAX => Some(Missing::Beats),
            None => None,
        };
        (missing, more as u64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_heartbeats_may_be_late_and_no_more() {
        let mut heard = SignsOfLife::default();
        heard.heartbeat(0, NodeState::Operational);
        let at = |heard: &mut SignsOfLife, ms: i64| heard.missing(ms * 1_000_000, 100_000_000, 3);
        assert_eq!(at(&mut heard, 149), (None, 0));
        assert_eq!(at(&mut heard, 160), (None, 1));
        assert_eq!(at(&mut heard, 260), (None, 1));
        assert_eq!(at(&mut heard, 350), (Some(Missing::Beats), 1));
        heard.heartbeat(350_000_000, NodeState::Operational);
        assert_eq!(at(&mut heard, 360), (None, 0));
        heard.heartbeat(370_000_000, NodeState::BootUp);
        assert_eq!(at(&mut heard, 370), (Some(Missing::Left(NodeState::BootUp)), 0));
    }
}

// SPDX-License-Identifier: Apache-2.0
//! The time between two invocations, for blocks whose parameters are times and frequencies.
//!
//! A block that measures it needs no parameter that repeats the interval at which it is activated, and stays right when the
//! interval is changed or a firing is skipped.

/// When the invocation before was.
#[derive(Clone, Copy, Debug, Default)]
pub struct Span {
    before_ns: i64,
    begun: bool,
}

impl Span {
    /// Running time since the invocation before, s; 0 at the first, and at an extra one in the same firing.
    pub fn advance(&mut self, time_ns: i64) -> f64 {
        let span_s = if self.begun { time_ns.saturating_sub(self.before_ns).max(0) as f64 * 1e-9 } else { 0.0 };
        *self = Span { before_ns: time_ns, begun: true };
        span_s
    }

    /// Whether there was an invocation before.
    pub fn begun(&self) -> bool {
        self.begun
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_invocation_has_no_span() {
        let mut span = Span::default();
        assert_eq!((span.begun(), span.advance(5_000_000)), (false, 0.0));
        assert_eq!((span.begun(), span.advance(7_000_000)), (true, 0.002));
        assert_eq!(span.advance(7_000_000), 0.0);
    }
}

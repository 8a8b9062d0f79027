// SPDX-License-Identifier: Apache-2.0
//! Conditions of a block.

/// A condition without a value. Reporting it does not return from the body; the report counts only if the invocation succeeds.
#[derive(Clone, Copy, Debug, Default)]
pub struct Condition {
    reported: bool,
}

impl Condition {
    /// Creates a condition that is not reported.
    #[inline]
    pub const fn new() -> Condition {
        Condition { reported: false }
    }
    /// Reports the condition.
    #[inline]
    pub fn report(&mut self) {
        self.reported = true;
    }
    /// Returns true if this invocation has reported the condition.
    #[inline]
    pub fn is_reported(&self) -> bool {
        self.reported
    }
}

/// A condition with a value: a preset that the block reads, and a value that it reports. A report never changes the preset.
#[derive(Clone, Copy, Debug)]
pub struct ConditionOf<T> {
    /// Preset. Writing it has no effect beyond this invocation.
    pub preset: T,
    #[doc(hidden)]
    pub value: T,
    reported: bool,
}

impl<T: Copy> ConditionOf<T> {
    /// Creates a condition with this preset, not reported.
    #[inline]
    pub const fn new(preset: T) -> ConditionOf<T> {
        ConditionOf { preset, value: preset, reported: false }
    }
    #[doc(hidden)]
    #[inline]
    pub const fn of(preset: T, value: T) -> ConditionOf<T> {
        ConditionOf { preset, value, reported: false }
    }
    /// Reports the condition with a value.
    #[inline]
    pub fn report(&mut self, value: T) {
        self.value = value;
        self.reported = true;
    }
    /// Returns true if this invocation has reported the condition.
    #[inline]
    pub fn is_reported(&self) -> bool {
        self.reported
    }
}

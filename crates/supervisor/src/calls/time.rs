// SPDX-License-Identifier: Apache-2.0
//! The system's clock.
use crate::refuse::refuse;
use crate::system::System;
use model::refusal::{Class, Refusals};

impl System {
    /// ns on the system's clock.
    pub fn now_ns(&self) -> i64 {
        self.shared.host.now_ns()
    }

    /// Virtual clock: runs the firings in (now, now + duration].
    pub fn advance(&self, duration_ns: i64) -> Result<(), Refusals> {
        self.require_virtual("advance")?;
        let limit_ns = self.now_ns().saturating_add(duration_ns.max(0));
        while self.shared.happen(limit_ns)? {}
        self.shared.host.set_now(limit_ns);
        self.shared.locked().serve_deadlines(limit_ns);
        self.shared.settle();
        Ok(())
    }

    /// Virtual clock: everything that happens at the next instant; false if nothing ever will.
    pub fn step(&self) -> Result<bool, Refusals> {
        self.require_virtual("step")?;
        self.shared.step(i64::MAX)
    }

    fn require_virtual(&self, call: &str) -> Result<(), Refusals> {
        if self.shared.is_virtual {
            return Ok(());
        }
        Err(refuse(Class::InvalidState, format!("cannot {call} system '{}': its clock is monotonic", self.name), "make it with clock=\"virtual\""))
    }
}

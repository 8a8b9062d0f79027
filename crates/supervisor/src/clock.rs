// SPDX-License-Identifier: Apache-2.0
//! Clock of the system.
use crate::refuse::refuse;
use crate::svvs::values::{Reading, store_value};
use crate::system::System;
use model::refusal::{Class, Refusals};
use model::value::Value;

impl System {
    /// Returns the time on the system's clock, ns.
    pub fn now_ns(&self) -> i64 {
        self.shared.host.now_ns()
    }

    /// Runs the firings in (now, now + duration] under the virtual clock. Fails if the duration is negative.
    pub fn advance(&self, duration_ns: i64) -> Result<(), Refusals> {
        self.require_virtual("advance")?;
        if duration_ns < 0 {
            let message = format!("the duration to advance cannot be {} s: it must be at least 0 s", duration_ns as f64 * 1e-9);
            return Err(refuse(Class::OutOfRange, message, "give a time that is not negative, for example '20 ms'"));
        }
        let limit_ns = self.now_ns().saturating_add(duration_ns);
        while self.shared.happen(limit_ns)? {}
        self.shared.host.set_now(limit_ns);
        self.shared.locked().serve_deadlines(limit_ns);
        self.shared.settle();
        Ok(())
    }

    /// Runs everything that is due at the next instant of the virtual clock; returns false if nothing will ever be due.
    pub fn step(&self) -> Result<bool, Refusals> {
        self.require_virtual("step")?;
        self.shared.step(i64::MAX)
    }

    /// Performs a step of an episode under the virtual clock: stores numbers in SVVs, runs the firings of the next `duration_ns`, and
    /// reads SVVs. For an array, the numbers are its elements. Values are checked as in [`System::write`] but not logged.
    pub fn turn(&self, stores: &[(String, Vec<f64>)], duration_ns: i64, reads: &[String]) -> Result<Vec<Reading>, Refusals> {
        self.require_virtual("turn")?;
        self.shared.command(|core| {
            stores.iter().try_for_each(|(name, numbers)| {
                let elements = numbers.iter().copied().map(Value::Number);
                match &numbers[..] {
                    [number] => store_value(core, name, &Value::Number(*number)).or_else(|_| store_value(core, name, &Value::List(elements.collect()))),
                    _ => store_value(core, name, &Value::List(elements.collect())),
                }
            })
        })?;
        self.advance(duration_ns)?;
        Ok(self.read(reads)?.1)
    }

    fn require_virtual(&self, call: &str) -> Result<(), Refusals> {
        if self.shared.is_virtual {
            return Ok(());
        }
        Err(refuse(Class::InvalidState, format!("cannot {call} system '{}': its clock is monotonic", self.name), "create it with clock=\"virtual\""))
    }
}

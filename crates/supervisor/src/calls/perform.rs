// SPDX-License-Identifier: Apache-2.0
//! A call of a verb as one: created, started, waited for and deleted.
use crate::lifecycle::instance::Limits;
use crate::lifecycle::report::Report;
use crate::system::{System, Waited};
use model::definition::Application;
use model::refusal::Refusals;
use std::time::Duration;

impl System {
    /// Creates a verb instance and starts it with the values of the application. Where one of both is refused, nothing is left of it.
    /// `start`: makes the start, as the program's or as somebody else's.
    pub fn perform(
        &self,
        application: &Application,
        limits: Limits,
        start: impl FnOnce(u64, &dyn Fn() -> Result<(), Refusals>) -> Result<(), Refusals>,
    ) -> Result<u64, Refusals> {
        let instance = self.create_for_start(application)?;
        let started = start(instance, &|| self.start(instance, &application.values, limits));
        if let Err(refusals) = started {
            self.delete(instance)?;
            return Err(refusals);
        }
        Ok(instance)
    }

    /// The end report of an instance that [`System::perform`] has started, waiting at most `slice` of real time. It is deleted then.
    pub fn performed(&self, instance: u64, slice: Duration) -> Result<Waited<Report>, Refusals> {
        let waited = self.wait(instance, None, slice)?;
        if matches!(waited, Waited::Done(_)) {
            self.delete_by(instance, |mut course| course.retire())?;
        }
        Ok(waited)
    }
}

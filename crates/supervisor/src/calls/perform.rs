// SPDX-License-Identifier: Apache-2.0
//! A call of a verb as one: created, started, waited for and deleted.
use crate::attending::Attending;
use crate::calls::apply::delete_from;
use crate::core::Core;
use crate::lifecycle::instance::Limits;
use crate::lifecycle::report::Report;
use crate::system::{System, Waited};
use crate::watchful::Watchful;
use model::definition::Application;
use model::refusal::Refusals;
use std::cell::Cell;
use std::sync::atomic::Ordering;
use std::time::Duration;

impl System {
    /// Creates a verb instance, starts it with the values of the application, waits for its end at most `slice` of real time, and deletes it;
    /// where the time is over, [`System::performed`] goes on. Returns the instance too. Where creation or start is refused, nothing is left.
    /// `start`: makes the start, as the program's or as another caller's.
    pub fn perform(
        &self,
        application: &Application,
        limits: Limits,
        slice: Duration,
        start: impl FnOnce(u64, &dyn Fn() -> Result<(), Refusals>) -> Result<(), Refusals>,
    ) -> Result<(u64, Waited<Report>), Refusals> {
        let instance = self.create_for_start(application)?;
        let attending = Cell::new(None);
        let started = start(instance, &|| {
            attending.set(self.attending(instance));
            self.start(instance, &application.values, limits)
        });
        if let Err(refusals) = started {
            drop(attending);
            self.delete(instance)?;
            return Err(refusals);
        }
        Ok((instance, self.ended_and_deleted(instance, attending.into_inner(), slice)?))
    }

    /// Takes what the kernels tell from before the start on, where the end of the instance is likely at once.
    fn attending(&self, instance: u64) -> Option<Attending> {
        let core = self.shared.locked();
        (!self.shared.is_virtual && core.expects(instance) == Watchful::At).then(|| Attending::new(&core))
    }

    /// Returns the end report of an instance that [`System::perform`] has started, waiting at most `slice` of real time. It is deleted then.
    pub fn performed(&self, instance: u64, slice: Duration) -> Result<Waited<Report>, Refusals> {
        self.ended_and_deleted(instance, None, slice)
    }

    fn ended_and_deleted(&self, instance: u64, attending: Option<Attending>, slice: Duration) -> Result<Waited<Report>, Refusals> {
        let mut is_deleted = false;
        let watchful = self.shared.locked().expects(instance);
        let waited = self.shared.wait_watchfully(watchful, attending, None, slice, |core| {
            let Some(report) = core.instances.known(instance)?.ended()? else { return Ok(None) };
            // Deleted under the same lock, where the definitions are free: the core is not let go, and taken again, between.
            if let Ok(mut definitions) = self.shared.definitions.try_lock()
                && !self.shared.closed.load(Ordering::Acquire)
            {
                delete_from(core, &mut definitions, instance, |mut course| course.retire())?;
                is_deleted = true;
            }
            Ok(Some(report))
        })?;
        if matches!(waited, Waited::Done(_)) && !is_deleted {
            self.delete_by(instance, |mut course| course.retire())?;
        }
        Ok(waited)
    }
}

impl Core {
    /// Returns when the end of an instance that has just been started may come.
    fn expects(&self, instance: u64) -> Watchful {
        let Some(instance) = self.instances.get(&instance).filter(|instance| instance.ends_in_its_opening().is_none()) else { return Watchful::At };
        let periods = instance.installed.sources.iter().map(|source| self.host.period_ns(*source));
        match periods.min() {
            Some(Some(period_ns)) => Watchful::AtRelease(period_ns),
            _ => Watchful::At,
        }
    }
}

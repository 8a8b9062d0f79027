// SPDX-License-Identifier: Apache-2.0
//! Call of a verb: its instance is created, started, waited for and deleted, each a step of its caller.
use crate::attending::Attending;
use crate::core::Core;
use crate::ending::report::Report;
use crate::instances::apply::delete_from;
use crate::instances::instance::Limits;
use crate::system::{System, WaitResult};
use crate::watchful::Watchful;
use indexmap::IndexMap;
use model::refusal::Refusals;
use model::value::Value;
use std::sync::atomic::Ordering;
use std::time::Duration;

/// An instance that was started by a caller that waits for its end.
pub struct StartedInstance {
    instance: u64,
    attending: Option<Attending>,
}

impl StartedInstance {
    /// Returns its number.
    pub fn instance(&self) -> u64 {
        self.instance
    }
}

impl System {
    /// Starts an instance of [`System::create_to_start`] for a caller that waits for its end with [`System::complete`].
    /// Deletes the instance if the start is refused.
    pub fn start_to_wait(&self, instance: u64, values: &IndexMap<String, Value>, limits: Limits) -> Result<StartedInstance, Refusals> {
        let attending = self.attending(instance);
        if let Err(refusals) = self.start(instance, values, limits) {
            drop(attending);
            self.delete(instance)?;
            return Err(refusals);
        }
        Ok(StartedInstance { instance, attending })
    }

    /// Waits for the end of an instance at most `slice` of real time, and deletes it; where the time is over, [`System::performed`] goes on.
    pub fn complete(&self, started: StartedInstance, slice: Duration) -> Result<WaitResult<Report>, Refusals> {
        self.ended_and_deleted(started.instance, started.attending, slice)
    }

    /// Takes what the kernels tell from before the start on, where the end of the instance is likely at once.
    fn attending(&self, instance: u64) -> Option<Attending> {
        let core = self.shared.locked();
        (!self.shared.is_virtual && core.expects(instance) == Watchful::At).then(|| Attending::new(&core))
    }

    /// Returns the end report of an instance that [`System::start_to_wait`] has started, waiting at most `slice` of real time. It is deleted then.
    pub fn performed(&self, instance: u64, slice: Duration) -> Result<WaitResult<Report>, Refusals> {
        self.ended_and_deleted(instance, None, slice)
    }

    fn ended_and_deleted(&self, instance: u64, attending: Option<Attending>, slice: Duration) -> Result<WaitResult<Report>, Refusals> {
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
        if matches!(waited, WaitResult::Done(_)) && !is_deleted {
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

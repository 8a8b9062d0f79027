// SPDX-License-Identifier: Apache-2.0
//! Call of a verb in separate steps: the caller creates the instance, starts it, waits for it, and deletes it.
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

/// An instance started by a caller that waits for it to end.
pub struct StartedInstance {
    instance: u64,
    attending: Option<Attending>,
}

impl StartedInstance {
    /// Returns the number of the instance.
    pub fn instance(&self) -> u64 {
        self.instance
    }
}

impl System {
    /// Starts an instance created by [`System::create_to_start`] for a caller that waits for it to end with [`System::complete`]. Deletes
    /// the instance if the start is refused.
    pub fn start_to_wait(&self, instance: u64, values: &IndexMap<String, Value>, limits: Limits) -> Result<StartedInstance, Refusals> {
        let attending = self.attending(instance);
        if let Err(refusals) = self.start(instance, values, limits) {
            drop(attending);
            self.delete(instance)?;
            return Err(refusals);
        }
        Ok(StartedInstance { instance, attending })
    }

    /// Waits at most `slice` of real time for an instance to end, and deletes it. If the time expires, continue with
    /// [`System::performed`].
    pub fn complete(&self, started: StartedInstance, slice: Duration) -> Result<WaitResult<Report>, Refusals> {
        self.ended_and_deleted(started.instance, started.attending, slice)
    }

    /// Starts attending before the start if the instance will probably end immediately.
    fn attending(&self, instance: u64) -> Option<Attending> {
        let core = self.shared.locked();
        (!self.shared.is_virtual && core.expects(instance) == Watchful::At).then(|| Attending::new(&core))
    }

    /// Returns the end report of an instance started by [`System::start_to_wait`], waiting at most `slice` of real time, and deletes the
    /// instance.
    pub fn performed(&self, instance: u64, slice: Duration) -> Result<WaitResult<Report>, Refusals> {
        self.ended_and_deleted(instance, None, slice)
    }

    fn ended_and_deleted(&self, instance: u64, attending: Option<Attending>, slice: Duration) -> Result<WaitResult<Report>, Refusals> {
        let mut is_deleted = false;
        let watchful = self.shared.locked().expects(instance);
        let waited = self.shared.wait_watchfully(watchful, attending, None, slice, |core| {
            let Some(report) = core.instances.known(instance)?.ended()? else { return Ok(None) };
            // Delete it under the same lock if the definitions are free, rather than release and retake the core.
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
    /// Returns the time at which an instance that has just been started is expected to end.
    fn expects(&self, instance: u64) -> Watchful {
        let Some(instance) = self.instances.get(&instance).filter(|instance| instance.ends_in_its_opening().is_none()) else { return Watchful::At };
        let periods = instance.installed.sources.iter().map(|source| self.host.period_ns(*source));
        match periods.min() {
            Some(Some(period_ns)) => Watchful::AtRelease(period_ns),
            _ => Watchful::At,
        }
    }
}

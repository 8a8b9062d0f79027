// SPDX-License-Identifier: Apache-2.0
//! Calls that control an instance from its start to its end.
use crate::ending::report::Report;
use crate::instances::instance::{Instance, Limits, State};
use crate::pausing::program::refuse_paused;
use crate::precedence::first;
use crate::refuse::{invalid_state, refuse};
use crate::system::{System, WaitResult};
use indexmap::IndexMap;
use model::refusal::{Class, Refusals};
use model::value::Value;
use std::time::Duration;

impl System {
    /// Starts a verb instance.
    pub fn start(&self, instance: u64, values: &IndexMap<String, Value>, limits: Limits) -> Result<(), Refusals> {
        limits.check()?;
        let mut definitions = self.shared.definitions();
        self.untune(&mut definitions, instance)?;
        let plan = self.shared.locked().instances.known(instance)?.plan.clone();
        let values = self.settled(&plan, values, &definitions.configuration)?;
        self.shared.command(|core| core.course(instance).start(&values, limits, &definitions.configuration))
    }

    /// Suspends an instance; returns after the kernels have suspended it.
    pub fn suspend(&self, instance: u64) -> Result<(), Refusals> {
        first(|| self.shared.command(|core| core.course(instance).suspend()))?;
        let is_settled = |i: &Instance| i.state() != State::Running || i.leaving.departure.is_some();
        loop {
            let settled = self.until_settled(instance, is_settled);
            // An instance that comes to rest first has its own time limit.
            if settled.is_ok() || self.shared.locked().instances.get(&instance).is_none_or(|i| i.resting_until_ns().is_none()) {
                settled?;
                break;
            }
        }
        match self.shared.locked().instances.get(&instance).filter(|i| i.leaving.departure.is_some() && i.state() != State::Ended) {
            Some(ends) => Err(invalid_state(&format!("'{}'", ends.name), "ending", "suspend", "wait for it")),
            None => Ok(()),
        }
    }

    pub fn resume(&self, instance: u64) -> Result<(), Refusals> {
        self.shared.command(|core| {
            refuse_paused(core, instance)?;
            core.course(instance).resume()
        })?;
        self.until_settled(instance, |i| i.state() != State::Suspended)
    }

    /// Begins a halt: follows τ on `halted`, or ends the instance. [`System::wait`] waits for its completion.
    pub fn halt(&self, instance: u64) -> Result<(), Refusals> {
        first(|| self.shared.command(|core| core.course(instance).halt()))
    }

    /// Returns the end report of the latest start, waiting at most `slice` of real time. `until_ns` is the deadline on the system's
    /// clock.
    pub fn wait(&self, instance: u64, until_ns: Option<i64>, slice: Duration) -> Result<WaitResult<Report>, Refusals> {
        self.shared.wait_for(until_ns, slice, |core| core.instances.known(instance)?.ended())
    }

    /// Returns the report of the latest start, if it has ended.
    pub fn report(&self, instance: u64) -> Result<Option<Report>, Refusals> {
        Ok(self.shared.locked().instances.known(instance)?.report().cloned())
    }

    pub fn state(&self, instance: u64) -> &'static str {
        self.shared.locked().instances.get(&instance).map_or("deleted", |i| i.state().name())
    }

    /// Waits until a condition on an instance holds, but at most `SETTLE_MAX` of real time (kernels answer immediately).
    pub(crate) fn until_settled(&self, instance: u64, holds: impl Fn(&Instance) -> bool) -> Result<(), Refusals> {
        let waited = self.shared.wait_for(None, SETTLE_MAX, |core| Ok(core.instances.get(&instance).is_none_or(&holds).then_some(())))?;
        match waited {
            WaitResult::Done(()) => Ok(()),
            _ => Err(refuse(Class::InvalidState, "a kernel did not answer", "check with statistics() whether its processor is overloaded")),
        }
    }
}

/// Maximum time for kernels to settle. They answer a script within a firing; a longer delay means that a processor is not running.
const SETTLE_MAX: Duration = Duration::from_secs(5);

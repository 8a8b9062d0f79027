// SPDX-License-Identifier: Apache-2.0
//! Call of a verb in steps: creates, starts, waits for and deletes its instance. Between the steps, a daemon updates the owners and its
//! journal.
use crate::answered::{CallResult, Outcome};
use crate::waits::lasting;
use model::definition::Application;
use model::refusal::Refusals;
use serde_json::json;
use std::time::Duration;
use supervisor::{Limits, Report, StartedInstance, System, WaitResult};

/// An instance that was created for a verb call and has not been started yet.
pub struct PreparedVerb<'a> {
    system: &'a System,
    application: Application,
    limits: Limits,
    instance: u64,
}

/// An instance that was started for a verb call.
pub struct StartedVerb<'a> {
    system: &'a System,
    started: StartedInstance,
}

impl<'a> PreparedVerb<'a> {
    pub(crate) fn of(system: &'a System, application: Application, limits: Limits) -> Result<PreparedVerb<'a>, Refusals> {
        let instance = system.create_to_start(&application)?;
        Ok(PreparedVerb { system, application, limits, instance })
    }

    /// Returns the number of the instance.
    pub fn instance(&self) -> u64 {
        self.instance
    }

    /// Starts the instance with the values of its application. If the start is refused, the instance is deleted.
    pub fn start(self) -> Result<StartedVerb<'a>, Refusals> {
        let PreparedVerb { system, application, limits, instance } = self;
        Ok(StartedVerb { system, started: system.start_to_wait(instance, &application.values, limits)? })
    }
}

impl StartedVerb<'_> {
    /// Waits at most `slice` of real time for the instance to end, and deletes it. Returns the answer to the call.
    pub fn complete(self, slice: Duration) -> Result<CallResult, Refusals> {
        self.completed(slice)?.answered()
    }

    pub(crate) fn completed(self, slice: Duration) -> Result<Outcome<Option<Report>>, Refusals> {
        let instance = self.started.instance();
        Ok(ended(self.system.complete(self.started, slice)?, instance))
    }
}

/// Waits until an instance that was started for a call has ended, and deletes it.
pub(crate) fn performed(system: &System, instance: u64, slice: Duration) -> Result<Outcome<Option<Report>>, Refusals> {
    Ok(ended(system.performed(instance, slice)?, instance))
}

fn ended(waited: WaitResult<Report>, instance: u64) -> Outcome<Option<Report>> {
    lasting(waited, None, "performed", || json!({ "instance": instance }))
}

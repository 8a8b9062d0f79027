// SPDX-License-Identifier: Apache-2.0
//! A call of a verb in one: made, started, waited for and deleted.
use crate::answered::{Answered, Outcome};
use crate::arguments::Given;
use crate::waits::lasting;
use model::definition::Application;
use model::refusal::Refusals;
use serde_json::json;
use std::time::Duration;
use supervisor::{Limits, Report, System, Waited};

/// Makes the call `perform` for a caller that keeps whose the instances are: `start` is given the instance before it starts, and what starts
/// it. Where it does not start, nothing is left of it.
pub fn perform(
    system: &System,
    arguments: &str,
    slice: Duration,
    start: impl FnOnce(u64, &dyn Fn() -> Result<(), Refusals>) -> Result<(), Refusals>,
) -> Result<Answered, Refusals> {
    let mut given = Given::of("perform", arguments)?;
    let limits = given.may("limits")?;
    performing(system, &given.whole()?, limits, slice, start)?.answered()
}

pub(crate) fn performing(
    system: &System,
    application: &Application,
    limits: Limits,
    slice: Duration,
    start: impl FnOnce(u64, &dyn Fn() -> Result<(), Refusals>) -> Result<(), Refusals>,
) -> Result<Outcome<Option<Report>>, Refusals> {
    let (instance, waited) = system.perform(application, limits, slice, start)?;
    Ok(ended(waited, instance))
}

/// Waits until an instance that was started so has ended, and deletes it.
pub(crate) fn performed(system: &System, instance: u64, slice: Duration) -> Result<Outcome<Option<Report>>, Refusals> {
    Ok(ended(system.performed(instance, slice)?, instance))
}

fn ended(waited: Waited<Report>, instance: u64) -> Outcome<Option<Report>> {
    lasting(waited, None, "performed", || json!({ "instance": instance }))
}

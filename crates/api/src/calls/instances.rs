// SPDX-License-Identifier: Apache-2.0
//! Calls for verb instances.
use crate::arguments::CallArguments;
use crate::calls::with_effect;
use crate::effect::Effect;
use crate::performing::{PreparedVerb, performed};
use crate::sure;
use crate::waits::{lasting, until};
use indexmap::IndexMap;
use model::definition::Application;
use model::plan::Plan;
use model::refusal::Refusals;
use model::value::Value;
use serde_json::json;
use supervisor::{CommandSubject, InstanceAbout, InstanceState, Limits, Report, System};

/// Parses the arguments of a verb call, and creates the instance.
pub fn prepare<'a>(system: &'a System, arguments: &str) -> Result<PreparedVerb<'a>, Refusals> {
    let mut given = CallArguments::of(with_effect(Effect::PerformsVerb).name, arguments)?;
    let limits = given.may("limits")?;
    PreparedVerb::of(system, given.whole()?, limits)
}

crate::calls! {
    /// Calls for verb instances.
    pub(super) const INSTANCES about "verb instances" = [
        /// Plans an application without creating an instance. Returns the plan.
        Observe check(whole application: Application) -> Plan: costs
            => |system| system.check(&application);
        /// Calls a verb: creates an instance, starts it with the values of the application, waits until it has ended, and deletes it.
        /// Returns its end report.
        Operate perform(
            may limits: Limits,
            whole application: Application,
        ) -> Option<Report>: commands("verb"), lasts, brief, moves, effect(Effect::PerformsVerb)
            => |system, slice| {
                let prepared = PreparedVerb::of(system, application, limits)?;
                let command = with_effect(Effect::StartsInstance).command(CommandSubject::Instance(prepared.instance()));
                system.as_program(&command, || prepared.start())?.completed(slice)
            };
        /// Continues a verb call: waits until its instance has ended, and deletes it. Returns its end report.
        Operate performed(must instance: u64) -> Option<Report>: lasts, effect(Effect::CompletesVerb)
            => |system, slice| performed(system, instance, slice);
        /// Creates an instance. Returns its number.
        Operate create(whole application: Application) -> u64: commands("verb"), journalled, brief, effect(Effect::CreatesInstance)
            => |system| system.create(&application);
        /// Starts an instance.
        Operate start(
            must instance: u64,
            /// Input parameter → value.
            may values: IndexMap<String, Value>,
            may limits: Limits,
        ) -> (): commands("instance"), told, journalled, brief, moves, effect(Effect::StartsInstance)
            => |system| system.start(instance, &values, limits);
        /// Waits until an instance has ended. Returns its end report, or null after the timeout.
        Observe wait(
            must instance: u64,
            /// Timeout relative to the call, on the system's clock.
            may timeout_ns: Option<i64>,
            /// Absolute deadline, as an alternative to the timeout.
            may until_ns: Option<i64>,
        ) -> Option<Report>: lasts, brief, effect(Effect::ReportsEnd)
            => |system, slice| {
                let until_ns = until(system, timeout_ns, until_ns)?;
                let waited = system.wait(instance, until_ns, slice)?;
                Ok(lasting(waited, None, "wait", || json!({ "instance": instance, "until_ns": until_ns })))
            };
        /// Ends an instance and waits until it has ended. First follows a transition on `halted`, if there is one; a second halt is
        /// immediate. Returns the end report.
        Operate halt(
            must instance: u64,
            /// Timeout relative to the call, on the system's clock.
            may timeout_ns: Option<i64>,
            /// Absolute deadline, as an alternative to the timeout.
            may until_ns: Option<i64>,
        ) -> Option<Report>: commands("instance"), told, outcome_journalled, lasts, stops, free, effect(Effect::EndsInstance)
            => |system, slice| {
                let until_ns = until(system, timeout_ns, until_ns)?;
                system.halt(instance)?;
                let waited = system.wait(instance, until_ns, slice)?;
                Ok(lasting(waited, None, "wait", || json!({ "instance": instance, "until_ns": until_ns })))
            };
        /// Suspends an instance after its current step is complete.
        Operate suspend(must instance: u64) -> (): commands("instance"), told, outcome_journalled, stops, free
            => |system| system.suspend(instance);
        /// Resumes a suspended instance.
        Operate resume(must instance: u64) -> (): commands("instance"), told, outcome_journalled, brief, moves
            => |system| system.resume(instance);
        /// Deletes an instance that has ended.
        Operate delete(must instance: u64) -> (): commands("instance"), outcome_journalled, brief, effect(Effect::DeletesInstance)
            => |system| system.delete(instance);
        /// Returns the state of an instance: "created", "queued", "running", "suspended", "ended" or "deleted".
        Observe state(must instance: u64) -> InstanceState: brief
            => |system| sure(InstanceState::named(system.state(instance)));
        /// Returns the name, verb, state, blocks, conditions and lists of an instance.
        Observe instance(must instance: u64) -> InstanceAbout
            => |system| system.instance_about(instance);
        /// Returns the end report of the latest start; null while it is running.
        Observe report(must instance: u64) -> Option<Report>: brief, effect(Effect::ReportsEnd)
            => |system| system.report(instance);
        /// Sets tunable input parameters and intervals of a running instance.
        Operate set(
            must instance: u64,
            /// Input parameter → value.
            may values: IndexMap<String, Value>,
            /// Label of a block → interval.
            may every_ns: IndexMap<String, u64>,
        ) -> (): commands("instance"), told, journalled, brief, moves, effect(Effect::TunesInstance)
            => |system| system.set(instance, &values, &every_ns);
    ];
}

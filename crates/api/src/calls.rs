// SPDX-License-Identifier: Apache-2.0
//! Declarations of all calls.
mod alarms;
mod arms;
mod cell;
mod configuration;
mod devices;
mod instances;
mod observation;
mod points;
mod recorded;
mod recordings;
mod software;
mod values;
mod workspaces;

pub use instances::prepare;
pub use recordings::is_recording;

use crate::Call;
use crate::effect::Effect;
use std::collections::HashMap;
use std::sync::{LazyLock, OnceLock};

/// Default name of the caller of a call that is signed.
const PROGRAM: &str = "program";

/// All calls, grouped by subject.
const SUBJECTS: [&[Call]; 13] = [
    configuration::CONFIGURATION,
    software::SOFTWARE,
    devices::DEVICES,
    arms::ARMS,
    points::POINTS,
    instances::INSTANCES,
    values::VALUES,
    cell::CELL,
    alarms::ALARMS,
    observation::OBSERVATION,
    workspaces::WORKSPACES,
    recordings::RECORDINGS,
    recorded::RECORDED,
];

static BY_NAME: LazyLock<HashMap<&str, &Call>> = LazyLock::new(|| SUBJECTS.into_iter().flatten().map(|call| (call.name, call)).collect());

/// First call with each effect.
static BY_EFFECT: LazyLock<HashMap<Effect, &Call>> = LazyLock::new(|| SUBJECTS.into_iter().flatten().rev().map(|call| (call.effect, call)).collect());

/// Calls added by a program that builds on this crate.
static MORE: OnceLock<&[Call]> = OnceLock::new();

/// Returns the calls in listing order.
pub fn calls() -> impl Iterator<Item = &'static Call> {
    SUBJECTS.into_iter().chain(MORE.get().copied()).flatten()
}

/// Returns the call with this name.
pub fn find(name: &str) -> Option<&'static Call> {
    BY_NAME.get(name).copied().or_else(|| MORE.get()?.iter().find(|call| call.name == name))
}

/// Returns the call of this crate that has this effect; the first one if there are several.
///
/// # Panics
/// Panics if no call has this effect.
pub fn with_effect(effect: Effect) -> &'static Call {
    BY_EFFECT.get(&effect).expect("each effect is that of a call of this crate")
}

/// Adds calls declared outside this crate. Must be called only once per process, before anything is served.
///
/// # Panics
/// Panics if calls were added before, or if a name already exists.
pub fn add(more: &'static [Call]) {
    for call in more {
        assert!(!BY_NAME.contains_key(call.name), "there is already a call '{}'", call.name);
    }
    assert!(MORE.set(more).is_ok(), "calls were added before");
}

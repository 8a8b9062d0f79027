// SPDX-License-Identifier: Apache-2.0
//! The one table of the calls: who may make them, what they take, what they answer.
use crate::role::Role;
use Of::{
    Alarms, Any, Application, Bool, Composition, Device, DeviceType, Graph, InProcess, Int, Limits, Map, Names, Place, Placement, Report, Svv, Text, Verb,
};
use Role::{Configure, Download, Observe, Operate};

/// What an argument or a result is; `schema.rs` has the JSON Schema of each.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Of {
    Nothing,
    Any,
    Text,
    Int,
    Bool,
    Names,
    /// Numbers of instances.
    Numbers,
    /// Values by name.
    Map,
    /// Intervals by label, ns.
    Intervals,
    Place,
    /// Whether in a process of its own, or in which.
    InProcess,
    Limits,
    Report,
    Snapshot,
    History,
    Log,
    Alarms,
    Mode,
    Severity,
    Verb,
    Graph,
    /// What is wrong with a definition.
    Findings,
    /// A port of a definition that is drawn.
    Port,
    /// Why two ports cannot be wired; of one port and all others, a list.
    Wired,
    Composition,
    DeviceType,
    Device,
    Svv,
    Application,
    Placement,
}

/// An argument of a call.
#[derive(Clone, Copy, Debug)]
pub struct Argument {
    pub name: &'static str,
    pub of: Of,
    pub required: bool,
}

/// A call of the control interface.
#[derive(Clone, Copy, Debug)]
pub struct Call {
    pub name: &'static str,
    /// The least role that may make it.
    pub role: Role,
    /// Its arguments by name; of a call whose arguments are one definition, that.
    pub arguments: &'static [Argument],
    pub whole: Option<Of>,
    pub result: Of,
}

const fn must(name: &'static str, of: Of) -> Argument {
    Argument { name, of, required: true }
}

const fn may(name: &'static str, of: Of) -> Argument {
    Argument { name, of, required: false }
}

const fn call(name: &'static str, role: Role, arguments: &'static [Argument], result: Of) -> Call {
    Call { name, role, arguments, whole: None, result }
}

const fn whole(name: &'static str, role: Role, of: Of, arguments: &'static [Argument], result: Of) -> Call {
    Call { name, role, arguments, whole: Some(of), result }
}

const NONE: &[Argument] = &[];
const NAME: &[Argument] = &[must("name", Text)];
const INSTANCE: &[Argument] = &[must("instance", Int)];
const DRAWING: &[Argument] = &[may("graph", Graph), may("verb", Verb)];
const WAIT: &[Argument] = &[must("instance", Int), may("timeout_ns", Int), may("until_ns", Int)];

/// The calls, in the order of `opengpac_ps.h`. `download` is not among them: code comes by `PUT /v1/modules`.
pub const CALLS: &[Call] = &[
    call(
        "processor",
        Configure,
        &[
            must("name", Text),
            may("core", Int),
            may("supervisor", Bool),
            may("process", InProcess),
            may("host", Text),
            may("lost_after_ns", Int),
            may("patience_ns", Int),
        ],
        Of::Nothing,
    ),
    call(
        "listen",
        Download,
        &[
            must("endpoint", Text),
            must("name", Text),
            may("authority", Text),
            may("certificate", Text),
            may("key", Text),
            may("token", Text),
            may("clock_limit_ns", Int),
        ],
        Of::Nothing,
    ),
    call("take_over", Configure, NONE, Any),
    call(
        "source",
        Configure,
        &[must("processor", Text), must("name", Text), must("kind", Text), may("period_ns", Int), must("priority", Int), may("virtual_cost_ns", Int)],
        Of::Nothing,
    ),
    call("request", Operate, &[must("source", Text)], Of::Nothing),
    call(
        "physical_device",
        Configure,
        &[must("processor", Text), must("name", Text), must("kind", Text), may("options", Any), must("source", Text), may("place", Place)],
        Any,
    ),
    call("reopen_physical_device", Operate, NAME, Of::Nothing),
    call("delete_physical_device", Configure, NAME, Of::Nothing),
    whole("place", Configure, Placement, NONE, Of::Nothing),
    whole("define_verb", Configure, Verb, NONE, Of::Nothing),
    whole("check_graph", Observe, Graph, NONE, Of::Nothing),
    call("check_definition", Observe, DRAWING, Of::Findings),
    call("compatible", Observe, &[may("graph", Graph), may("verb", Verb), must("from", Of::Port), may("to", Of::Port)], Of::Wired),
    whole("define_device_type", Configure, DeviceType, NONE, Of::Nothing),
    whole("svv", Configure, Svv, &[must("name", Text), may("place", Place)], Of::Nothing),
    call("delete_svv", Configure, NAME, Of::Nothing),
    call("library", Observe, NONE, Any),
    whole("device", Configure, Device, NAME, Of::Nothing),
    call("enable", Operate, NAME, Int),
    call("wait_enabled", Observe, &[must("name", Text), may("timeout_ns", Int), may("until_ns", Int)], Bool),
    call("disable", Operate, NAME, Of::Nothing),
    call("delete_device", Configure, NAME, Of::Nothing),
    call("device_state", Observe, NAME, Text),
    call("device_parameter", Observe, &[must("name", Text), must("parameter", Text)], Any),
    call("set_device_parameter", Operate, &[must("name", Text), must("parameter", Text), must("value", Any)], Of::Nothing),
    whole("check", Observe, Application, NONE, Any),
    whole("create", Operate, Application, NONE, Int),
    call("start", Operate, &[must("instance", Int), may("values", Map), may("limits", Limits)], Of::Nothing),
    call("wait", Observe, WAIT, Report),
    call("halt", Operate, WAIT, Report),
    call("suspend", Operate, INSTANCE, Of::Nothing),
    call("resume", Operate, INSTANCE, Of::Nothing),
    call("delete", Operate, INSTANCE, Of::Nothing),
    call("state", Observe, INSTANCE, Text),
    call("instance", Observe, INSTANCE, Any),
    call("report", Observe, INSTANCE, Report),
    call("set", Operate, &[must("instance", Int), may("values", Map), may("every_ns", Of::Intervals)], Of::Nothing),
    call("read", Observe, &[must("names", Names), may("raw", Bool)], Of::Snapshot),
    call("write", Operate, &[must("name", Text), must("value", Any)], Of::Nothing),
    call("history", Observe, &[must("name", Text), must("count", Int), may("raw", Bool)], Of::History),
    call("svv_about", Observe, NAME, Any),
    call("now", Observe, NONE, Int),
    call("advance", Operate, &[must("duration_ns", Int)], Of::Nothing),
    call("step", Operate, NONE, Bool),
    call("emergency_stop", Operate, &[must("reason", Text)], Of::Nothing),
    call("emergency_stop_input", Configure, &[must("device", Text), must("channel", Text), may("at_zero", Bool)], Of::Nothing),
    call("reset", Operate, NONE, Of::Nothing),
    call("pause", Operate, &[may("devices", Names)], Names),
    call("paused", Operate, &[must("instances", Of::Numbers), must("names", Names)], Names),
    call("resume_program", Operate, &[may("devices", Names)], Names),
    call("mode", Observe, NONE, Of::Mode),
    call("set_mode", Operate, &[must("mode", Of::Mode)], Of::Nothing),
    call("enabling_switch", Configure, &[must("device", Text), must("channel", Text)], Of::Nothing),
    call("define_alarm", Configure, &[must("code", Text), must("text", Text), may("remedy", Text), may("severity", Of::Severity)], Of::Nothing),
    call("raise_alarm", Operate, &[must("code", Text), may("source", Text), may("text", Text)], Of::Nothing),
    call("clear_alarm", Operate, &[must("code", Text), may("source", Text)], Bool),
    call("alarms", Observe, NONE, Any),
    call("acknowledge_alarms", Operate, &[may("number", Int)], Int),
    call("restore_alarms", Configure, &[must("history", Alarms)], Of::Nothing),
    call("raises", Configure, &[must("device", Text), must("channel", Text), must("source", Text), may("place", Place)], Of::Nothing),
    call("exchange_verb", Configure, &[must("device", Text), must("verb", Text), may("place", Place)], Of::Nothing),
    whole("compose", Observe, Composition, NONE, Verb),
    call("verbs", Observe, NONE, Any),
    call("configuration", Observe, NONE, Any),
    call("installed", Observe, NONE, Any),
    call("verb_form", Observe, NAME, Any),
    call("geometry", Observe, &[must("device", Text)], Any),
    call("statistics", Observe, NONE, Any),
    call("probe", Observe, &[may("source", Text), must("for_ns", Int)], Of::Nothing),
    call("names", Observe, NONE, Any),
    call("record", Configure, &[must("path", Text), may("svvs", Names), may("cells", Bool), may("replay", Bool)], Any),
    call("recording", Observe, &[must("recording", Int)], Any),
    call("stop_recording", Configure, &[must("recording", Int)], Any),
    call("log", Observe, &[may("since", Int)], Of::Log),
];

/// The call of that name.
pub fn find(name: &str) -> Option<&'static Call> {
    CALLS.iter().find(|call| call.name == name)
}

impl Call {
    /// Whether it lasts, and goes on in slices.
    pub fn lasts(&self) -> bool {
        session::WAITS.contains(&self.name)
    }

    /// The role that it needs: what advances the virtual clock is no mere looking.
    pub fn role_under(&self, is_virtual: bool) -> Role {
        if is_virtual && self.lasts() { self.role.max(Role::Operate) } else { self.role }
    }

    /// Whether it may be made without command: whoever may operate may stop.
    pub fn is_free(&self) -> bool {
        self.name == "emergency_stop"
    }
}

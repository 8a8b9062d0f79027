// SPDX-License-Identifier: Apache-2.0
//! Which calls command, and what each is about: for the log, which says who gave which command.
use serde_json::{Map, Value as Json};
use supervisor::System;

/// Calls that command, with the argument that says what they are about; empty: the whole system. What only moves virtual time and
/// what goes on with a wait are none.
const COMMANDS: &[(&str, &str)] = &[
    ("processor", "name"),
    ("listen", "endpoint"),
    ("take_over", ""),
    ("source", "name"),
    ("request", "source"),
    ("physical_device", "name"),
    ("reopen_physical_device", "name"),
    ("delete_physical_device", "name"),
    ("place", ""),
    ("download", "name"),
    ("define_verb", "name"),
    ("define_device_type", "name"),
    ("svv", "name"),
    ("delete_svv", "name"),
    ("device", "name"),
    ("enable", "name"),
    ("disable", "name"),
    ("delete_device", "name"),
    ("set_device_parameter", "name"),
    ("create", "verb"),
    ("start", "instance"),
    ("halt", "instance"),
    ("suspend", "instance"),
    ("resume", "instance"),
    ("delete", "instance"),
    ("set", "instance"),
    ("write", "name"),
    ("emergency_stop", "reason"),
    ("emergency_stop_input", "device"),
    ("reset", ""),
    ("pause", ""),
    ("resume_program", ""),
    ("set_mode", "mode"),
    ("enabling_switch", "device"),
    ("define_alarm", "code"),
    ("raise_alarm", "code"),
    ("clear_alarm", "code"),
    ("acknowledge_alarms", ""),
    ("restore_alarms", ""),
    ("raises", "device"),
    ("exchange_verb", "device"),
];

/// What a call that commands is about: an instance, a device, an SVV, or `system`. Nothing where the call only looks, or waits.
pub fn commanded(system: &System, call: &str, arguments: &Map<String, Json>) -> Option<String> {
    let (_, argument) = COMMANDS.iter().find(|(name, _)| *name == call)?;
    Some(match arguments.get(*argument) {
        Some(Json::String(text)) => text.clone(),
        Some(number) if *argument == "instance" => number.as_u64().map_or_else(|| "system".to_owned(), |id| system.instance_name(id)),
        _ => "system".to_owned(),
    })
}

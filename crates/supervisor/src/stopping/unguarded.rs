// SPDX-License-Identifier: Apache-2.0
//! Devices that are not made safe when their process exits or hangs. This is reported when such a device is enabled.
use device::UNGUARDED_WITHOUT_GUARD;
use serde_json::Value;

/// Adds to the driver's description of device `name` whether the device is made safe at its location, with a human-readable explanation.
/// `host` is the host on which the driver's process runs if it is another one; no guard runs there.
pub(crate) fn describe(name: &str, host: Option<&str>, description: &mut Value) {
    let Some(described) = description.as_object_mut() else { return };
    let without_guard = described.remove(UNGUARDED_WITHOUT_GUARD).is_some_and(|v| v == true);
    let is_unguarded = described.get("unguarded").is_some_and(|v| *v == true) || (host.is_some() && without_guard);
    if !is_unguarded {
        return;
    }
    let (whose, guard) = match host {
        Some(host) => (format!("host '{host}' or its process"), format!("no guard runs on host '{host}'")),
        None => ("its process".to_owned(), "the guard cannot reach it".to_owned()),
    };
    let why = format!(
        "device '{name}' continues to execute its last commands if {whose} exits or hangs: it has no watchdog, and {guard}. Set the watchdog of the \
         device itself, if it has one (docs/guard.md)"
    );
    described.insert("unguarded".to_owned(), true.into());
    described.insert("unguarded_why".to_owned(), why.into());
}
